"""Longest paths through the tasks of one satellite, on the sparse table of what may follow."""

from __future__ import annotations

import numpy as np

from planner_core.jit import kernel
from planner_core.problem import Bytes, Floats, Ints, Longs


@kernel
def longest_chain(
    weight: Floats, near_from: Ints, far_from: Ints, offset: Longs, bits: Bytes, before: Ints
) -> tuple[float, int]:
    """Return the greatest weight of a chain of tasks that may follow each other, and its end.

    Parameters
    ----------
    weight
        Worth of each task, not negative; tasks worth 0 are passed over. Shape ``(m,)``.
    before
        Filled with the task before each on its best chain, or -1. Shape ``(m,)``.
    """
    m = len(weight)
    value = np.zeros(m)
    # Beyond the longest slew everything may follow: only the best so far counts there.
    far_value = np.zeros(m + 1)
    far_task = np.full(m + 1, -1, dtype=np.int32)
    best_far, best_far_task = 0.0, -1
    best, best_task = 0.0, -1
    for a in range(m):
        if far_value[a] > best_far:
            best_far, best_far_task = far_value[a], far_task[a]
        if weight[a] <= 0.0:
            continue
        if best_far > value[a]:
            value[a] = best_far
            before[a] = best_far_task
        elif value[a] == 0.0:
            before[a] = -1
        value[a] += weight[a]
        if value[a] > best:
            best, best_task = value[a], a
        for b in range(near_from[a], far_from[a]):
            bit = offset[a] + b - near_from[a]
            if (bits[bit >> 3] >> (bit & 7)) & 1 and value[a] > value[b]:
                value[b] = value[a]
                before[b] = a
        if value[a] > far_value[far_from[a]]:
            far_value[far_from[a]] = value[a]
            far_task[far_from[a]] = a
    return best, best_task


@kernel
def longest_chain_with_history(
    weight: Floats,
    place: Ints,
    near_from: Ints,
    far_from: Ints,
    offset: Longs,
    bits: Bytes,
    before: Ints,
) -> tuple[float, int]:
    """Return the weight and end of a heavy chain in which no place stands twice.

    Each task keeps the set of places on its best chain; a chain that holds a task's place
    already does not lead to it. This is a heuristic: the best chain to a task need not be
    part of the best chain through it.

    Parameters
    ----------
    weight, place
        Worth of each task, not negative; where it happens. Shape ``(m,)``.
    before
        Filled with the task before each on its chain, or -1. Shape ``(m,)``.
    """
    m = len(weight)
    num_words = 1
    for a in range(m):
        if weight[a] > 0.0:
            num_words = max(num_words, (place[a] >> 6) + 1)
    history = np.zeros((m, num_words), dtype=np.uint64)
    reached = np.zeros(m)
    # Tasks by falling weight of their chains, among those that everything from here may follow.
    far = np.empty(m, dtype=np.int32)
    num_far, next_far = 0, 0
    in_order_of_far = np.argsort(far_from, kind="mergesort")
    best, best_task = 0.0, -1
    for b in range(m):
        while next_far < m and far_from[in_order_of_far[next_far]] <= b:
            a = in_order_of_far[next_far]
            next_far += 1
            if weight[a] <= 0.0:
                continue
            at = num_far
            while at > 0 and reached[far[at - 1]] < reached[a]:
                far[at] = far[at - 1]
                at -= 1
            far[at] = a
            num_far += 1
        if weight[b] <= 0.0:
            continue
        word = place[b] >> 6
        bit = np.uint64(1) << np.uint64(place[b] & 63)
        if reached[b] == 0.0:
            before[b] = -1
        for at in range(num_far):
            if reached[far[at]] <= reached[b]:
                break
            if not history[far[at], word] & bit:
                reached[b] = reached[far[at]]
                before[b] = far[at]
                break
        if before[b] >= 0:
            history[b] = history[before[b]]
        history[b, word] |= bit
        reached[b] += weight[b]
        if reached[b] > best:
            best, best_task = reached[b], b
        for c in range(near_from[b], far_from[b]):
            near = offset[b] + c - near_from[b]
            if not (bits[near >> 3] >> (near & 7)) & 1 or reached[b] <= reached[c]:
                continue
            if not history[b, place[c] >> 6] & (np.uint64(1) << np.uint64(place[c] & 63)):
                reached[c] = reached[b]
                before[c] = b
    return best, best_task


def chain_to(task: int, before: Ints) -> list[int]:
    """Return the tasks of a chain in order of time (EXTRACTPATH of Alg. 3)."""
    chain = []
    while task >= 0:
        chain.append(task)
        task = int(before[task])
    return chain[::-1]
