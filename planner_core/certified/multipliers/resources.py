"""Prices for the bound by dynamic programmes, from subgradient steps over the exact programme."""

from __future__ import annotations

from collections import Counter

import numpy as np
import numpy.typing as npt

from planner_core.certified.proofs.resource_bound import (
    leaving_whole_units,
    relaxations,
    whole_worth,
)
from planner_core.certified.sizes import MAX_CELLS
from planner_core.certified.tolerances import NOTHING
from planner_core.certified.tuning import TUNING
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bytes,
    Floats,
    Ints,
    Problem,
)
from planner_core.problem.plan import Plan


class PriceSearch:
    """Prices that bring the bound down, and what the relaxed plans on the way looked like.

    Attributes
    ----------
    satellites
        The programme of each satellite that has anything to do.
    value, prices, unit
        The best bound and what proves it.
    usage
        How many relaxed plans took each opportunity. Shape ``(n,)``.
    contact_sets
        How often each set of contacts was best.
    theta
        Length of the steps; they get shorter as they stop helping.
    """

    def __init__(self, problem: Problem, value: float, prices: Floats, stop: Bytes) -> None:
        self._problem, self._stop = problem, stop
        self._is_reachable = np.diff(problem.target_opportunities[1]) > 0
        self._typical = problem.typical_worth
        # By target: what the image earns that plans take of it, as far as they are known.
        self._worth_taken = problem.best_worth.copy()
        coarse = relaxations(problem, TUNING.coarse)
        num_images = int(value / self._typical / len(coarse))
        self.satellites = tuple(s.with_data_price(num_images) for s in coarse)
        self._now = np.where(self._is_reachable, prices, 0.0)
        self._direction = np.zeros(len(prices))
        # Rows of relaxed plans of each satellite: at any prices the best is no worse than they.
        self._paths: list[list[Ints]] = [[] for _ in self.satellites]
        self._stalled = 0
        self.unit = self._unit(value)
        self.value, self.prices = np.inf, self._now
        self.usage = np.zeros(len(problem.opportunities))
        self.contact_sets: Counter[tuple[int, ...]] = Counter()
        self.theta = 1.0

    def _unit(self, value: float) -> float:
        largest = max(len(s.satellite) for s in self.satellites)
        unit = 2.0 ** np.floor(np.log2(self._typical)) / TUNING.units_per_reward
        while value / len(self.satellites) / unit > MAX_CELLS / largest:
            unit *= 2.0
        return float(unit)

    def step(self, level: float) -> bool:
        """Evaluate the current prices and step on; return False once the work must stop.

        Parameters
        ----------
        level
            Where the best prices are expected.
        """
        most = self._problem.best_worth
        prices = self._whole(self._now, self.unit)
        outcome = self._evaluate(prices)
        if outcome is None:
            return False
        value, counts = outcome
        self._stalled += 1
        if value < self.value - 1e-9:
            self.value, self.prices, self._stalled = value, prices, 0
        if self._stalled >= TUNING.patience:
            self.theta, self._stalled = self.theta * TUNING.shorter, 0
            self._now, self._direction = self.prices, np.zeros_like(self._direction)
            return True
        gradient = np.where(self._is_reachable, counts - 1.0, 0.0)
        gradient[(self._now <= 0.0) & (gradient < 0.0)] = 0.0
        gradient[(self._now >= most) & (gradient > 0.0)] = 0.0
        # A step moves prices in proportion to what the targets are worth.
        scale = np.where(most > 0.0, most, 1.0)
        self._direction = (1.0 - TUNING.deflection) * gradient + TUNING.deflection * self._direction
        norm = float(self._direction @ (scale * self._direction))
        if norm <= NOTHING * float(scale.max()):
            return False
        length = self.theta * (value - max(level, (1.0 - TUNING.little) * self.value)) / norm
        self._now = np.clip(self._now + length * scale * self._direction, 0.0, most)
        return True

    def learn(self, plan: Plan) -> None:
        """Note a plan that is known."""
        taken = np.zeros(len(self._problem.opportunities), dtype=np.bool_)
        taken[[action.opportunity for action in plan.actions]] = True
        for relaxation, paths in zip(self.satellites, self._paths, strict=True):
            paths.append(np.flatnonzero(taken[relaxation.satellite.rows]).astype(np.int32))
        self._note_images(np.flatnonzero(taken))

    def restart(self, prices: Floats) -> None:
        """Go on from other prices, in shorter steps."""
        self._now = np.where(self._is_reachable, prices, 0.0)
        self._direction = np.zeros_like(self._now)
        self.value, self.prices = np.inf, self._now
        self.theta, self._stalled = 1.0, 0

    def _whole(self, prices: Floats, unit: float) -> Floats:
        """Return prices at which the images that plans take are worth whole units."""
        whole = leaving_whole_units(self._problem, prices, unit, self._worth_taken)
        whole[~self._is_reachable] = 0.0
        return whole

    def _note_images(self, rows: npt.NDArray[np.integer]) -> None:
        """Note what the images among these opportunities earn, as what plans take."""
        images = rows[self._problem.opportunities.kind[rows] == COLLECT]
        self._worth_taken[self._problem.opportunities.place[images]] = self._problem.worth[images]

    def _known(self, i: int, worth: Ints) -> int | None:
        """Return what a satellite gains on one of the paths that are known, if there are any."""
        weight = worth[self.satellites[i].satellite.rows]
        return max((int(weight[path].sum()) for path in self._paths[i]), default=None)

    def _total(self, prices: Floats, units: int, unit: float) -> float:
        rounded_away = 1e-9 * len(self._problem.opportunities) * unit
        return float(prices.sum()) + units * unit + rounded_away

    def _evaluate(self, prices: Floats) -> tuple[float, Floats] | None:
        """Return the bound of these prices and how often its paths take each target."""
        problem = self._problem
        worth = whole_worth(problem, prices, self.unit)
        counts = np.zeros(len(prices))
        contacts: list[int] = []
        units = 0
        for i, relaxation in enumerate(self.satellites):
            near = self._known(i, worth)
            if near is None:
                near, _ = relaxation.most(worth, self.unit, 0, self._stop)
            most, path = relaxation.most(
                worth, self.unit, 0, self._stop, near=near, keeps_path=True
            )
            if path is None:
                return None
            units += most
            self._paths[i].append(path)
            rows = relaxation.satellite.rows[path]
            self.usage[rows] += 1.0
            images = rows[problem.opportunities.kind[rows] == COLLECT]
            target = problem.opportunities.place[images]
            np.add.at(counts, target[problem.worth[images] >= prices[target]], 1.0)
            self._note_images(rows)
            contacts += [int(r) for r in rows[problem.opportunities.kind[rows] == CONTACT]]
        self.contact_sets[tuple(sorted(contacts))] += 1
        return self._total(prices, units, self.unit), counts
