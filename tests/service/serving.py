"""Runs the program ``slewline`` as a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.service import prepared
from tests.service.prepared import Program


@contextmanager
def serving(
    tmp_path: Path, command: str, *options: str, **settings: str
) -> Iterator[tuple[Program, str]]:
    """Run the program on the folder's database; yield the process and its first line.

    Its log is in the folder too, under the command's name. ``settings`` go into its
    environment.
    """
    words = _words(tmp_path, command, options)
    variables = {f"SLEWLINE_{name}".upper(): value for name, value in settings.items()}
    with (tmp_path / f"{command}.log").open("wb") as log:
        process = prepared.start(words, os.environ | variables, stderr=log.fileno())
    with _first_line(process) as line:
        yield process, line


@contextmanager
def serving_as_installed(
    tmp_path: Path, command: str, *options: str
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Do the same as ``serving``, but start the program as a user does: for tests of the start."""
    words = [sys.executable, "-m", *_words(tmp_path, command, options)]
    with (tmp_path / f"{command}.log").open("wb") as log:
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=log, text=True)
    with _first_line(process) as line:
        yield process, line


def _words(folder: Path, command: str, options: tuple[str, ...]) -> list[str]:
    database = f"sqlite:///{folder / 'slewline.db'}"
    return ["service", command, "--port", "0", "--database-url", database, *options]


@contextmanager
def _first_line(process: Program) -> Iterator[str]:
    """Yield a process's first line of output, and end the process."""
    assert process.stdout is not None
    try:
        yield process.stdout.readline()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
