"""How hot loops are compiled: once, cached on disk, without the interpreter lock."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, Final, TypeVar, cast

import numba
import platformdirs
from numba.core import types
from numba.core.caching import FunctionCache
from numba.core.compiler_lock import global_compiler_lock

from planner_core.sources import PACKAGE, fingerprint

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]  # asked for before use

F = TypeVar("F", bound=Callable[..., object])

_MARKS: Final = (b"@kernel", b"@borrowing", b"@inlined", b"@unbox")  # how they are called, too


def sources_fingerprint() -> str:
    """Return a hash of all the sources that hold kernels."""
    paths = (
        path for path in PACKAGE.rglob("*.py") if any(mark in path.read_bytes() for mark in _MARKS)
    )
    return fingerprint(PACKAGE, paths)


def _set_cache_folder() -> None:
    """Keep compiled kernels in a folder of their own for each state of the sources.

    Numba looks only at the file of a kernel to tell whether its cache is stale, not at the
    files of the kernels it calls: an edit there, or an upgrade, would go unnoticed.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    name = f"kernels-{sources_fingerprint()}"
    beside = PACKAGE / "__pycache__"
    folder = beside / name
    if not os.access(beside if beside.is_dir() else PACKAGE, os.W_OK):
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


def kernel_folder() -> Path:
    """Return where compiled kernels are kept; it need not exist yet."""
    config: Any = numba.config
    return Path(config.CACHE_DIR)


_DISPATCHERS: Final[list[Any]] = []


def compiled_kernels() -> list[Any]:
    """Return Numba's dispatchers of all kernels that are compiled on their own, as imported."""
    return list(_DISPATCHERS)


def stored_signatures() -> dict[str, list[str]]:
    """Return with which arguments each of these is compiled on disk, by its full name."""
    return {
        f"{each.py_func.__module__}.{each.py_func.__qualname__}": each._cache.signatures()
        for each in _DISPATCHERS
    }


def kernel(function: F) -> F:
    """Compile a loop over plain arrays; type checkers keep seeing the Python function."""
    return _once(function, nogil=True)


def borrowing(function: F) -> F:
    """Compile a loop that makes no arrays of its own: no slices, no ``np.empty``.

    It then counts no references. Handing a tuple of arrays from kernel to kernel counts one
    up and down for each array, atomically, which made a search ten times as slow.
    """
    return _once(function, nogil=True, _nrt=False)


def inlined(function: F) -> F:
    """Compile a small step into its callers, for arguments of any types."""
    return cast(F, numba.njit(cache=True, nogil=True, inline="always")(function))


def _once(function: F, **options: bool) -> F:
    """Compile a function for one signature, in one of the processes that ask for it.

    Numba compiles anew for the literal 0, an int32 and an int64; here all are int64.
    """
    all_options: dict[str, Any] = {"cache": True, "no_cfunc_wrapper": True, **options}
    dispatcher: Any = numba.njit(**all_options)(function)
    if not hasattr(dispatcher, "overloads"):  # compilation is switched off
        return cast(F, dispatcher)
    dispatcher._cache = cache = _SharedCache(function)
    compile_exactly = dispatcher.compile

    def compile_once(signature: Any) -> Any:
        with global_compiler_lock:  # before the file's: threads take both in the same order
            try:
                return compile_exactly(tuple(_widest(kind) for kind in signature))
            finally:
                cache.let_others()

    dispatcher.compile = compile_once
    _DISPATCHERS.append(dispatcher)
    return cast(F, dispatcher)


def _widest(kind: Any) -> Any:
    """Return the one type that stands for a scalar of this one."""
    kind = types.unliteral(kind)
    return types.int64 if isinstance(kind, types.Integer) and kind != types.uint64 else kind


class _SharedCache(FunctionCache):
    """Kernels on disk; where one is missing, the first process compiles and others wait."""

    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        self._lock: Path | None = None
        self._file: IO[bytes] | None = None

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled kernel; None where the caller is to compile it."""
        found = super().load_overload(signature, target_context)
        if found is None and self._wait():
            found = super().load_overload(signature, target_context)
        return found

    def signatures(self) -> list[str]:
        """Return with which arguments the kernel is on disk."""
        return [str(signature) for signature, *_ in self._cache_file._load_index()]

    def let_others(self) -> None:
        """Let processes go on that wait for this kernel."""
        if self._file is not None and self._lock is not None:
            self._lock.unlink(missing_ok=True)
            self._file.close()
            self._file = None

    def _wait(self) -> bool:
        """Wait until nobody else compiles the kernel; return whether somebody may have."""
        if fcntl is None or self._file is not None:
            return False
        self._lock = Path(self.cache_path) / f"{self._py_func.__qualname__}.lock"
        try:
            self._lock.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._lock.open("wb")
            fcntl.flock(self._file, fcntl.LOCK_EX)
        except OSError:  # nowhere to write: each process compiles for itself
            return False
        return True
