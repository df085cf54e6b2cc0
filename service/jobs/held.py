"""A worker's own copy of the opportunities of scenarios it has planned, for the next plans.

A replan has the opportunities of its parent plan, except for new targets. Every worker can read
those from the database; the worker that computed them also has them in a folder of its own, where
it needs neither the database nor decompression. Only speed depends on it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import Final

import psutil

MOST_BYTES: Final = 512 * 2**20
"""Per folder; the opportunities of 24 satellites and 10,000 targets take 60 MB."""
_PREFIX: Final = "slewline-held-"


class HeldBlocks:
    """Files of opportunity blocks, named by scenario hash; the least recently used go first.

    Parameters
    ----------
    folder
        Used by one worker only, whose jobs write there one after another.
    """

    def __init__(self, folder: Path, most_bytes: int = MOST_BYTES) -> None:
        self._folder, self._most_bytes = folder, most_bytes

    def load(self, sha256: str) -> bytes | None:
        """Return the block held for a scenario, or None."""
        path = self._path(sha256)
        try:
            block = path.read_bytes()
            os.utime(path)
        except OSError:
            return None
        return block

    def holds(self, sha256: str) -> bool:
        """Return whether a block is held for a scenario."""
        return self._path(sha256).exists()

    def save(self, sha256: str, block: bytes) -> None:
        """Hold a block if there is room. A full disk is not an error."""
        if len(block) > self._most_bytes:
            return
        with contextlib.suppress(OSError):
            self._make_room(len(block))
            # Write to another name first: a job killed here must not leave half a file.
            number, name = tempfile.mkstemp(dir=self._folder)
            with open(number, "wb") as file:
                file.write(block)
            os.replace(name, self._path(sha256))

    def _path(self, sha256: str) -> Path:
        return self._folder / f"{sha256}.npz"

    def _make_room(self, num_bytes: int) -> None:
        files = [(path.stat(), path) for path in self._folder.iterdir()]
        files.sort(key=lambda file: file[0].st_mtime_ns)
        held = sum(stat.st_size for stat, _ in files)
        for stat, path in files:
            if held + num_bytes <= self._most_bytes:
                return
            path.unlink()
            held -= stat.st_size


def make_folder() -> Path | None:
    """Return a new folder for this process, or None if none can be made.

    Removes the folders of processes that were killed.
    """
    root = Path(tempfile.gettempdir())
    for folder in root.glob(f"{_PREFIX}*"):
        pid = folder.name.removeprefix(_PREFIX).partition("-")[0]
        if pid.isdigit() and (int(pid) == os.getpid() or not psutil.pid_exists(int(pid))):
            shutil.rmtree(folder, ignore_errors=True)
    try:
        return Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-"))
    except OSError:
        return None


def remove_folder(folder: Path | None) -> None:
    """Remove a folder with all it holds."""
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)
