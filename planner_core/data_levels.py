"""The recorder in whole levels, rounded so that every plan that fits still fits."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.problem import Floats, Ints
from planner_core.resource_network import Network

_MAX_LEVELS: Final = 256
_ROUNDING: Final = 1e-6  # of a level: tasks of "the same" length differ by as much


class DataLevels(NamedTuple):
    """The data columns of a ``Network`` in levels from 0; shape ``(m,)``."""

    num_levels: int
    gain: Ints
    floor: Ints
    before: Ints
    after: Ints
    start: int
    end: int


def data_levels(network: Network, per_collect: int) -> DataLevels:
    """Return levels of which the smallest collect fills ``per_collect``, where that is not many.

    What a task adds is rounded down, and so is an empty recorder: levels are never above what
    a plan has on board, so that no plan is lost. (Each task may be off by a millionth of a
    level; limits leave room for that.)
    """
    m = len(network.place)
    is_filling = network.data_gain > 0.0
    lowest = min(0.0, float(network.data_floor.min(initial=0.0)))
    highest = max(
        float(network.data_before.max(initial=0.0)), float(network.data_after.max(initial=0.0))
    )
    unit = (highest - lowest) / (_MAX_LEVELS - 4)
    if is_filling.any():
        unit = max(unit, float(network.data_gain[is_filling].min()) / per_collect)
    room = (m + 1) * _ROUNDING
    base = int(np.floor(lowest / unit - room))

    def rounded_down(data: Floats | float) -> Ints:
        return np.floor(np.asarray(data) / unit + _ROUNDING).astype(np.int32)

    def limit(data: Floats | float) -> Ints:
        return np.floor(np.asarray(data) / unit + room).astype(np.int32) - base

    return DataLevels(
        num_levels=int(limit(highest)) + 1,
        gain=rounded_down(network.data_gain),
        floor=np.floor(network.data_floor / unit - room).astype(np.int32) - base,
        before=limit(network.data_before),
        after=limit(network.data_after),
        start=int(rounded_down(network.data_start)) - base,
        end=int(limit(network.data_end)),
    )


def without_data(network: Network) -> DataLevels:
    """Return a single level: the recorder is left out."""
    nothing = np.zeros(len(network.place), dtype=np.int32)
    return DataLevels(
        num_levels=1, gain=nothing, floor=nothing, before=nothing, after=nothing, start=0, end=0
    )
