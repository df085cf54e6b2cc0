"""Runs the program ``slewline`` as a process of its own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def serving(
    tmp_path: Path, command: str, *options: str
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run the program on a fresh database; yield the process and its first line."""
    database = f"sqlite:///{tmp_path / 'slewline.db'}"
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "service",
            command,
            "--port",
            "0",
            "--database-url",
            database,
            *options,
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
