"""Satellites limited by their batteries, as an oracle.

Recorders are left out, which makes answers so quick that there is time for hundreds of epochs. With
turns to the sun answers are estimates, not bounds. ``resource_bound`` evaluates what the
multipliers prove.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.energy_labels import EnergyLevels, levels_of_estimate, most_by_energy
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.multipliers.ascent import Ascent, BestPaths, Steps
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, Floats, Ints, Problem, SatelliteProblem
from planner_core.worth import weights


class _Part(NamedTuple):
    """One satellite's dynamic programme; ``target`` is ``num_targets`` for contacts."""

    rows: Ints
    network: Network
    levels: EnergyLevels
    target: Ints

    @classmethod
    def of(cls, problem: Problem, satellite: SatelliteProblem) -> _Part:
        network = network_of(problem, satellite)
        levels = levels_of_estimate(network, TUNING.levels_per_collect)
        num_targets = len(problem.target_ids)
        target = np.where(satellite.kind == COLLECT, satellite.site, num_targets)
        return cls(
            rows=satellite.rows, network=network, levels=levels, target=target.astype(np.int32)
        )


class EnergyPaths(BestPaths[_Part]):
    """Each satellite's best path that its battery allows, at given multipliers.

    Attributes
    ----------
    usage
        How many answers took each opportunity since this was last cleared. Shape ``(n,)``.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__([_Part.of(problem, s) for s in problem.satellites if len(s)])
        # Satellites answer one after another, and share these tables.
        most_rows = max((len(part.target) for part in self._satellites), default=0)
        widest = max((part.levels.width for part in self._satellites), default=0)
        self._own = np.empty((most_rows, widest))
        self._num_own = np.zeros(most_rows, dtype=np.int64)
        self._worth = problem.worth
        self.usage = np.zeros(len(problem.opportunities))

    def answer(self, part: int, multipliers: Floats, count: Ints) -> None:
        """Let a satellite answer anew, and update the counts."""
        satellite = self._satellites[part]
        _, path = self.best(satellite, multipliers)
        self._latest.replace(part, satellite.target[path], count)
        self.usage[satellite.rows[path]] += 1.0

    def best(self, part: _Part, multipliers: Floats) -> tuple[float, Ints]:
        """Return the most that a satellite can gain, and the tasks of a path that gains it."""
        worth, paid = self._worth[part.rows], multipliers[part.target]
        gain, path = most_by_energy(
            part.network, part.levels, weights(worth, paid), self._own, self._num_own
        )
        # A path only passes through tasks that are worth less than their multipliers.
        return gain, path[worth[path] >= paid[path]]


def ascent_on_energy(
    problem: Problem, oracle: EnergyPaths, begin: Floats, num_epochs: int, seed: int
) -> Ascent:
    """Return the ascent on the bound that batteries prove."""
    steps = Steps(first=TUNING.first_step, last=TUNING.last_step, num_epochs=max(1, num_epochs))
    return Ascent(oracle, problem.best_worth, begin, steps, seed)
