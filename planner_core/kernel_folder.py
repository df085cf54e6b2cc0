"""The folder of compiled kernels, found without importing the compiler."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

import platformdirs

from planner_core.sources import PACKAGE, fingerprint


@cache
def kernel_folder() -> Path:
    """Return where compiled kernels are kept; it need not exist yet."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"])
    beside = PACKAGE / "__pycache__"
    if os.access(beside if beside.is_dir() else PACKAGE, os.W_OK):
        return beside / "kernels"
    # Other versions of the package share the parent folder; their kernels are of no use here.
    version = fingerprint(PACKAGE, PACKAGE.rglob("*.py"))
    folder = platformdirs.user_cache_path("slewline") / f"kernels-{version}"
    _bring_along(beside / "kernels", folder)
    return folder


def _bring_along(installed: Path, folder: Path) -> None:
    """Copy the kernels of a read-only installation: Numba reads only from where it can write.

    Kernels compiled for another processor are compiled again into the copy.
    """
    if folder.exists() or not installed.is_dir():
        return
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as spare:
        copy = shutil.copytree(installed, Path(spare) / "kernels")
        with contextlib.suppress(OSError):  # another process was first
            copy.rename(folder)
