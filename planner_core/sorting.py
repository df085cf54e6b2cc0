"""Sorting and searching in kernels; NumPy's functions take seconds to compile for each type."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from planner_core.jit import borrowing_inner, inner

Floats = npt.NDArray[np.float64]
Longs = npt.NDArray[np.int64]


@inner
def stable_order(keys: Floats) -> Longs:
    """Return the indices that sort the keys; equal ones keep their order.

    Examples
    --------
    >>> stable_order(np.array([2.0, 1.0, 2.0, 0.5])).tolist()
    [3, 1, 0, 2]
    """
    n = len(keys)
    order, spare = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for i in range(n):
        order[i] = i
    width = 1
    while width < n:
        for begin in range(0, n, 2 * width):
            left, middle = begin, min(begin + width, n)
            right, end = middle, min(begin + 2 * width, n)
            for at in range(begin, end):
                if left < middle and (right == end or keys[order[left]] <= keys[order[right]]):
                    spare[at] = order[left]
                    left += 1
                else:
                    spare[at] = order[right]
                    right += 1
        order, spare = spare, order
        width *= 2
    return order


@borrowing_inner
def first_not_below(values: Floats, least: float) -> int:
    """Return the index of the first of some ascending values that is ``least`` or more.

    Examples
    --------
    >>> values = np.array([1.0, 2.0, 2.0, 4.0])
    >>> [first_not_below(values, least) for least in (0.0, 2.0, 3.0, 5.0)]
    [0, 1, 3, 4]
    """
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < least:
            low = middle + 1
        else:
            high = middle
    return low
