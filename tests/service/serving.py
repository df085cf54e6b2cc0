"""Runs the program ``slewline`` as a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def serving(
    tmp_path: Path, command: str, *options: str, **settings: str
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run the program on the folder's database; yield the process and its first line.

    Its log stands in the folder too, under the command's name. ``settings`` go into its
    environment.
    """
    database = f"sqlite:///{tmp_path / 'slewline.db'}"
    words = ["-m", "service", command, "--port", "0", "--database-url", database, *options]
    variables = {f"SLEWLINE_{name}".upper(): value for name, value in settings.items()}
    with (tmp_path / f"{command}.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, *words],
            env=os.environ | variables,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
