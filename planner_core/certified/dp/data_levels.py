"""The recorder in whole levels, rounded so that no plan is lost, or so that every path fits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.sizes import MAX_DATA_LEVELS
from planner_core.certified.tolerances import LEVEL
from planner_core.jit import kernel
from planner_core.problem import Floats, Ints


@bundle
class DataLevels(NamedTuple):
    """The data columns of a ``Network`` in levels from 0; shape ``(m,)``.

    ``end`` is the highest level at the end, whatever the last image is; ``delivered`` is the
    highest if that image must be down. ``least`` is the least data that a plan may hold at each
    optimistic level (shape ``(num_levels,)``, in recorder capacities).
    """

    num_levels: int
    gain: Ints
    floor: Ints
    before: Ints
    after: Ints
    delivered: Ints
    least: Floats
    start: int
    end: int


def data_levels(network: Network, per_collect: int, *, is_optimistic: bool) -> DataLevels:
    """Return levels of which the smallest collect fills ``per_collect``; coarser ones if too many.

    Optimistic levels are never above what a plan has on board, so that no plan is lost: what
    tasks add is rounded down, and so is an empty recorder. Others are never below it. (A task
    may be off by a millionth of a level; limits leave room for that.)
    """
    m = len(network.site)
    is_filling = network.data_gain > 0.0
    lowest = min(0.0, float(network.data_floor.min(initial=0.0)))
    highest = max(
        float(network.data_before.max(initial=0.0)), float(network.data_after.max(initial=0.0))
    )
    unit = (highest - lowest) / (MAX_DATA_LEVELS - 4) or 1.0
    if is_filling.any():
        # By powers of two, so that finer levels prove whatever coarser ones prove.
        finest = float(network.data_gain[is_filling].min()) / per_collect
        unit = finest * 2.0 ** np.ceil(np.log2(max(1.0, unit / finest)))
    sign = 1.0 if is_optimistic else -1.0
    room = sign * (m + 1) * LEVEL
    base = int(np.floor(lowest / unit - abs(room)))

    def rounded(data: Floats | float, allowance: float) -> Ints:
        return (sign * np.floor(sign * np.asarray(data) / unit + allowance)).astype(np.int32)

    def limit(data: Floats | float) -> Ints:
        return np.floor(np.asarray(data) / unit + room).astype(np.int32) - base

    start = int(rounded(network.data_start, LEVEL)) - base
    # A full recorder may be rounded up beyond the limit of every task.
    num_levels = max(int(limit(highest)), start) + 1
    floor = rounded(network.data_floor, -abs(room)) - base
    delivered = limit(network.delivered)
    if not is_optimistic:
        # A contact that empties the recorder must suffice, although its level is rounded up.
        emptied = np.where(network.is_contact == 1, floor, 0)
        delivered = np.maximum(delivered, np.maximum.accumulate(emptied[::-1])[::-1])
    return DataLevels(
        num_levels=num_levels,
        gain=rounded(network.data_gain, LEVEL),
        floor=floor,
        before=limit(network.data_before),
        after=limit(network.data_after),
        delivered=delivered.astype(np.int32),
        least=np.asarray(unit * (np.arange(num_levels) + base - abs(room)), np.float64),
        start=start,
        end=int(limit(network.data_end)),
    )


@kernel
def levels_of_part(levels: DataLevels, rows: Ints) -> DataLevels:
    """Return the levels of some rows only."""
    return DataLevels(
        levels.num_levels,
        levels.gain[rows],
        levels.floor[rows],
        levels.before[rows],
        levels.after[rows],
        levels.delivered[rows],
        levels.least,
        levels.start,
        levels.end,
    )
