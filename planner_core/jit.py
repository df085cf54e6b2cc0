"""How hot loops are compiled: once, cached on disk, without the interpreter lock."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile a loop over plain arrays; type checkers keep seeing the Python function."""
    return cast(F, numba.njit(cache=True, nogil=True)(function))


def inlined(function: F) -> F:
    """Compile a small step of a hot loop into its callers.

    A call that hands over a ``Track`` counts references to its thirty arrays, which costs more
    than the step itself.
    """
    return cast(F, numba.njit(cache=True, nogil=True, inline="always")(function))
