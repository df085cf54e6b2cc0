"""Random numbers inside kernels, repeatable from a seed and independent of other generators."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from planner_core.jit import borrowing_inner

Uint64s = npt.NDArray[np.uint64]


def draws_of(seed: int) -> Uint64s:
    """Return the state of a generator. Shape ``(1,)``."""
    return np.array([seed & 0xFFFF_FFFF_FFFF_FFFF], dtype=np.uint64)


@borrowing_inner
def next_draw(state: Uint64s) -> float:
    """Return the next number in [0, 1) of a generator (splitmix64)."""
    state[0] += np.uint64(0x9E3779B97F4A7C15)
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) / 9007199254740992.0
