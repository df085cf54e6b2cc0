"""Heavy chains of one satellite's tasks, with or without repeated targets (``graph``).

The sites on a chain are passed on along the arcs of the relation's Hasse diagram. The result
depends on these arcs, as does the choice among equally heavy chains, so they are built here; for a
satellite that turns more slowly than it tracks, the table of all pairs is used instead.
"""

from __future__ import annotations

import numpy as np

from planner_core.jit import borrowing_inner, inner, kernel
from planner_core.precedence.arcs import Arcs, Words, covering_arcs
from planner_core.precedence.relation import Precedence, direct_precedence, is_transitive_on
from planner_core.problem import Floats, Ints, Longs, SatelliteProblem


def heaviest_chain(satellite: SatelliteProblem, weight: Floats) -> list[int]:
    """Return the tasks of a heaviest chain; a site may occur on it twice."""
    return chain_with_history(satellite, weight, np.full(len(weight), -1, dtype=np.int32))


def chain_with_history(satellite: SatelliteProblem, weight: Floats, site: Ints) -> list[int]:
    """Return the tasks of a heavy chain on which no site occurs twice.

    Parameters
    ----------
    weight, site
        Worth of each task, not negative; its site, or -1 if it may occur again. Shape ``(m,)``.
    """
    before = np.full(len(weight), -1, dtype=np.int32)
    direct = direct_precedence(satellite)
    if is_transitive_on(satellite):
        _, task = longest_path_with_history(weight, site, covering_arcs(direct), before)
    else:
        by_far = np.argsort(direct.far_from, kind="stable")
        _, task = longest_chain_with_history(weight, site, direct, by_far, before)
    return _chain_to(task, before)


def _chain_to(task: int, before: Ints) -> list[int]:
    """Return the tasks of a chain in order of time (EXTRACTPATH of Alg. 3)."""
    chain = []
    while task >= 0:
        chain.append(task)
        task = int(before[task])
    return chain[::-1]


@inner
def _no_history(weight: Floats, site: Ints) -> Words:
    """Return an empty set of sites for each task."""
    num_words = 0
    for a in range(len(weight)):
        if weight[a] > 0.0:
            num_words = max(num_words, (site[a] >> 6) + 1)
    return np.zeros((len(weight), num_words), dtype=np.uint64)


@borrowing_inner
def _holds(history: Words, task: int, site: int) -> bool:
    if site < 0:
        return False
    return bool(history[task, site >> 6] & (np.uint64(1) << np.uint64(site & 63)))


@borrowing_inner
def _note(history: Words, task: int, site: int) -> None:
    if site >= 0:
        history[task, site >> 6] |= np.uint64(1) << np.uint64(site & 63)


@kernel
def longest_path_with_history(
    weight: Floats, site: Ints, arcs: Arcs, before: Ints
) -> tuple[float, int]:
    """Return the weight and last task of a heavy chain on which no site occurs twice.

    Each task passes on the heaviest chain that ends with it or before it, and the set of sites
    on that chain; a chain that already holds a task's site bypasses the task. This is a
    heuristic: the best chain to a task need not be part of the best chain through it.

    Parameters
    ----------
    weight, site
        Worth of each task, not negative; its site, or -1. Shape ``(m,)``.
    before
        Filled with the task before each on its chain, or -1. Shape ``(m,)``.
    """
    m = len(weight)
    history = _no_history(weight, site)
    value = np.zeros(m)
    passed = np.full(m, -1, dtype=np.int32)  # where the heaviest chain comes from
    fitting = np.full(m, -1, dtype=np.int32)  # and the heaviest without this task's site
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
            _note(history, a, site[a])
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
            if weight[b] > 0.0 and not _holds(history, a, site[b]):
                fitting[b] = a
    return best, best_task


@kernel
def longest_chain_with_history(
    weight: Floats, site: Ints, precedence: Precedence, by_far: Longs, before: Ints
) -> tuple[float, int]:
    """Return what ``longest_path_with_history`` returns, from the table of all pairs.

    ``by_far`` lists the tasks in order of ``far_from``.
    """
    near_from, far_from, offset, bits = precedence
    m = len(weight)
    history = _no_history(weight, site)
    reached = np.zeros(m)
    # Tasks that everything from here on may follow, by falling weight of their chains.
    far = np.empty(m, dtype=np.int32)
    num_far, next_far = 0, 0
    best, best_task = 0.0, -1
    for b in range(m):
        while next_far < m and far_from[by_far[next_far]] <= b:
            a = by_far[next_far]
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
        if reached[b] == 0.0:
            before[b] = -1
        for at in range(num_far):
            if reached[far[at]] <= reached[b]:
                break
            if not _holds(history, far[at], site[b]):
                reached[b] = reached[far[at]]
                before[b] = far[at]
                break
        if before[b] >= 0:
            history[b] = history[before[b]]
        _note(history, b, site[b])
        reached[b] += weight[b]
        if reached[b] > best:
            best, best_task = reached[b], b
        for c in range(near_from[b], far_from[b]):
            near = offset[b] + c - near_from[b]
            if not (bits[near >> 3] >> (near & 7)) & 1 or reached[b] <= reached[c]:
                continue
            if not _holds(history, b, site[c]):
                reached[c] = reached[b]
                before[c] = b
    return best, best_task
