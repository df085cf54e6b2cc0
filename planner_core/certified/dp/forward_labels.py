"""The most that one satellite can gain under battery and recorder: forward, exact in energy.

At-most-once rows are left out: a target's worth is what its price leaves, and may be gained
again and again. For each whole value and data level only the most energy matters.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.resource_network import Network, give_between, may_be_next
from planner_core.certified.signs import STOPPED, UNREACHED
from planner_core.certified.tuning import TUNING
from planner_core.jit import inlined, kernel
from planner_core.problem import (
    Bytes,
    Floats,
    Ints,
    Longs,
    Singles,
)

_TIDY_EVERY: Final = TUNING.patience


class Labels(NamedTuple):
    """What was reached right after each task ``i``: entries ``first[i]`` up to ``first[i + 1]``.

    Whole value, data level and energy of each entry; shape ``(num_labels,)``.
    """

    first: Longs
    value: Ints
    level: Ints
    energy: Floats


@kernel
def most_value(
    network: Network,
    levels: DataLevels,
    weight: Ints,
    idle_need: Singles,
    after_need: Singles,
    credit: Ints,
    end_cost: Ints,
    top: int,
    goal: int,
    keeps_labels: bool,
    stop: Bytes,
) -> tuple[int, Labels]:
    """Return the most value of any path, ``UNREACHED`` if that is below ``goal``, or ``STOPPED``.

    Parameters
    ----------
    weight
        Whole worth of each task, not negative. Shape ``(m,)``.
    idle_need, after_need
        What ``least_energy`` answered for at least ``goal``: labels that cannot reach the goal
        are dropped.
    credit
        How much less than these weights count there can be left to gain from each data level,
        where data is priced there. Shape ``(num_levels,)``.
    end_cost
        What a path that ends at each data level gains less, not falling. Shape ``(num_levels,)``.
    top
        No path gains more.
    keeps_labels
        Whether to answer the labels as well, for ``path_of``; none otherwise.
    """
    m = len(weight)
    none = -np.inf
    num_levels = levels.num_levels
    idle = np.full((num_levels, top + 1), none)
    low = np.full(num_levels, top + 1, dtype=np.int32)
    high = np.full(num_levels, -1, dtype=np.int32)
    if levels.start < num_levels:
        idle[levels.start, 0] = network.energy_start
        low[levels.start], high[levels.start] = 0, 0
    labels = [np.empty((0, 0)) for _ in range(m)]
    first_value = np.zeros(m, dtype=np.int64)
    own_low = np.full((m, num_levels), top + 1, dtype=np.int32)
    own_high = np.full((m, num_levels), -1, dtype=np.int32)
    best_so_far = np.empty(top + 1)
    kept_first = np.zeros(m + 1, dtype=np.int64)
    capacity = 1024 if keeps_labels else 0
    kept_value = np.empty(capacity, dtype=np.int32)
    kept_level = np.empty(capacity, dtype=np.int32)
    kept_energy = np.empty(capacity)
    num_kept = 0
    merged = 0
    for k in range(m):
        if stop[0]:
            return STOPPED, Labels(kept_first, kept_value, kept_level, kept_energy)
        while merged < m and network.idle_from[network.by_idle[merged]] <= k:
            i = network.by_idle[merged]
            _merge(labels[i], first_value[i], own_low[i], own_high[i], idle, low, high)
            labels[i] = np.empty((0, 0))
            merged += 1
        if k % _TIDY_EVERY == 0:
            _tidy(idle, 0, low, high, idle_need[k], credit, goal, best_so_far)
        kept_first[k + 1] = num_kept
        # The values that any label of this task can have.
        before, gained = levels.before[k], weight[k]
        lowest, highest = top + 1, -1
        for y in range(min(before + 1, num_levels)):
            if low[y] <= high[y]:
                lowest, highest = min(lowest, low[y]), max(highest, high[y])
        for at in range(network.straight_first[k], network.straight_first[k + 1]):
            i = network.straight_rows[at]
            for y in range(min(before + 1, num_levels)):
                if own_low[i, y] <= own_high[i, y]:
                    lowest = min(lowest, own_low[i, y])
                    highest = max(highest, own_high[i, y])
        if lowest > highest or lowest + gained > top:
            if network.is_kept[k]:
                _forget(k, top, idle, low, high, own_low, own_high)
            continue
        lowest, highest = lowest + gained, min(top, highest + gained)
        own = np.full((num_levels, highest - lowest + 1), none)
        labels[k], first_value[k] = own, lowest
        _take(
            network, levels, k, gained, 0.0, idle, 0, low, high,
            own, lowest, own_low[k], own_high[k],
        )  # fmt: skip
        for at in range(network.straight_first[k], network.straight_first[k + 1]):
            i = network.straight_rows[at]
            _take(
                network, levels, k, gained, network.straight_give[at],
                labels[i], first_value[i], own_low[i], own_high[i],
                own, lowest, own_low[k], own_high[k],
            )  # fmt: skip
        _tidy(own, lowest, own_low[k], own_high[k], after_need[k], credit, goal, best_so_far)
        if network.is_kept[k]:
            _forget(k, top, idle, low, high, own_low, own_high)
        if not keeps_labels:
            continue
        for y in range(num_levels):
            if num_kept + top + 1 > capacity:
                capacity = 2 * capacity + top + 1
                kept_value = _longer(kept_value, capacity)
                kept_level = _longer(kept_level, capacity)
                kept_energy = _longer(kept_energy, capacity)
            for v in range(own_low[k, y], own_high[k, y] + 1):
                if own[y, v - lowest] > none:
                    kept_value[num_kept], kept_level[num_kept] = v, y
                    kept_energy[num_kept] = own[y, v - lowest]
                    num_kept += 1
        kept_first[k + 1] = num_kept
    while merged < m:
        i = network.by_idle[merged]
        _merge(labels[i], first_value[i], own_low[i], own_high[i], idle, low, high)
        merged += 1
    best = UNREACHED
    for y in range(min(levels.end + 1, num_levels)):
        for v in range(max(goal + end_cost[y], low[y]), high[y] + 1):
            if idle[y, v] > none:
                best = max(best, v - end_cost[y])
    return best, Labels(kept_first, kept_value, kept_level, kept_energy)


@kernel
def _forget(
    k: int, top: int, idle: Floats, low: Ints, high: Ints, own_low: Ints, own_high: Ints
) -> None:
    """Drop all labels of paths that do not take row ``k``, where that one must be taken."""
    idle[:] = -np.inf
    low[:], high[:] = top + 1, -1
    own_low[:k], own_high[:k] = top + 1, -1


@inlined  # of integers and of floats
def _longer(values: np.ndarray, length: int) -> np.ndarray:
    longer = np.empty(length, dtype=values.dtype)
    longer[: len(values)] = values
    return longer


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

    Any label from which the next one follows to the last bit is as good as the one it was
    made from.
    """
    m = len(weight)
    rows = np.empty(m, dtype=np.int32)
    length = 0
    first_kept = 0
    while first_kept < m and not network.is_kept[first_kept]:
        first_kept += 1
    k, level, energy = m, levels.end, -np.inf
    while True:
        at_start = value + end_cost[levels.start] if k == m else value
        is_start = at_start == 0 and k <= first_kept
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
                    if labels.value[at] == value + ended and _leads_to(
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
        value = labels.value[found] - weight[k]
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
    """Return whether task ``k`` (or the end, at m) makes the later label of the earlier one."""
    if k == len(network.place):
        return level <= level_after
    if level > levels.before[k]:
        return False
    to = max(levels.floor[k], level + levels.gain[k], 0)
    return bool(
        to == level_after
        and min(energy + give, network.energy_cap[k]) - network.energy_cost[k] == energy_after
    )


@inlined
def _take(
    network: Network,
    levels: DataLevels,
    row: int,
    gained: int,
    give: float,
    source: Floats,
    source_first: int,
    source_low: Ints,
    source_high: Ints,
    own: Floats,
    own_first: int,
    own_low: Ints,
    own_high: Ints,
) -> None:
    """Extend all labels of a source by one task; ``give`` is what the way to it gives back."""
    cap, cost = network.energy_cap[row], network.energy_cost[row]
    floor = network.energy_floor[row]
    most = own_first + own.shape[1] - 1
    for y in range(min(levels.before[row] + 1, levels.num_levels)):
        if source_low[y] > source_high[y]:
            continue
        to = max(levels.floor[row], y + levels.gain[row], 0)
        if to > levels.after[row] or to >= levels.num_levels:
            continue
        low, high = source_low[y], min(source_high[y], most - gained)
        if low > high:
            continue
        before = source[y, low - source_first : high - source_first + 1]
        after = own[to, low + gained - own_first : high + gained - own_first + 1]
        for v in range(len(before)):
            left = min(before[v] + give, cap) - cost
            left = left if left >= floor else -np.inf
            after[v] = max(after[v], left)
        own_low[to] = min(own_low[to], low + gained)
        own_high[to] = max(own_high[to], high + gained)


@inlined
def _merge(
    source: Floats,
    source_first: int,
    source_low: Ints,
    source_high: Ints,
    idle: Floats,
    low: Ints,
    high: Ints,
) -> None:
    """Let the labels of a task idle."""
    for y in range(len(low)):
        if source_low[y] > source_high[y]:
            continue
        before = source[y, source_low[y] - source_first : source_high[y] - source_first + 1]
        after = idle[y, source_low[y] : source_high[y] + 1]
        for v in range(len(before)):
            after[v] = max(after[v], before[v])
        low[y], high[y] = min(low[y], source_low[y]), max(high[y], source_high[y])


@inlined
def _tidy(
    labels: Floats,
    first: int,
    low: Ints,
    high: Ints,
    need: Singles,
    credit: Ints,
    goal: int,
    best_so_far: Floats,
) -> None:
    """Drop what cannot reach the goal, and what has less energy than a label with less data."""
    lowest, highest = len(best_so_far), -1
    for y in range(len(low)):
        if low[y] <= high[y]:
            lowest, highest = min(lowest, low[y]), max(highest, high[y])
    best_so_far[lowest : highest + 1] = -np.inf
    for y in range(len(low)):
        if low[y] > high[y]:
            continue
        values = labels[y, low[y] - first : high[y] - first + 1]
        best = best_so_far[low[y] : high[y] + 1]
        # What the first value still wants; more than the table holds is out of reach.
        wanted = goal - credit[y] - low[y]
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
