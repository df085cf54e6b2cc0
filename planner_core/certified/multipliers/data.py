"""Satellites limited by their recorders, as an oracle, if images on board earn a share.

Batteries are left out, which makes answers so quick that there is time for hundreds of epochs. With
batteries as well, ``resource_bound`` evaluates what the multipliers prove.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.data_labels import most_by_data
from planner_core.certified.dp.data_levels import DataLevels, data_levels
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.multipliers.ascent import BestPaths
from planner_core.certified.proofs.shares import Shares
from planner_core.certified.signs import FROM_START
from planner_core.certified.sizes import MAX_DATA_CELLS
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, Floats, Ints, Problem, SatelliteProblem


class _Part(NamedTuple):
    """One satellite's dynamic programme; ``target`` is ``num_targets`` for contacts."""

    rows: Ints
    network: Network
    levels: DataLevels
    shares: Shares | None
    end_cost: Floats
    target: Ints

    @classmethod
    def of(cls, problem: Problem, satellite: SatelliteProblem) -> _Part:
        network = network_of(problem, satellite)
        levels = data_levels(network, TUNING.coarse, is_optimistic=True)
        shares = Shares.of(problem, satellite, network)
        end_cost = np.zeros(levels.num_levels)
        if shares is not None:
            end_cost = shares.cost_at_end(levels, FROM_START)
        target = np.where(satellite.kind == COLLECT, satellite.site, len(problem.target_ids))
        return cls(
            rows=satellite.rows, network=network, levels=levels, shares=shares, end_cost=end_cost,
            target=target.astype(np.int32),
        )  # fmt: skip


class DataPaths(BestPaths[_Part]):
    """Each satellite's best path that its recorder allows, at given multipliers."""

    def __init__(self, worth: Floats, satellites: list[_Part]) -> None:
        super().__init__(satellites)
        self._worth = worth
        # Satellites answer one after another, and share these tables.
        shape = (
            max((len(part.rows) for part in satellites), default=0),
            max((part.levels.num_levels for part in satellites), default=0),
        )
        self._own, self._source = np.empty(shape), np.empty(shape, dtype=np.int32)

    @classmethod
    def of(cls, problem: Problem) -> DataPaths | None:
        """Return the oracle; None if no image on board earns a share or tables are too large."""
        satellites = [_Part.of(problem, s) for s in problem.satellites if len(s)]
        num_cells = sum(len(part.rows) * part.levels.num_levels for part in satellites)
        if num_cells > MAX_DATA_CELLS or all(part.shares is None for part in satellites):
            return None
        return cls(problem.worth, satellites)

    def best(self, part: _Part, multipliers: Floats) -> tuple[float, Ints]:
        """Return the most that a satellite can gain, and the tasks of a path that gains it."""
        worth = self._worth[part.rows] - multipliers[part.target]
        weight = np.maximum(worth, 0.0)
        if part.shares is not None:
            weight = part.shares.worth_at_most(worth, FROM_START)
        return most_by_data(
            part.network, part.levels, weight, part.end_cost, self._own, self._source
        )
