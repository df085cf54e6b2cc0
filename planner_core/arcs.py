"""Lists of what may follow what among the tasks of one satellite."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.comparable import Order, comes_before
from planner_core.jit import kernel
from planner_core.problem import Ints, Longs


class Arcs(NamedTuple):
    """Arcs from each task: ``to[first[a] : first[a + 1]]``.

    Attributes
    ----------
    first
        Shape ``(m + 1,)``.
    to
        Rows in ascending order for each task. Shape ``(num_arcs,)``.
    """

    first: Longs
    to: Ints


@kernel
def covering_arcs(order: Order) -> Arcs:
    """Return the pairs of tasks that may follow each other with none in between.

    Where "may follow" is transitive, as ``order`` must be, a chain of these leads from each
    task to every task that may follow it. There are about ten for each task, far fewer than
    pairs.
    """
    m = len(order.near_from)
    first = np.zeros(m + 1, dtype=np.int64)
    to = np.empty(16 * m + 16, dtype=np.int32)
    count = 0
    for a in range(m):
        # Whatever the longest slew from one of the arcs' ends reaches is covered by it.
        end = m
        b = order.near_from[a]
        while b < end:
            is_covered = not comes_before(order, a, b)
            at = first[a]
            while not is_covered and at < count:
                is_covered = comes_before(order, to[at], b)
                at += 1
            if not is_covered:
                if count == len(to):
                    to = np.concatenate((to, np.empty_like(to)))
                to[count] = b
                count += 1
                end = min(end, order.far_from[b])
            b += 1
        first[a + 1] = count
    return Arcs(first, to[:count].copy())


@kernel
def near_arcs(order: Order) -> Arcs:
    """Return all pairs that the table of near tasks allows."""
    m = len(order.near_from)
    first = np.zeros(m + 1, dtype=np.int64)
    for a in range(m):
        first[a + 1] = first[a]
        for b in range(order.near_from[a], order.far_from[a]):
            first[a + 1] += comes_before(order, a, b)
    to = np.empty(first[m], dtype=np.int32)
    count = 0
    for a in range(m):
        for b in range(order.near_from[a], order.far_from[a]):
            if comes_before(order, a, b):
                to[count] = b
                count += 1
    return Arcs(first, to)


@kernel
def reversed_arcs(arcs: Arcs) -> Arcs:
    """Return the same arcs from their ends to where they come from."""
    m = len(arcs.first) - 1
    first = np.zeros(m + 1, dtype=np.int64)
    for b in arcs.to:
        first[b + 1] += 1
    for b in range(m):
        first[b + 1] += first[b]
    filled = first[:m].copy()
    come_from = np.empty(len(arcs.to), dtype=np.int32)
    for a in range(m):
        for at in range(arcs.first[a], arcs.first[a + 1]):
            b = arcs.to[at]
            come_from[filled[b]] = a
            filled[b] += 1
    return Arcs(first, come_from)
