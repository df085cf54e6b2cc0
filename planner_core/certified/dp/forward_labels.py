"""The most that one satellite can gain under battery and recorder: forward, exact in energy.

At-most-once constraints are relaxed: a target's worth is what its multiplier leaves, and may be
gained again and again. For each whole value and data level only the highest energy matters.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.resource_network import Network, give_between, may_be_next
from planner_core.certified.signs import STOPPED, UNREACHED
from planner_core.certified.tuning import TUNING
from planner_core.jit import borrowing_inner, inlined, inner, kernel
from planner_core.problem import (
    Bytes,
    Floats,
    Ints,
    Longs,
    Singles,
)

_TIDY_EVERY: Final = TUNING.patience


class Labels(NamedTuple):
    """The labels right after each task ``i``: entries ``first[i]`` up to ``first[i + 1]``.

    Whole value, data level and energy of each entry; shape ``(num_labels,)``.
    """

    first: Longs
    value: Ints
    level: Ints
    energy: Floats


@bundle
class Goal(NamedTuple):
    """The least that a path must gain; labels that cannot reach it are dropped.

    Attributes
    ----------
    units
        That gain.
    idle, after
        The result of ``least_energy`` for gains of at least that much.
    credit
        The most by which the gain left from each data level exceeds what ``least_energy`` counts,
        if its weights price data. Shape ``(num_levels,)``.
    """

    units: int
    idle: Singles
    after: Singles
    credit: Ints


class Reached(NamedTuple):
    """The highest energy at each data level and whole value, after one task or while idle.

    Attributes
    ----------
    energy
        For values from ``first`` on. Shape ``(num_levels, num_values)``.
    low, high
        The lowest and the highest value reached at each level. Shape ``(num_levels,)``.
    """

    energy: Floats
    first: int
    low: Ints
    high: Ints


@kernel
def most_value(
    network: Network,
    levels: DataLevels,
    weight: Ints,
    end_cost: Ints,
    goal: Goal,
    top: int,
    keeps_labels: bool,
    stop: Bytes,
) -> tuple[int, Labels]:
    """Return the most value of any path, ``UNREACHED`` if below the goal, or ``STOPPED``.

    Parameters
    ----------
    weight
        Whole worth of each task; a negative one costs a path no more than it has gained. Shape
        ``(m,)``.
    end_cost
        What a path pays if it ends at each data level, not falling. Shape ``(num_levels,)``.
    top
        No path gains more.
    keeps_labels
        Whether to return the labels as well, for ``path_of``; none otherwise.
    """
    m, num_levels = len(weight), levels.num_levels
    low = np.full(num_levels, top + 1, dtype=np.int32)
    high = np.full(num_levels, -1, dtype=np.int32)
    energy = np.full((num_levels, top + 1), -np.inf)
    if levels.start < num_levels:
        energy[levels.start, 0] = network.energy_start
        low[levels.start], high[levels.start] = 0, 0
    idle = Reached(energy, 0, low, high)
    energies = _none_yet(m)
    first_value = np.zeros(m, dtype=np.int64)
    own_low = np.full((m, num_levels), top + 1, dtype=np.int32)
    own_high = np.full((m, num_levels), -1, dtype=np.int32)
    best_so_far = np.empty(top + 1)
    capacity = 1024 if keeps_labels else 0
    kept = Labels(
        np.zeros(m + 1, dtype=np.int64),
        np.empty(capacity, dtype=np.int32),
        np.empty(capacity, dtype=np.int32),
        np.empty(capacity),
    )
    merged = 0
    for k in range(m):
        if stop[0]:
            return STOPPED, kept
        while merged < m and network.idle_from[network.by_idle[merged]] <= k:
            i = network.by_idle[merged]
            _merge(Reached(energies[i], first_value[i], own_low[i], own_high[i]), idle)
            energies[i] = np.empty((0, 0))
            merged += 1
        if k % _TIDY_EVERY == 0:
            _tidy(idle, goal.idle[k], goal, best_so_far)
        kept.first[k + 1] = kept.first[k]
        lowest, highest = _span_of(network, levels, k, low, high, own_low, own_high)
        lowest, highest = max(0, lowest + weight[k]), max(0, min(top, highest + weight[k]))
        if lowest > highest:
            if network.is_kept[k]:
                _forget(k, top, idle, own_low, own_high)
            continue
        energy = np.full((num_levels, highest - lowest + 1), -np.inf)
        energies[k], first_value[k] = energy, lowest
        own = Reached(energy, lowest, own_low[k], own_high[k])
        _take(network, levels, k, weight[k], 0.0, idle, own)
        for at in range(network.straight_first[k], network.straight_first[k + 1]):
            i = network.straight_rows[at]
            before = Reached(energies[i], first_value[i], own_low[i], own_high[i])
            _take(network, levels, k, weight[k], network.straight_give[at], before, own)
        _tidy(own, goal.after[k], goal, best_so_far)
        if network.is_kept[k]:
            _forget(k, top, idle, own_low, own_high)
        if keeps_labels:
            kept = _kept(kept, k, own)
    while merged < m:
        i = network.by_idle[merged]
        _merge(Reached(energies[i], first_value[i], own_low[i], own_high[i]), idle)
        merged += 1
    best = UNREACHED
    for y in range(min(levels.end + 1, num_levels)):
        for v in range(max(goal.units + end_cost[y], low[y]), high[y] + 1):
            if idle.energy[y, v] > -np.inf:
                best = max(best, v - end_cost[y])
    return best, kept


@inner
def _none_yet(num_tasks: int) -> list[Floats]:
    """Return storage for the energies after each task."""
    # In the caller, among named tuples, Numba would make the tuples' arrays twice.
    return [np.empty((0, 0)) for _ in range(num_tasks)]


@borrowing_inner
def _span_of(
    network: Network,
    levels: DataLevels,
    row: int,
    low: Ints,
    high: Ints,
    own_low: Ints,
    own_high: Ints,
) -> tuple[int, int]:
    """Return the lowest and the highest value of a label that a task may extend."""
    none = np.iinfo(np.int32).max
    lowest, highest = none, -none
    for y in range(min(levels.before[row] + 1, levels.num_levels)):
        if low[y] <= high[y]:
            lowest, highest = min(lowest, low[y]), max(highest, high[y])
    for at in range(network.straight_first[row], network.straight_first[row + 1]):
        i = network.straight_rows[at]
        for y in range(min(levels.before[row] + 1, levels.num_levels)):
            if own_low[i, y] <= own_high[i, y]:
                lowest = min(lowest, own_low[i, y])
                highest = max(highest, own_high[i, y])
    return lowest, highest


@inner
def _kept(kept: Labels, row: int, own: Reached) -> Labels:
    """Return the labels followed by those of one more task."""
    at = kept.first[row + 1]
    needed = at + own.energy.size
    if needed > len(kept.value):
        kept = _longer(kept, at, 2 * needed)
    for y in range(len(own.low)):
        for v in range(own.low[y], own.high[y] + 1):
            if own.energy[y, v - own.first] > -np.inf:
                kept.value[at], kept.level[at] = v, y
                kept.energy[at] = own.energy[y, v - own.first]
                at += 1
    kept.first[row + 1] = at
    return kept


@inner
def _longer(labels: Labels, count: int, capacity: int) -> Labels:
    """Return the first ``count`` labels in arrays with room for more."""
    value = np.empty(capacity, dtype=np.int32)
    level = np.empty(capacity, dtype=np.int32)
    energy = np.empty(capacity)
    for at in range(count):
        value[at], level[at] = labels.value[at], labels.level[at]
        energy[at] = labels.energy[at]
    return Labels(labels.first, value, level, energy)


@inner
def _forget(k: int, top: int, idle: Reached, own_low: Ints, own_high: Ints) -> None:
    """Drop all labels of paths that do not take row ``k``, which must be taken."""
    idle.energy[:] = -np.inf
    idle.low[:], idle.high[:] = top + 1, -1
    own_low[:k], own_high[:k] = top + 1, -1


@kernel
def path_of(
    network: Network,
    levels: DataLevels,
    weight: Ints,
    end_cost: Ints,
    labels: Labels,
    value: int,
) -> Ints:
    """Return the rows of a path that gains ``value``, in order, worked out backward.

    Any label that yields the next one to the last bit is as good as the one it was made from.
    """
    m = len(weight)
    rows = np.empty(m, dtype=np.int32)
    length = 0
    first_kept = 0
    while first_kept < m and not network.is_kept[first_kept]:
        first_kept += 1
    k, level, energy = m, levels.end, -np.inf
    while True:
        gained = 0 if k == m else weight[k]
        at_start = value + end_cost[levels.start] if k == m else value
        is_start = at_start == max(0, gained) and k <= first_kept
        if is_start and _leads_to(network, levels, k, 0.0, levels.start, network.energy_start,
                                  level, energy):  # fmt: skip
            break
        found = -1
        i = k - 1
        while i >= 0 and found < 0 and not (i + 1 < k and network.is_kept[i + 1]):
            if labels.first[i + 1] > labels.first[i] and may_be_next(network, i, k):
                give = give_between(network, i, k)
                for at in range(labels.first[i], labels.first[i + 1]):
                    ended = end_cost[labels.level[at]] if k == m else 0
                    if max(0, labels.value[at] + gained) == value + ended and _leads_to(
                        network, levels, k, give, labels.level[at], labels.energy[at],
                        level, energy,
                    ):  # fmt: skip
                        found = at
                        break
            i -= 1
        if found < 0:
            break
        k = i + 1
        rows[length] = k
        length += 1
        level, energy = labels.level[found], labels.energy[found]
        value = labels.value[found]
    return rows[:length][::-1].copy()


@inlined
def _leads_to(
    network: Network,
    levels: DataLevels,
    k: int,
    give: float,
    level: int,
    energy: float,
    level_after: int,
    energy_after: float,
) -> bool:
    """Return whether task ``k`` (or the end, at m) turns the earlier label into the later one."""
    if k == len(network.site):
        return level <= level_after
    if level > levels.before[k]:
        return False
    to = max(levels.floor[k], level + levels.gain[k], 0)
    return bool(
        to == level_after
        and min(energy + give, network.energy_cap[k]) - network.energy_cost[k] == energy_after
    )


@inner
def _take(
    network: Network,
    levels: DataLevels,
    row: int,
    gained: int,
    give: float,
    source: Reached,
    own: Reached,
) -> None:
    """Extend all labels of a source by one task; ``give`` is what the arc to it gives back."""
    cap, cost = network.energy_cap[row], network.energy_cost[row]
    floor = network.energy_floor[row]
    most = own.first + own.energy.shape[1] - 1
    for y in range(min(levels.before[row] + 1, levels.num_levels)):
        if source.low[y] > source.high[y]:
            continue
        to = max(levels.floor[row], y + levels.gain[row], 0)
        if to > levels.after[row] or to >= levels.num_levels:
            continue
        low, high = source.low[y], min(source.high[y], most - gained)
        # A path cannot pay more than it has gained: it is left with nothing.
        for v in range(low, min(high + 1, -gained)):
            left = min(source.energy[y, v - source.first] + give, cap) - cost
            if left >= floor:
                own.energy[to, 0] = max(own.energy[to, 0], left)
                own.low[to], own.high[to] = 0, max(own.high[to], 0)
        low = max(low, -gained)
        if low > high:
            continue
        before = source.energy[y, low - source.first : high - source.first + 1]
        after = own.energy[to, low + gained - own.first : high + gained - own.first + 1]
        for v in range(len(before)):
            left = min(before[v] + give, cap) - cost
            left = left if left >= floor else -np.inf
            after[v] = max(after[v], left)
        own.low[to] = min(own.low[to], low + gained)
        own.high[to] = max(own.high[to], high + gained)


@inner
def _merge(source: Reached, idle: Reached) -> None:
    """Merge the labels of a task into those that idle."""
    for y in range(len(idle.low)):
        low, high = source.low[y], source.high[y]
        if low > high:
            continue
        before = source.energy[y, low - source.first : high - source.first + 1]
        after = idle.energy[y, low : high + 1]
        for v in range(len(before)):
            after[v] = max(after[v], before[v])
        idle.low[y], idle.high[y] = min(idle.low[y], low), max(idle.high[y], high)


@inner
def _tidy(labels: Reached, need: Singles, goal: Goal, best_so_far: Floats) -> None:
    """Drop labels that cannot reach the goal, or have no more energy than one with less data."""
    low, high = labels.low, labels.high
    lowest, highest = len(best_so_far), -1
    for y in range(len(low)):
        if low[y] <= high[y]:
            lowest, highest = min(lowest, low[y]), max(highest, high[y])
    best_so_far[lowest : highest + 1] = -np.inf
    for y in range(len(low)):
        if low[y] > high[y]:
            continue
        values = labels.energy[y, low[y] - labels.first : high[y] - labels.first + 1]
        best = best_so_far[low[y] : high[y] + 1]
        # What the lowest value lacks to the goal; more than the table holds is out of reach.
        wanted = goal.units - goal.credit[y] - low[y]
        lost = min(len(values), max(0, wanted + 1 - len(need)))
        short = min(len(values), max(0, wanted))
        values[:lost] = -np.inf
        # needed[i] belongs to value low + short - 1 - i
        needed = need[max(0, wanted - short + 1) : max(0, wanted - lost + 1)]
        for i in range(short - lost):
            at = short - 1 - i
            values[at] = values[at] if values[at] >= needed[i] else -np.inf
        for i in range(len(values)):
            is_better = values[i] > best[i]
            values[i] = values[i] if is_better else -np.inf
            best[i] = max(best[i], values[i])
        start, end = low[y], high[y]
        while start <= end and values[start - low[y]] == -np.inf:
            start += 1
        while end >= start and values[end - low[y]] == -np.inf:
            end -= 1
        low[y], high[y] = start, end
        if start > end:
            low[y], high[y] = len(best_so_far), -1
