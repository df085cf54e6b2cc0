"""Compiled kernels on disk: each is valid as long as it and all it calls are unchanged.

To tell whether compiled code is stale, Numba looks only at the file of the kernel, not at those of
the kernels compiled into it, and it stores it by the absolute path of the sources. Here a kernel's
stamp covers its own code, the code of the kernels it calls, and the values of the globals they
read: an edit recompiles only what it affects, and the folder of kernels may be copied with the
sources.
"""

from __future__ import annotations

import enum
import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import IO, Any, Final

import numpy as np
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    _CacheLocator,
)

from planner_core.kernel_folder import kernel_folder
from planner_core.sources import PACKAGE, fingerprint

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]  # checked before use

_HOW_KERNELS_ARE_CALLED: Final = ("bundles.py", "jit.py", "kernel_cache.py")


class SharedCache(FunctionCache):
    """The versions of one kernel on disk; if one is missing, the first process compiles it.

    Parameters
    ----------
    dispatcher
        Numba's dispatcher when just made: the kernel's stamp is taken at its first call, when all
        that it calls is defined.
    """

    def __init__(self, dispatcher: Any) -> None:
        super().__init__(dispatcher.py_func)
        self._cache_file = _Index(self._cache_path, self._impl.filename_base, None)
        self._dispatcher = dispatcher
        self._lock: Path | None = None
        self._file: IO[bytes] | None = None

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the compiled kernel; None if the caller has to compile it."""
        self._take_stamp()
        found = super().load_overload(signature, target_context)
        if found is None and self._wait():
            found = super().load_overload(signature, target_context)
        return found

    def signatures(self) -> list[Any]:
        """Return the signatures for which the kernel is on disk, as Numba's types."""
        self._take_stamp()
        return [signature for signature, *_ in self._cache_file._load_index()]

    def let_others(self) -> None:
        """Let processes that wait for this kernel continue."""
        if self._file is not None and self._lock is not None:
            self._lock.unlink(missing_ok=True)
            self._file.close()
            self._file = None

    def _take_stamp(self) -> None:
        if self._cache_file._source_stamp is None:
            self._cache_file._source_stamp = stamp(self._dispatcher)

    def _wait(self) -> bool:
        """Wait until no other process compiles the kernel; return whether one may have done so."""
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


class _Index(IndexDataCacheFile):
    """The index of a kernel's versions; it counts as empty if it names a class that is gone."""

    def _load_index(self) -> dict[Any, str]:
        try:
            known: dict[Any, str] = super()._load_index()
        except (AttributeError, ImportError):
            return {}
        return known


class _Locator(_CacheLocator):
    """The location of a kernel's files, which depends on the name of its module."""

    def __init__(self, function: Callable[..., object]) -> None:
        self._module = function.__module__
        self._py_file = inspect.getfile(function)  # read if Numba cannot store a kernel

    @classmethod
    def from_function(cls, py_func: Callable[..., object], _: str) -> _Locator:
        return cls(py_func)

    def get_cache_path(self) -> str:
        return str(kernel_folder() / self._module)

    def get_source_stamp(self) -> None:
        """Return nothing yet: what the kernel calls may be defined below it."""

    def get_disambiguator(self) -> str:
        return "0"  # kernels of a module have different names


class _Files(CompileResultCacheImpl):
    def __init__(self, py_func: Callable[..., object]) -> None:
        locators: list[Any] = [_Locator]
        self._locator_classes = locators
        super().__init__(py_func)


SharedCache._impl_class = _Files


# What a kernel is made of ----------------------------------------------------------------------


def stamp(dispatcher: Any) -> str:
    """Return a hash of all that decides the compiled code of a kernel.

    Parameters
    ----------
    dispatcher
        Numba's dispatcher of the kernel.
    """
    digest = hashlib.sha256(_how_kernels_are_called().encode())
    seen: set[int] = set()
    open_ = [dispatcher]
    while open_:
        each = open_.pop()
        if id(each) in seen:
            continue
        seen.add(id(each))
        function = each.py_func
        name = f"{function.__module__}.{function.__qualname__}"
        digest.update(repr((name, sorted(each.targetoptions.items()), *_code(function))).encode())
        for global_name, value in _globals(function):
            if _is_dispatcher(value):
                open_.append(value)
            digest.update(repr((global_name, _told(value))).encode())
    return digest.hexdigest()


@cache
def _how_kernels_are_called() -> str:
    return fingerprint(PACKAGE, (PACKAGE / name for name in _HOW_KERNELS_ARE_CALLED))


def _is_dispatcher(value: object) -> bool:
    return hasattr(value, "py_func") and hasattr(value, "targetoptions")


def _code(function: FunctionType) -> list[tuple[object, ...]]:
    """Return the code of the function and those inside it, but not their lines in the file."""
    return [
        (each.co_code, each.co_names, each.co_varnames, _constants(each), each.co_exceptiontable)
        for each in _codes(function.__code__)
    ]


def _codes(code: CodeType) -> list[CodeType]:
    inside = [each for each in code.co_consts if isinstance(each, CodeType)]
    return [code, *(found for each in inside for found in _codes(each))]


def _constants(code: CodeType) -> list[str]:
    return [repr(each) for each in code.co_consts if not isinstance(each, CodeType)]


def _globals(function: FunctionType) -> list[tuple[str, object]]:
    """Return the globals that the function reads, by name.

    The names include those of attributes, so some of these globals may not be read at all.
    """
    names = {name for code in _codes(function.__code__) for name in code.co_names}
    closure = inspect.getclosurevars(function).nonlocals
    known = {**function.__globals__, **closure}
    return [(name, known[name]) for name in sorted(names | set(closure)) if name in known]


def _told(value: Any) -> object:
    """Return what the compiled code depends on in a global."""
    if _is_dispatcher(value):
        return f"{value.py_func.__module__}.{value.py_func.__qualname__}"
    if isinstance(value, type) and issubclass(value, enum.Enum):
        return [(member.name, repr(member.value)) for member in value]
    if isinstance(value, type) and issubclass(value, tuple):
        return (value.__qualname__, getattr(value, "_fields", ()), repr(value.__annotations__))
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, (type, ModuleType, FunctionType)):
        return value.__name__
    if isinstance(value, (bool, int, float, complex, str, bytes, tuple, np.generic, type(None))):
        return repr(value)
    return type(value).__qualname__  # no kernel can read anything else
