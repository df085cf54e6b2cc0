"""Multipliers for the bound by exact dynamic programmes: a subgradient ascent on it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import numpy.typing as npt

from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.resource_bound import leaving_whole_units, whole_worth
from planner_core.certified.proofs.satellite_relaxation import SatelliteRelaxation, relaxations
from planner_core.certified.sizes import MAX_CELLS
from planner_core.certified.tolerances import NOTHING
from planner_core.certified.tuning import TUNING
from planner_core.precedence.antennas import antenna_groups, paid_for_antennas
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
)
from planner_core.problem.plan import Plan


class ResourceAscent:
    """Multipliers that bring the bound down, and statistics of the relaxed plans on the way.

    Attributes
    ----------
    satellites
        The programme of each satellite that has opportunities.
    value, multipliers, antenna_multipliers, unit
        The best bound and what proves it.
    usage
        How many relaxed plans took each opportunity. Shape ``(n,)``.
    contact_sets
        How many relaxed plans took exactly each set of contacts.
    theta
        Factor of the step length; it falls when steps no longer help.
    wants_antennas
        Whether a relaxed plan has taken more contacts at a time than a station can serve.
    """

    def __init__(self, problem: Problem, value: float, multipliers: Floats, stop: Bytes) -> None:
        self._problem, self._stop = problem, stop
        self._typical = problem.typical_worth
        # By target: what the image of it earns that a known or relaxed plan last took.
        self._worth_taken = problem.best_worth.copy()
        self._num_satellites = sum(len(satellite) > 0 for satellite in problem.satellites)
        self._num_images = int(value / self._typical / self._num_satellites)
        # Two levels to an image cost a bound an image if all must come down: 281 and 283 instead
        # of 280 and 282 (delivered-paper-500). With rewards of 1 to 10, 1,000 targets, more levels
        # slow the search: 1.4 and 1.3 % after 20 CPU seconds, with two 1.1 and 0.5. A fleet uses
        # more only at the end (``count_finely``), because of the memory that they take.
        is_alone = self._num_satellites == 1
        comes_down = is_alone and problem.counts_delivery
        self.satellites = self._relaxations(TUNING.several if comes_down else TUNING.coarse)
        # Vectors have an entry for each target, then one for each group of contacts.
        self._groups = antenna_groups(problem)
        num_groups = len(self._groups)
        self._is_reachable = np.diff(problem.target_opportunities[1]) > 0
        self._is_moved = np.append(self._is_reachable, np.zeros(num_groups, dtype=np.bool_))
        # No contact brings down more than all targets are worth: a higher multiplier adds nothing.
        all_worth = float(problem.best_worth.sum())
        self._most = np.append(problem.best_worth, np.full(num_groups, all_worth))
        own_scale = np.where(problem.best_worth > 0.0, problem.best_worth, 1.0)
        self._scale = np.append(own_scale, self._scale_of_antennas())
        self.antenna_multipliers = np.zeros(num_groups)
        self.value, self.theta, self._stalled = np.inf, 1.0, 0
        self._now = self._direction = np.zeros_like(self._scale)
        # Rows of each satellite's relaxed plans: at any multipliers its best is no worse than they.
        self._paths: list[list[Ints]] = [[] for _ in self.satellites]
        self.unit = self._unit(value)
        self.usage = np.zeros(len(problem.opportunities))
        self.contact_sets: Counter[tuple[int, ...]] = Counter()
        self.wants_antennas = False
        self.restart(multipliers)

    def _relaxations(self, levels_per_collect: int) -> tuple[SatelliteRelaxation, ...]:
        every = relaxations(self._problem, levels_per_collect)
        return tuple(one.with_data_multiplier(self._num_images) for one in every)

    def _scale_of_antennas(self) -> Floats:
        """Return the scale of antennas' steps, as the worth of a target is the scale of its own.

        A contact brings down many images, so its multiplier amounts to the worth of many. With four
        satellites and two stations a bound of 887 images falls to 865 in 40 steps this way, to 877
        if each group is scaled by its own contacts, and to 870 if groups move a twentieth as far.
        Shape ``(num_groups,)``.
        """
        volumes = []
        for relaxation in self.satellites:
            gain = relaxation.network.data_gain
            fills, drains = gain[gain > 0.0], -gain[relaxation.network.is_contact == 1]
            if len(fills) and len(drains):
                volumes.append(max(float(drains.mean() / np.median(fills)), 1.0))
        scale = self._typical * float(np.mean(volumes or 1.0)) ** 2
        return np.full(len(self._groups), scale)

    def _unit(self, value: float) -> float:
        largest = max(len(s.satellite) for s in self.satellites)
        unit = 2.0 ** np.floor(np.log2(self._typical)) / TUNING.units_per_reward
        while value / len(self.satellites) / unit > MAX_CELLS / largest:
            unit *= 2.0
        return float(unit)

    def step(self, level: float) -> bool:
        """Evaluate the current multipliers and step on; return False if there is no next step.

        Parameters
        ----------
        level
            The bound that the best multipliers are expected to prove.
        """
        now = self._now
        multipliers, antenna_multipliers = self._whole(now, self.unit)
        outcome = self._evaluate(multipliers, antenna_multipliers)
        if outcome is None:
            return False
        value, too_many = outcome
        self._stalled += 1
        if value < self.value - 1e-9:
            self.value, self.multipliers, self.antenna_multipliers = (
                value,
                multipliers,
                antenna_multipliers,
            )
            self._stalled = 0
        if self._stalled >= TUNING.patience:
            self.theta, self._stalled = self.theta * TUNING.shorter, 0
            self._return_to_the_best()
            return True
        gradient = np.where(self._is_moved, too_many, 0.0)
        gradient[(now <= 0.0) & (gradient < 0.0)] = 0.0
        gradient[(now >= self._most) & (gradient > 0.0)] = 0.0
        self._direction = (1.0 - TUNING.deflection) * gradient + TUNING.deflection * self._direction
        norm = float(self._direction @ (self._scale * self._direction))
        if norm <= NOTHING * float(self._scale.max()):
            return False
        length = self.theta * (value - max(level, (1.0 - TUNING.little) * self.value)) / norm
        self._now = np.clip(now + length * self._scale * self._direction, 0.0, self._most)
        return True

    def bound(self) -> Bound:
        """Return the best bound."""
        return Bound(
            value=self.value,
            proof="dp",
            multipliers=self.multipliers,
            antenna_multipliers=self.antenna_multipliers
            if self.antenna_multipliers.any()
            else None,
            unit=self.unit,
        )

    def count_in(self, unit: float, *, moves_antennas: bool) -> None:
        """Continue in other units of worth; let the multipliers of antennas move, or hold them.

        If they move, those of targets hardly do: an antenna's steps are scaled by the many images
        that its contacts bring down.
        """
        self.unit = unit
        self._is_moved[len(self._is_reachable) :] = moves_antennas
        self.restart(self.multipliers)

    def count_finely(self, plan: Plan) -> None:
        """Go on with more levels of the recorder, from a known plan."""
        self.satellites = self._relaxations(TUNING.fine)
        # With these levels some of the paths so far are infeasible.
        self._paths = [[] for _ in self.satellites]
        self.learn(plan)
        self._return_to_the_best()

    @property
    def is_settled(self) -> bool:
        """Whether steps have got so short that more are of little use."""
        return bool(self.theta <= TUNING.shorter**TUNING.tries)

    @property
    def latest(self) -> Bools:
        """Which opportunities the latest answers take. Shape ``(n,)``."""
        taken = np.zeros(len(self._problem.opportunities), dtype=np.bool_)
        for relaxation, paths in zip(self.satellites, self._paths, strict=True):
            taken[relaxation.satellite.rows[paths[-1]]] = True
        return taken

    def learn(self, plan: Plan) -> None:
        """Add a known plan to the relaxed plans."""
        taken = np.zeros(len(self._problem.opportunities), dtype=np.bool_)
        taken[[action.opportunity for action in plan.actions]] = True
        for relaxation, paths in zip(self.satellites, self._paths, strict=True):
            paths.append(np.flatnonzero(taken[relaxation.satellite.rows]).astype(np.int32))
        self._note_images(np.flatnonzero(taken))

    def restart(self, multipliers: Floats, antenna_multipliers: Floats | None = None) -> None:
        """Go on from other multipliers of targets, and of antennas, in steps of full length.

        Multipliers of antennas stay the best so far by default. The best value is forgotten.
        """
        if antenna_multipliers is not None:
            self.antenna_multipliers = antenna_multipliers
        self.value, self.multipliers = np.inf, np.where(self._is_reachable, multipliers, 0.0)
        self.theta, self._stalled = 1.0, 0
        self._return_to_the_best()

    def _return_to_the_best(self) -> None:
        self._now = np.append(self.multipliers, self.antenna_multipliers)
        self._direction = np.zeros_like(self._now)

    def _whole(self, multipliers: Floats, unit: float) -> tuple[Floats, Floats]:
        """Return multipliers, also of antennas, at which images taken are worth whole units."""
        multipliers, antenna_multipliers = np.split(multipliers, [len(self._is_reachable)])
        whole = leaving_whole_units(self._problem, multipliers, unit, self._worth_taken)
        whole[~self._is_reachable] = 0.0
        return whole, unit * np.round(antenna_multipliers / unit)

    def _note_images(self, rows: npt.NDArray[np.integer]) -> None:
        """Note what the images among these opportunities earn, as those that plans take."""
        images = rows[self._problem.opportunities.kind[rows] == COLLECT]
        self._worth_taken[self._problem.opportunities.site[images]] = self._problem.worth[images]

    def _known(self, i: int, worth: Ints) -> int | None:
        """Return the most that a satellite gains on a known path; None if none is known."""
        weight = worth[self.satellites[i].satellite.rows]
        gains = (max(0, int(weight[path].sum())) for path in self._paths[i])
        return max(gains, default=None)

    def _evaluate(
        self, multipliers: Floats, antenna_multipliers: Floats
    ) -> tuple[float, Floats] | None:
        """Return the bound at these multipliers, and how often too many its paths take each target.

        After the targets come the groups of contacts; None once stopped. Shape
        ``(num_targets + num_groups,)``.
        """
        problem = self._problem
        worth = whole_worth(problem, multipliers, self.unit, antenna_multipliers)
        taken = np.zeros(len(worth))
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
            taken[rows] += 1.0
            self._note_images(rows)
        self.usage += taken
        table = problem.opportunities
        contacts = np.flatnonzero((taken > 0.0) & (table.kind == CONTACT))
        self.contact_sets[tuple(contacts.tolist())] += 1
        images = np.flatnonzero((taken > 0.0) & (table.kind == COLLECT))
        images = images[problem.worth[images] >= multipliers[table.site[images]]]
        counts = np.bincount(table.site[images], minlength=len(multipliers))
        excess = np.array([taken[group.rows].sum() - group.limit for group in self._groups])
        self.wants_antennas |= bool(np.any(excess > 0.0))
        paid = float(multipliers.sum()) + paid_for_antennas(problem, antenna_multipliers)
        rounded_away = 1e-9 * len(worth) * self.unit
        return paid + units * self.unit + rounded_away, np.append(counts - 1.0, excess)
