"""Sets of tasks of one satellite that exclude each other, of which a plan takes at most one.

Rows are those of one satellite. Two tasks exclude each other if neither precedes the other; a set
of tasks of which each two exclude each other is a clique.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.sizes import CLIQUE_STEPS
from planner_core.certified.tolerances import CLIQUE_BROKEN
from planner_core.jit import borrowing_inner, inner, kernel
from planner_core.precedence.relation import Precedence, are_comparable, comes_before
from planner_core.problem import Floats, Ints, Longs
from planner_core.sorting import stable_order


@kernel
def excluding_pairs(precedence: Precedence) -> tuple[Ints, Ints]:
    """Return all pairs of tasks that exclude each other, the earlier one first."""
    m = len(precedence.near_from)
    count = 0
    for a in range(m):
        for b in range(a + 1, precedence.far_from[a]):
            count += not comes_before(precedence, a, b)
    first, second = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
    count = 0
    for a in range(m):
        for b in range(a + 1, precedence.far_from[a]):
            if not comes_before(precedence, a, b):
                first[count], second[count] = a, b
                count += 1
    return first, second


@inner
def _first_near(precedence: Precedence) -> Ints:
    """Return, for each row, the first row that it may exclude."""
    m = len(precedence.near_from)
    first = np.empty(m, dtype=np.int32)
    at = 0
    for b in range(m):
        while at < b and precedence.far_from[at] <= b:
            at += 1
        first[b] = at
    return first


@kernel
def clique_cover(precedence: Precedence) -> tuple[Longs, Ints]:
    """Return offsets and members of cliques that cover every pair of tasks excluding each other.

    Greedy: each pair not yet covered is extended, in order of time, by every task that
    excludes all members so far.
    """
    m = len(precedence.near_from)
    first_near = _first_near(precedence)
    base = np.zeros(m + 1, dtype=np.int64)
    for a in range(m):
        base[a + 1] = base[a] + max(0, precedence.far_from[a] - a - 1)
    covered = np.zeros(base[m], dtype=np.bool_)
    offsets = [np.int64(0)]
    members = [np.int32(0) for _ in range(0)]
    clique = np.empty(m, dtype=np.int32)
    for a in range(m):
        for b in range(a + 1, precedence.far_from[a]):
            if covered[base[a] + b - a - 1] or comes_before(precedence, a, b):
                continue
            clique[0], clique[1] = a, b
            size = _extend(precedence, clique, 2, first_near[a], precedence.far_from[a])
            for i in range(size):
                members.append(clique[i])
                for j in range(size):
                    if clique[i] < clique[j]:
                        covered[base[clique[i]] + clique[j] - clique[i] - 1] = True
            offsets.append(np.int64(len(members)))
    return np.array(offsets), np.array(members)


@inner
def _extend(precedence: Precedence, clique: Ints, size: int, from_row: int, to_row: int) -> int:
    """Add every row of the range that excludes all members; return the new size."""
    for row in range(from_row, to_row):
        is_free = True
        for i in range(size):
            if clique[i] == row or are_comparable(precedence, clique[i], row):
                is_free = False
                break
        if is_free:
            clique[size] = row
            size += 1
    return size


@kernel
def violated_cliques(precedence: Precedence, taken: Floats) -> tuple[Longs, Ints]:
    """Return offsets and members of cliques of which a fractional plan takes more than one task.

    For each fractional task, the heaviest clique in which it is the first, if violated, is extended
    to a maximal one.

    Parameters
    ----------
    taken
        How much of each task the plan takes, 0 to 1. Shape ``(m,)``.
    """
    m = len(taken)
    first_near = _first_near(precedence)
    offsets = [np.int64(0)]
    members = [np.int32(0) for _ in range(0)]
    clique = np.empty(m, dtype=np.int32)
    for row in range(m):
        if taken[row] <= CLIQUE_BROKEN or taken[row] >= 1.0 - CLIQUE_BROKEN:
            continue
        size, total = _heaviest_clique(precedence, taken, row, clique)
        if total <= 1.0 + CLIQUE_BROKEN:
            continue
        size = _extend(precedence, clique, size, first_near[row], precedence.far_from[row])
        _sort(clique[:size])
        for i in range(size):
            members.append(clique[i])
        offsets.append(np.int64(len(members)))
    return np.array(offsets), np.array(members)


@inner
def _heaviest_clique(
    precedence: Precedence, taken: Floats, row: int, clique: Ints
) -> tuple[int, float]:
    """Fill ``clique`` with the heaviest clique of ``row`` and later taken tasks; return its size.

    Also returns its weight. Depth first over the candidates by falling weight, with the sum of the
    remaining weights as the bound; cut short if it takes long, as a good clique is enough.
    """
    others = np.empty(max(0, precedence.far_from[row] - row - 1), dtype=np.int32)
    falling = np.empty(len(others))
    num_others = 0
    for other in range(row + 1, precedence.far_from[row]):
        if taken[other] > CLIQUE_BROKEN and not are_comparable(precedence, row, other):
            others[num_others], falling[num_others] = other, -taken[other]
            num_others += 1
    others = others[stable_order(falling[:num_others])]
    k = len(others)
    # Which candidates may still join, at each depth.
    free = np.zeros((k + 1, k), dtype=np.bool_)
    free[0] = True
    at = np.zeros(k + 2, dtype=np.int64)
    chosen = np.empty(k + 1, dtype=np.int64)
    weight = np.zeros(k + 2)
    weight[0] = taken[row]
    best, best_size = 0.0, 0
    depth, steps = 0, 0
    while depth >= 0:
        if weight[depth] > best:
            best, best_size = weight[depth], depth + 1
            clique[0] = row
            for i in range(depth):
                clique[i + 1] = others[chosen[i]]
        steps += 1
        i = at[depth]
        while i < k and not free[depth, i]:
            i += 1
        remaining = 0.0
        for j in range(i, k):
            if free[depth, j]:
                remaining += taken[others[j]]
        if i == k or steps > CLIQUE_STEPS or weight[depth] + remaining <= best + 1e-9:
            depth -= 1
            continue
        at[depth] = i + 1
        chosen[depth] = i
        for j in range(i + 1, k):
            free[depth + 1, j] = free[depth, j] and not are_comparable(
                precedence, others[i], others[j]
            )
        free[depth + 1, : i + 1] = False
        weight[depth + 1] = weight[depth] + taken[others[i]]
        at[depth + 1] = i + 1
        depth += 1
    return best_size, best


@borrowing_inner
def _sort(values: Ints) -> None:
    for i in range(1, len(values)):
        value, at = values[i], i
        while at > 0 and values[at - 1] > value:
            values[at] = values[at - 1]
            at -= 1
        values[at] = value


@kernel
def detours(direct: Precedence, closed: Precedence) -> tuple[Ints, Ints, Longs, Ints]:
    """Return the pairs of tasks that need another between them, and which ones may be it.

    Returns the earlier tasks, the later tasks, then offsets and rows of the tasks of which one must
    come right after the earlier one.
    """
    first = [np.int32(0) for _ in range(0)]
    second = [np.int32(0) for _ in range(0)]
    offsets = [np.int64(0)]
    between = [np.int32(0) for _ in range(0)]
    for a in range(len(direct.near_from)):
        for b in range(direct.near_from[a], direct.far_from[a]):
            if comes_before(direct, a, b) or not comes_before(closed, a, b):
                continue
            first.append(np.int32(a))
            second.append(np.int32(b))
            for c in range(direct.near_from[a], b):
                if comes_before(direct, a, c) and comes_before(closed, c, b):
                    between.append(np.int32(c))
            offsets.append(np.int64(len(between)))
    return np.array(first), np.array(second), np.array(offsets), np.array(between)
