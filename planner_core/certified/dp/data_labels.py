"""The most that one satellite can gain under its recorder alone: worth exact, data in levels.

``most_value`` models the battery as well, and counts worth in whole units. Without a battery each
level needs only one number, so that hundreds of multipliers can be tried.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import AT_START
from planner_core.jit import inner, kernel
from planner_core.problem import Floats, Ints


@kernel
def most_by_data(
    network: Network,
    levels: DataLevels,
    weight: Floats,
    end_cost: Floats,
    own: Floats,
    source: Ints,
) -> tuple[float, Ints]:
    """Return the most that a path gains, and the rows of such a path.

    Parameters
    ----------
    weight
        Worth of each task; images that are worth nothing are not taken. Shape ``(m,)``.
    end_cost
        What a path pays if it ends at each level. Shape ``(num_levels,)``.
    own, source
        Workspace, each of shape ``(m, num_levels)`` at least. Filled with the most gained by a
        path that ends with each row at each level, and with the entry that it comes from.
    """
    m, width = len(weight), levels.num_levels
    idle = np.full(width, -np.inf)
    # The last row of the best idle path at each level.
    last = np.full(width, AT_START, dtype=np.int32)
    if levels.start < width:
        idle[levels.start] = 0.0
    merged = 0
    for k in range(m):
        while merged < m and network.idle_from[network.by_idle[merged]] <= k:
            i = network.by_idle[merged]
            for y in range(width):
                if own[i, y] > idle[y]:
                    idle[y], last[y] = own[i, y], i
            merged += 1
        own[k, :width] = -np.inf
        if weight[k] <= 0.0 and not network.is_contact[k]:
            continue
        _extend(levels, k, weight[k], idle, last, own, source)
        for at in range(network.straight_first[k], network.straight_first[k + 1]):
            i = network.straight_rows[at]
            last_one = np.full(width, i, dtype=np.int32)
            _extend(levels, k, weight[k], own[i], last_one, own, source)
    best, row, level = -np.inf, AT_START, levels.start
    if levels.start < width:
        best = -end_cost[levels.start]
    for k in range(m):
        for y in range(min(levels.end + 1, width)):
            if own[k, y] - end_cost[y] > best:
                best, row, level = own[k, y] - end_cost[y], k, y
    return best, _path_to(row, level, source)


@inner
def _extend(
    levels: DataLevels, k: int, weight: float, before: Floats, last: Ints, own: Floats, source: Ints
) -> None:
    """Extend by row ``k`` the best path ``before`` at each level, which ends with row ``last``."""
    width = source.shape[1]
    for y in range(min(levels.before[k] + 1, levels.num_levels)):
        to = max(levels.floor[k], y + levels.gain[k], 0)
        if to > levels.after[k] or to >= levels.num_levels:
            continue
        if before[y] + weight > own[k, to]:
            own[k, to] = before[y] + weight
            source[k, to] = AT_START if last[y] == AT_START else last[y] * width + y


@inner
def _path_to(row: int, level: int, source: Ints) -> Ints:
    """Return the rows of the path to an entry, in order."""
    rows = np.empty(len(source), dtype=np.int32)
    length = 0
    while row != AT_START:
        rows[length] = row
        length += 1
        entry = source[row, level]
        row = AT_START if entry == AT_START else entry // source.shape[1]
        level = entry % source.shape[1]
    return rows[:length][::-1].copy()
