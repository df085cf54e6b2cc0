"""Heavy chains of one satellite's tasks in which no target stands twice (a heuristic of ``graph``).

What a chain has passed is handed on along the arcs of the relation's Hasse diagram, and the
answer depends on them; so they are made here, as is the table of all pairs for a satellite that
turns more slowly than it tracks.
"""

from __future__ import annotations

import numpy as np

from planner_core.jit import kernel
from planner_core.precedence.arcs import Arcs, covering_arcs
from planner_core.precedence.relation import (
    Precedence,
    comes_before,
    direct_precedence,
    is_transitive_on,
)
from planner_core.problem import Floats, Ints, SatelliteProblem


def chain_with_history(satellite: SatelliteProblem, weight: Floats, place: Ints) -> list[int]:
    """Return the tasks of a heavy chain in which no place stands twice.

    Parameters
    ----------
    weight, place
        Worth of each task, not negative; where it happens. Shape ``(m,)``.
    """
    before = np.full(len(weight), -1, dtype=np.int32)
    direct = direct_precedence(satellite)
    if is_transitive_on(satellite):
        _, task = longest_path_with_history(weight, place, covering_arcs(direct), before)
    else:
        _, task = longest_chain_with_history(weight, place, direct, before)
    return chain_to(task, before)


def chain_to(task: int, before: Ints) -> list[int]:
    """Return the tasks of a chain in order of time (EXTRACTPATH of Alg. 3)."""
    chain = []
    while task >= 0:
        chain.append(task)
        task = int(before[task])
    return chain[::-1]


def heaviest_chain(satellite: SatelliteProblem, weight: Floats) -> list[int]:
    """Return the tasks of the heaviest chain, pair by pair; ``weight`` as above.

    For turns in motion, of which a skyline of labels knows no dominance.
    """
    before = np.full(len(weight), -1, dtype=np.int32)
    return chain_to(_heaviest_chain(weight, direct_precedence(satellite), before), before)


@kernel
def _heaviest_chain(weight: Floats, precedence: Precedence, before: Ints) -> int:
    """Fill in the task before each on its heaviest chain; return the last one's end, or -1."""
    m = len(weight)
    value, top = np.zeros(m), np.zeros(m + 1)
    last = -1
    for b in range(m):
        top[b + 1] = top[b]
        if weight[b] <= 0.0:
            continue
        best = 0.0
        a = b - 1
        # No task before has more than the top up to there.
        while a >= 0 and top[a + 1] > best:
            if value[a] > best and comes_before(precedence, a, b):
                best = value[a]
                before[b] = a
            a -= 1
        value[b] = best + weight[b]
        if value[b] > top[b]:
            top[b + 1] = value[b]
            last = b
    return last


@kernel
def longest_path_with_history(
    weight: Floats, place: Ints, arcs: Arcs, before: Ints
) -> tuple[float, int]:
    """Return the weight and end of a heavy chain in which no place stands twice.

    Each task hands on the heaviest chain that ends with it or before it, and the set of places
    on that chain; a chain that holds a task's place already goes past the task. This is a
    heuristic: the best chain to a task need not be part of the best chain through it.

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
    value = np.zeros(m)
    passed = np.full(m, -1, dtype=np.int32)  # where the heaviest chain comes from
    fitting = np.full(m, -1, dtype=np.int32)  # and the heaviest without this task's place
    last = np.full(m, -1, dtype=np.int32)
    best, best_task = 0.0, -1
    for a in range(m):
        total = value[fitting[a]] if fitting[a] >= 0 else 0.0
        other = value[passed[a]] if passed[a] >= 0 else 0.0
        if weight[a] > 0.0 and total + weight[a] >= other:
            source = fitting[a]
            if source >= 0:
                history[a] = history[source]
                before[a] = last[source]
            else:
                before[a] = -1
            history[a, place[a] >> 6] |= np.uint64(1) << np.uint64(place[a] & 63)
            value[a] = total + weight[a]
            last[a] = a
            if value[a] > best:
                best, best_task = value[a], a
        elif passed[a] >= 0:
            history[a] = history[passed[a]]
            value[a] = other
            last[a] = last[passed[a]]
        for at in range(arcs.first[a], arcs.first[a + 1]):
            b = arcs.to[at]
            if passed[b] < 0 or value[a] > value[passed[b]]:
                passed[b] = a
            if fitting[b] >= 0 and value[a] <= value[fitting[b]]:
                continue
            if weight[b] > 0.0 and not (
                history[a, place[b] >> 6] & (np.uint64(1) << np.uint64(place[b] & 63))
            ):
                fitting[b] = a
    return best, best_task


@kernel
def longest_chain_with_history(
    weight: Floats, place: Ints, precedence: Precedence, before: Ints
) -> tuple[float, int]:
    """Return what ``longest_path_with_history`` does, on the table of all pairs."""
    near_from, far_from, offset, bits = precedence
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
