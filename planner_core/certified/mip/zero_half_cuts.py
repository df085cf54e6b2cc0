"""Zero-half cuts: from odd numbers of sets of which a plan takes at most one task each.

Add up 2k + 1 such sets, halve and round down: of the tasks in two or more of the sets, each
counted half as often as it is in them, rounded down, a plan takes at most k. Fractional plans
often violate this though they satisfy each set alone.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.certified.tolerances import TAKEN, WHOLE, ZERO_HALF_BROKEN
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import inner, kernel
from planner_core.problem import Floats, Ints, Longs
from planner_core.sorting import stable_order

_NOISE: Final = TUNING.disturbance


class Sets(NamedTuple):
    """Sets of tasks one after another: ``members[offsets[i]:offsets[i + 1]]``."""

    offsets: Longs
    members: Ints


@inner
def _tight_sets(sets: Sets, taken: Floats, column_of: Ints) -> tuple[Ints, Floats]:
    """Return the sets with fractional tasks whose slack is not nearly 1, and that slack."""
    own = np.empty(len(sets.offsets) - 1, dtype=np.int32)
    slack = np.empty(len(own))
    m = 0
    for i in range(len(own)):
        total, has_fraction = 0.0, False
        for at in range(sets.offsets[i], sets.offsets[i + 1]):
            total += taken[sets.members[at]]
            has_fraction |= column_of[sets.members[at]] >= 0
        if has_fraction and total > ZERO_HALF_BROKEN:
            own[m] = i
            slack[m] = max(0.0, 1.0 - total)
            m += 1
    return own[:m], slack[:m]


@kernel
def zero_half_cuts(sets: Sets, taken: Floats, draws: Uint64s) -> Sets:
    """Return odd numbers of sets whose cuts a fractional plan violates.

    Sets are added modulo two so that one fractional task after another, most taken first, is in
    an even number of them (Koster, Zymolka and Kutschka, 2009).
    """
    one = np.uint64(1)
    fractional = np.flatnonzero((taken > WHOLE) & (taken < 1.0 - WHOLE))
    noise = np.array([_NOISE * next_draw(draws) for _ in range(len(fractional))])
    fractional = fractional[stable_order(-taken[fractional] - noise)]
    column_of = np.full(len(taken), -1, dtype=np.int32)
    for i in range(len(fractional)):
        column_of[fractional[i]] = i
    own, slack = _tight_sets(sets, taken, column_of)
    m, n = len(own), len(fractional)
    odd = np.zeros((m, (n + 63) // 64), dtype=np.uint64)
    used = np.zeros((m, (m + 63) // 64), dtype=np.uint64)
    for i in range(m):
        used[i, i >> 6] = one << np.uint64(i & 63)
        for at in range(sets.offsets[own[i]], sets.offsets[own[i] + 1]):
            column = column_of[sets.members[at]]
            if column >= 0:
                odd[i, column >> 6] |= one << np.uint64(column & 63)
    is_odd_number = np.ones(m, dtype=np.bool_)
    is_live = np.ones(m, dtype=np.bool_)
    offsets = [np.int64(0)]
    found = [np.int32(0) for _ in range(0)]
    for column in range(n):
        word, bit = column >> 6, one << np.uint64(column & 63)
        pivot = -1
        for i in range(m):
            if is_live[i] and odd[i, word] & bit and (pivot < 0 or slack[i] < slack[pivot]):
                pivot = i
        if pivot < 0:
            continue
        is_live[pivot] = False
        for i in range(m):
            if not is_live[i] or not odd[i, word] & bit:
                continue
            slack[i] += slack[pivot]
            odd[i] ^= odd[pivot]
            used[i] ^= used[pivot]
            is_odd_number[i] ^= is_odd_number[pivot]
            is_live[i] = slack[i] < 1.0 - ZERO_HALF_BROKEN
            if not is_live[i] or not is_odd_number[i]:
                continue
            lost = slack[i]
            for c in range(n):
                if odd[i, c >> 6] & (one << np.uint64(c & 63)):
                    lost += taken[fractional[c]]
                    if lost >= 1.0 - ZERO_HALF_BROKEN:
                        break
            if lost < 1.0 - ZERO_HALF_BROKEN:
                for j in range(m):
                    if used[i, j >> 6] & (one << np.uint64(j & 63)):
                        found.append(own[j])
                offsets.append(np.int64(len(found)))
    return Sets(np.array(offsets), np.array(found))


@kernel
def deepest(
    sets: Sets, chosen: Sets, taken: Floats, max_cuts: int, max_shared: int
) -> tuple[Ints, Floats]:
    """Return the cuts that a fractional plan violates most, and its distance from each.

    Distances are in the space of the tasks that it takes. No fractional task is in more than about
    ``max_shared`` of the cuts.
    """
    count = np.zeros(len(taken), dtype=np.int32)
    depth = np.zeros(len(chosen.offsets) - 1)
    for cut in range(len(depth)):
        picked = chosen.members[chosen.offsets[cut] : chosen.offsets[cut + 1]]
        total, norm = -float((len(picked) - 1) // 2), 1e-9
        for i in picked:
            for member in sets.members[sets.offsets[i] : sets.offsets[i + 1]]:
                count[member] += 1
        for i in picked:
            for member in sets.members[sets.offsets[i] : sets.offsets[i + 1]]:
                weight = count[member] // 2
                count[member] = 0
                total += weight * taken[member]
                norm += weight * weight if taken[member] > WHOLE else 0.0
        depth[cut] = total / np.sqrt(norm)
    shared = np.zeros(len(taken), dtype=np.int32)
    found = np.empty(max_cuts, dtype=np.int32)
    m = 0
    for cut in stable_order(-depth):
        if m == max_cuts or depth[cut] < TAKEN:
            break
        picked = chosen.members[chosen.offsets[cut] : chosen.offsets[cut + 1]]
        is_free = True
        for i in picked:
            for member in sets.members[sets.offsets[i] : sets.offsets[i + 1]]:
                is_free &= shared[member] < 2 * max_shared
        if not is_free:
            continue
        for i in picked:
            for member in sets.members[sets.offsets[i] : sets.offsets[i + 1]]:
                if WHOLE < taken[member] < 1.0 - WHOLE:
                    # A task with a weight in the cut is in at least two of its sets.
                    shared[member] += 1
        found[m] = cut
        m += 1
    return found[:m], depth[found[:m]]
