"""Compilation of hot loops: once, cached on disk, run without the interpreter lock."""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, TypeVar, cast

import numba
from numba.core import types
from numba.core.compiler_lock import global_compiler_lock

from planner_core.kernel_cache import SharedCache, stamp

F = TypeVar("F", bound=Callable[..., object])

_DISPATCHERS: Final[list[Any]] = []


def compiled_kernels() -> list[Any]:
    """Return Numba's dispatchers of all kernels imported so far that are compiled separately."""
    return list(_DISPATCHERS)


def stored_signatures() -> dict[str, list[str]]:
    """Return the signatures for which each of these is compiled on disk, by its full name."""
    return {
        f"{each.py_func.__module__}.{each.py_func.__qualname__}": [
            str(signature) for signature in each._cache.signatures()
        ]
        for each in _DISPATCHERS
    }


def load_stored() -> None:
    """Load from disk all kernels that Python calls in the modules imported so far."""
    for each in _DISPATCHERS:
        if _is_for_kernels(each):
            continue  # it is compiled into its callers
        for signature in each._cache.signatures():
            each.compile(signature)


def all_stamps() -> str:
    """Return a hash of all that decides the compiled code of the modules imported so far."""
    stamps = sorted(stamp(each) for each in _DISPATCHERS)
    return hashlib.sha256("".join(stamps).encode()).hexdigest()


def kernel(function: F) -> F:
    """Compile a loop over plain arrays; type checkers still see the Python function."""
    return _once(function)


def inner(function: F) -> F:
    """Compile a function that only kernels call.

    The wrapper for calls from Python is left out; Python runs the function uncompiled.
    """
    return _once(function, no_cpython_wrapper=True)


def borrowing(function: F) -> F:
    """Compile a loop that makes no arrays of its own: no slices, no ``np.empty``.

    It then counts no references. Passing a tuple of arrays between kernels counts one up and
    down for each array, atomically, which made a search ten times as slow.
    """
    return _once(function, _nrt=False)


def borrowing_inner(function: F) -> F:
    """Compile a function that only kernels call and that makes no arrays of its own."""
    return _once(function, _nrt=False, no_cpython_wrapper=True)


def inlined(function: F) -> F:
    """Compile a small step that makes no arrays, once, and copy it into its callers.

    The optimizer copies it, after types are known: Numba's own copies are typed again in each
    caller, which took a quarter of the compilation time.
    """
    return _once(function, _nrt=False, no_cpython_wrapper=True, forceinline=True)


def templated(function: F) -> F:
    """Copy a small step into its callers before types are known, for arguments of any types."""
    return cast(F, numba.njit(nogil=True, inline="always")(function))


def _once(function: F, **options: bool) -> F:
    """Compile a function once per signature, in only one of the processes that need it.

    Numba compiles separately for the literal 0, an int32 and an int64; here all are int64.
    """
    all_options: dict[str, Any] = {"no_cfunc_wrapper": True, "nogil": True, **options}
    dispatcher: Any = numba.njit(**all_options)(function)
    if not hasattr(dispatcher, "overloads"):  # compilation is switched off
        return cast(F, dispatcher)
    dispatcher._cache = cache = SharedCache(dispatcher)
    compile_exactly = dispatcher.compile

    def compile_once(signature: Any) -> Any:
        with global_compiler_lock, _no_collection():  # threads take it before the file's lock
            try:
                return compile_exactly(tuple(_widest(kind) for kind in signature))
            finally:
                cache.let_others()

    dispatcher.compile = compile_once
    if _is_for_kernels(dispatcher):
        dispatcher._insert = lambda *_: None  # Python finds no compiled version
        dispatcher._compile_for_args = lambda *_, **__: function
    _DISPATCHERS.append(dispatcher)
    return cast(F, dispatcher)


def _is_for_kernels(dispatcher: Any) -> bool:
    return bool(dispatcher.targetoptions.get("no_cpython_wrapper"))


@contextmanager
def _no_collection() -> Iterator[None]:
    """Switch off garbage collection: a compiler makes many objects and little garbage.

    Collection took a tenth of its time. May be nested by the holder of the compiler's lock.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _widest(kind: Any) -> Any:
    """Return the type as which a scalar of this type is compiled."""
    kind = types.unliteral(kind)
    return types.int64 if isinstance(kind, types.Integer) and kind != types.uint64 else kind
