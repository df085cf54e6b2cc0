"""How hot loops are compiled: once, cached on disk, without the interpreter lock."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
import platformdirs

F = TypeVar("F", bound=Callable[..., object])

_PACKAGE: Final = Path(__file__).parent
_MARKS: Final = (b"@kernel", b"@borrowing", b"@inlined")


def sources_fingerprint() -> str:
    """Return a hash of all the sources that hold kernels."""
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        source = path.read_bytes()
        if any(mark in source for mark in _MARKS):
            digest.update(path.relative_to(_PACKAGE).as_posix().encode() + b"\0" + source)
    return digest.hexdigest()[:16]


def _set_cache_folder() -> None:
    """Keep compiled kernels in a folder of their own for each state of the sources.

    Numba looks only at the file of a kernel to tell whether its cache is stale, not at the
    files of the kernels it calls: an edit there, or an upgrade, would go unnoticed.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    name = f"kernels-{sources_fingerprint()}"
    beside = _PACKAGE / "__pycache__"
    folder = beside / name
    if not os.access(beside if beside.is_dir() else _PACKAGE, os.W_OK):
        folder = platformdirs.user_cache_path("slewline") / name
        _bring_along(beside / name, folder)
    config: Any = numba.config
    config.CACHE_DIR = str(folder)


def _bring_along(installed: Path, folder: Path) -> None:
    """Copy the kernels of an installation that is read-only: Numba reads only where it can write.

    What was compiled for another processor is compiled again into the copy.
    """
    if folder.exists() or not installed.is_dir():
        return
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as spare:
        copy = shutil.copytree(installed, Path(spare) / "kernels")
        with contextlib.suppress(OSError):  # another process was first
            copy.rename(folder)


_set_cache_folder()


def kernel(function: F) -> F:
    """Compile a loop over plain arrays; type checkers keep seeing the Python function."""
    return cast(F, numba.njit(cache=True, nogil=True)(function))


def borrowing(function: F) -> F:
    """Compile a loop that makes no arrays of its own: no slices, no ``np.empty``.

    It then counts no references. Handing a tuple of arrays from kernel to kernel counts one
    up and down for each array, atomically, which made a search ten times as slow.
    """
    options: dict[str, Any] = {"cache": True, "nogil": True, "_nrt": False}
    return cast(F, numba.njit(**options)(function))


def inlined(function: F) -> F:
    """Compile a small step of a hot loop into its callers; it makes no arrays either."""
    return cast(F, numba.njit(cache=True, nogil=True, inline="always")(function))
