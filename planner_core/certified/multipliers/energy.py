"""Prices of targets where batteries are what limits a fleet, changed after each answer.

The scheme is that of ``multipliers.incremental``: satellites in turn answer the prices of the
moment, prices move after each answer, and their mean is put to all satellites now and then.
Recorders are left out, which makes an answer so quick that hundreds of rounds can be had. What the
mean proves with recorders is for ``resource_bound`` to say.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.certified.dp.energy_labels import EnergyLevels, energy_levels, most_by_energy
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.problem import (
    COLLECT,
    Bytes,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.worth import weights

_PER_COLLECT: Final = 24  # levels of energy
_FIRST_STEP: Final = 0.3  # of a reward, for all satellites together
_LAST_STEP: Final = 1e-3  # of the first
_NEWEST: Final = 0.15  # share of a round's prices in the mean
_ASKED_EVERY: Final = 5  # rounds
_NOTED_FROM: Final = 1 / 3  # of all rounds: from there on answers are near the best plans


class _Part(NamedTuple):
    """One satellite's programme; ``target`` is one too far for contacts."""

    rows: Ints
    network: Network
    levels: EnergyLevels
    target: Ints

    @classmethod
    def of(cls, problem: Problem, satellite: SatelliteProblem) -> _Part:
        network = network_of(problem, satellite)
        levels = energy_levels(network, _PER_COLLECT)
        num_targets = len(problem.target_ids)
        target = np.where(satellite.kind == COLLECT, satellite.place, num_targets)
        return cls(
            rows=satellite.rows, network=network, levels=levels, target=target.astype(np.int32)
        )


class EnergyPrices:
    """Prices that get better round by round; in each every satellite answers once.

    Parameters
    ----------
    prices
        To begin with. Shape ``(num_targets,)``.
    num_rounds
        After how many the steps shall be so short that more are of little use.

    Attributes
    ----------
    value, prices
        The least bound so far, recorders left out, and what proves it.
    usage
        How many of the latest answers took each opportunity. Shape ``(n,)``.
    """

    def __init__(self, problem: Problem, prices: Floats, num_rounds: int, seed: int) -> None:
        self._parts = [_Part.of(problem, s) for s in problem.satellites if len(s)]
        # Satellites answer one after another, in the same room.
        most_rows = max((len(part.target) for part in self._parts), default=0)
        widest = max((part.levels.width for part in self._parts), default=0)
        self._own = np.empty((most_rows, widest))
        self._num_own = np.zeros(most_rows, dtype=np.int64)
        self._worth = problem.worth
        self._top = np.append(problem.best_worth, 0.0)
        self._now = np.minimum(np.append(prices, 0.0), self._top)
        self._mean = self._now.copy()
        self._count = np.zeros((len(self._parts), len(self._top)))
        self._rng = np.random.default_rng(seed)
        self._round, self._num_rounds = 0, max(1, num_rounds)
        self.value, self.prices = float(self._top.sum()), self._top[:-1]
        self.usage = np.zeros(len(problem.opportunities))

    @property
    def is_settled(self) -> bool:
        """Whether more rounds are of little use."""
        return self._round >= self._num_rounds

    def improve(self, num_rounds: int, stop: Bytes) -> None:
        """Let all satellites answer so many times, and ask for the bound now and then."""
        shorter = _LAST_STEP ** (1.0 / self._num_rounds)
        for _ in range(num_rounds):
            step = _FIRST_STEP * shorter**self._round / len(self._parts)
            for index in self._rng.permutation(len(self._parts)):
                if stop[0]:
                    return
                part = self._parts[index]
                _, path = self._answer(part, self._now)
                self._count[index] = np.bincount(part.target[path], minlength=len(self._top))
                if self._round >= _NOTED_FROM * self._num_rounds:
                    self.usage[part.rows[path]] += 1.0
                if self._round == 0:
                    continue
                excess = self._count.sum(axis=0) - 1.0
                self._now = np.clip(self._now + step * self._top * excess, 0.0, self._top)
            self._round += 1
            self._mean += _NEWEST * (self._now - self._mean)
            if self._round % _ASKED_EVERY == 0:
                self.ask()

    def _answer(self, part: _Part, prices: Floats) -> tuple[float, Ints]:
        """Return the most that a satellite can gain, and the tasks of a path that does."""
        worth, price = self._worth[part.rows], prices[part.target]
        gain, path = most_by_energy(
            part.network, part.levels, weights(worth, price), self._own, self._num_own
        )
        # What is worth less than its price is only passed through.
        return gain, path[worth[path] >= price[path]]

    def ask(self) -> None:
        """Note what the mean of the multipliers proves."""
        gains = sum(self._answer(part, self._mean)[0] for part in self._parts)
        value = float(self._mean.sum() + gains)
        if value < self.value:
            self.value, self.prices = value, self._mean[:-1].copy()
