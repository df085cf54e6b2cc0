r"""A bound on plans with continuous starts.

Weak duality as in ``planner_core.bounds.lagrangian``: prices of targets, and for each satellite
the heaviest chain of its tasks, here with starts anywhere in the accesses and no access twice.
``planner_core.bounds.labels`` says why its labels never fall below the heaviest chain. It needs
satellites that turn faster than lines of sight do: then the earliest start is the best one,
and chains are sequences of accesses.

Battery, recorder, stations and antennas are left out, which can only raise the bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from planner_core.bounds.bound import Bound, rounded_bound
from planner_core.bounds.labels import Cells, Labels, cells_of, heaviest, labels_of
from planner_core.bounds.totals import totals_bound
from planner_core.problem import COLLECT, Floats, Ints, Problem
from planner_core.spans import spans_of, view_of

CELL_S: Final = 10.0
LABELS: Final = 4
_DEFLECTION: Final = 0.7
_SHORTER: Final = 0.7
_PATIENCE: Final = 6
_SHORTEST: Final = 0.02
_GAIN: Final = 1e-4


def accessible(problem: Problem) -> Bound:
    """Return the bound that every accessible target is imaged: prices of the whole reward."""
    table = problem.opportunities
    targets = np.unique(table.place[table.kind == COLLECT])
    value = float(problem.target_reward[targets].sum())
    prices = problem.target_reward.astype(np.float64)
    return Bound(value=rounded_bound(problem, value, 0.0), proof="lagrangian", prices=prices)


def quick_bound(problem: Problem) -> Bound:
    """Return the better of the bounds that take no time."""
    totals, every = totals_bound(problem), accessible(problem)
    return every if totals is None or every.value <= totals.value else totals


def continuous_value(problem: Problem, prices: Floats) -> float:
    """Return the bound that ``prices`` prove. This is the whole proof: it needs no search."""
    dual = ContinuousDual.of(problem, CELL_S, LABELS)
    if dual is None:
        # Prices of the whole reward leave nothing to earn on any chain.
        table = problem.opportunities
        prices = np.maximum(prices, problem.target_reward)
        return float(prices[np.unique(table.place[table.kind == COLLECT])].sum())
    value, _ = dual.at(prices)
    return value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContinuousDual:
    """The function of prices whose every value is a bound."""

    problem: Problem
    satellites: tuple[tuple[Cells, Labels], ...]
    most: int
    is_offered: np.ndarray

    @classmethod
    def of(cls, problem: Problem, width_s: float, most: int) -> ContinuousDual | None:
        """Return it; None where a satellite turns more slowly than its lines of sight."""
        satellites = []
        is_offered = np.zeros(len(problem.target_ids), dtype=np.bool_)
        for index in range(len(problem.satellites)):
            spans = spans_of(problem, index)
            is_offered[spans.place] = True
            if len(spans.row) == 0:
                continue
            cells = cells_of(spans, view_of(problem, index), width_s)
            if cells is None:
                return None
            satellites.append((cells, labels_of(cells, most)))
        return cls(problem=problem, satellites=tuple(satellites), most=most, is_offered=is_offered)

    def at(self, prices: Floats, *, is_exact: bool = True) -> tuple[float, Ints]:
        """Return the value at prices, and how often the chains there take each target.

        Only the exact value is a bound.
        """
        reward = self.problem.target_reward
        price = np.where(self.is_offered, np.clip(prices, 0.0, reward), 0.0)
        total = float(price.sum())
        counts = np.zeros(len(reward), dtype=np.int32)
        for cells, labels in self.satellites:
            weight = (reward - price)[cells.spans.place]
            value, slot = heaviest(cells, weight, labels, self.most, is_exact)
            total += value
            while slot >= 0:
                if labels.is_paid[slot]:
                    counts[cells.spans.place[cells.task[slot // self.most]]] += 1
                slot = int(labels.parent[slot])
        return total, counts


@dataclass(kw_only=True, eq=False)
class ContinuousPrices:
    """A search for good prices: deflected subgradient steps towards what some plan earns."""

    dual: ContinuousDual
    prices: Floats
    value: float = np.inf
    theta: float = 1.0
    _stalled: int = 0

    def __post_init__(self) -> None:
        self._now = self.prices.copy()
        self._direction = np.zeros_like(self.prices)

    @property
    def is_done(self) -> bool:
        """Whether steps have become too short to lead anywhere."""
        return self.theta < _SHORTEST

    def step(self, level: float) -> None:
        """Make a step."""
        reward = self.dual.problem.target_reward
        total, counts = self.dual.at(self._now)
        self._stalled += 1
        if total < self.value:
            if total < self.value * (1.0 - _GAIN):
                self._stalled = 0
            self.value, self.prices = total, self._now.copy()
        if self._stalled > _PATIENCE:
            self.theta, self._stalled = self.theta * _SHORTER, 0
            self._now = self.prices.copy()
            self._direction[:] = 0.0
            total, counts = self.dual.at(self._now)
        excess = np.where(self.dual.is_offered, counts - 1.0, 0.0)
        can_fall, can_rise = self._now > 0.0, self._now < reward
        excess[(excess < 0.0) & ~can_fall | (excess > 0.0) & ~can_rise] = 0.0
        direction = excess + _DEFLECTION * self._direction
        direction[(direction < 0.0) & ~can_fall | (direction > 0.0) & ~can_rise] = 0.0
        norm = float(direction @ direction)
        if norm == 0.0:
            self.theta = 0.0
            return
        self._direction = direction
        length = self.theta * (total - level) / norm
        self._now = np.clip(self._now + length * direction, 0.0, reward)
