"""Plans under battery and recorder: exact programmes over a choice of tasks for each target.

If each target has only one task, no target can be collected twice, and the exact programme finds
the best plan of those tasks, with contacts and energy spread over the whole horizon. The search
is over which tasks these are: it opens some targets to all their tasks, runs the programme, and
settles every target collected more than once on one of its tasks, until there is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.certified.dp.completion_bounds import least_energy
from planner_core.certified.dp.data_levels import DataLevels, data_levels, levels_of_part
from planner_core.certified.dp.forward_labels import Goal, most_value, path_of
from planner_core.certified.dp.resource_network import (
    Network,
    cost_on_board,
    part_of,
    strict_network_of,
    worth_before_left,
)
from planner_core.certified.sizes import MAX_UNITS
from planner_core.certified.tuning import TUNING
from planner_core.problem import (
    COLLECT,
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.solvers.sequential import blocked_rows
from planner_core.worth import worth_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SatelliteChoices:
    """One satellite's programme for plans: strict limits, data levels never below the true ones.

    Attributes
    ----------
    target
        Of each task; -1 for contacts. Shape ``(m,)``.
    weight
        Worth of each task in units. Shape ``(m,)``.
    end_cost
        Cost in units of each data level at the end. Shape ``(num_levels,)``.
    """

    rows: Ints
    network: Network
    levels: DataLevels
    target: Ints
    weight: Ints
    end_cost: Ints

    @classmethod
    def of(cls, problem: Problem, index: int, worth: Floats, unit: float) -> SatelliteChoices:
        """Return the programme of a satellite that has opportunities.

        Parameters
        ----------
        worth
            Of each opportunity, without the cost of its data staying on board. Shape ``(n,)``.
        """
        satellite = problem.satellites[index]
        network = strict_network_of(problem, satellite)
        target = np.where(satellite.kind == COLLECT, satellite.site, -1).astype(np.int32)
        levels = data_levels(network, 2, is_optimistic=False)
        in_units = np.round(worth[satellite.rows] / unit)
        cost = np.round(network.left_cost * np.maximum(levels.least, 0.0) / unit)
        return cls(
            rows=satellite.rows,
            network=network,
            levels=levels,
            end_cost=np.minimum(cost, MAX_UNITS).astype(np.int32),
            target=target,
            # The bound counts at most ``max_units``: a task worth more than that is in no plan.
            weight=np.minimum(in_units, TUNING.max_units).astype(np.int32),
        )

    def best(self, allowed: Bools, goal: int, stop: Bytes) -> tuple[int, Ints]:
        """Return units and tasks of the best plan of the allowed tasks worth ``goal`` or more.

        Returns -1 and no tasks if there is none. The plan may collect a target several times.
        """
        if self.network.must_deliver:
            allowed = allowed & ((self.target < 0) | self._comes_down(allowed))
        rows = np.flatnonzero(allowed | self.network.is_kept).astype(np.int32)
        nothing = rows[:0]
        if len(rows) == 0:
            return (0, nothing) if goal <= 0 else (-1, nothing)
        network, levels = part_of(self.network, rows), levels_of_part(self.levels, rows)
        weight = self.weight[rows]
        images = np.flatnonzero(weight > 0)
        if self.network.must_deliver and len(images):
            end = min(levels.end, int(levels.delivered[images[-1]]))
            levels = levels._replace(end=end)
        # Totals a little above the goal show whether it can be reached, and cost little memory.
        limit = int(1.15 * max(goal, 0)) + 16 + int(weight.max(initial=0))
        idle, after = least_energy(network, weight, limit)
        top = int(np.flatnonzero(idle[0] <= network.energy_start)[-1])
        if top < goal:
            return -1, nothing
        idle, after = idle[:, : top + 1].copy(), after[:, : top + 1].copy()
        credit = np.zeros(levels.num_levels, dtype=np.int32)
        wanted = Goal(max(goal, 0), idle, after, credit)
        cost = self.end_cost
        value, labels = most_value(network, levels, weight, cost, wanted, top, True, stop)
        if value < 0:
            return -1, nothing
        return value, rows[path_of(network, levels, weight, cost, labels, value)]

    def value_of(self, taken: Bools) -> int:
        """Return the units that a plan of these tasks gains."""
        levels, level = self.levels, self.levels.start
        for row in np.flatnonzero(taken):
            level = max(int(levels.floor[row]), level + int(levels.gain[row]), 0)
        cost = self.end_cost[min(level, levels.num_levels - 1)]
        return max(int(self.weight[taken].sum()) - int(cost), 0)

    def _comes_down(self, allowed: Bools) -> Bools:
        """Return the tasks that lie before an allowed contact."""
        contacts = np.flatnonzero(allowed & (self.target < 0))
        last = contacts[-1] if len(contacts) else 0
        before: Bools = np.arange(len(allowed)) < last
        return before

    def closings(self) -> Ints:
        """Return the last few contacts, latest first: candidates for the last one of a plan."""
        contacts = np.flatnonzero(self.target < 0).astype(np.int32)
        return contacts[::-1][: TUNING.several]


class ChoiceSearch:
    """The best plan so far, and moves that replan one satellite after another.

    Attributes
    ----------
    taken
        Whether the plan takes each opportunity. Shape ``(n,)``.
    reward
        What the plan's targets earn, less the cost of data that stays on board.
    usage
        How many of the plans accepted so far took each opportunity. Shape ``(n,)``.
    """

    def __init__(self, problem: Problem, unit: float, seed: int, stop: Bytes) -> None:
        self._problem, self._stop = problem, stop
        self._rng = np.random.default_rng(seed)
        self._worths = worth_before_left(problem)
        self._satellites = [
            (index, SatelliteChoices.of(problem, index, self._worths, unit))
            for index, satellite in enumerate(problem.satellites)
            if len(satellite)
        ]
        self._turn = 0
        self.taken: Bools = np.zeros(len(problem.opportunities), dtype=np.bool_)
        self.reward = 0.0
        self.usage = np.zeros(len(problem.opportunities))

    @property
    def plan(self) -> Plan:
        """The current plan."""
        return Plan.of(self._problem, np.flatnonzero(self.taken))

    def adopt(self, plan: Plan) -> None:
        """Continue from another plan."""
        self.taken[:] = False
        self.taken[[action.opportunity for action in plan.actions]] = True
        self.reward = self._worth(self.taken)

    def start(self, preferred: Bools, first_goal: float) -> None:
        """Plan each satellite over the targets the others leave; keep the plan if it is no worse.

        Parameters
        ----------
        preferred
            Opportunities allowed for their targets; every other target offers one at random.
        first_goal
            Goal tried first, as a share of what all allowed tasks of a satellite are worth.
        """
        before = self.taken.copy(), self.reward
        self.taken = np.zeros_like(self.taken)
        for index, satellite in self._satellites:
            others = self._taken_targets(self.taken)
            own = preferred[satellite.rows] & (satellite.target >= 0)
            has_own = self._mask(satellite.target[own])
            allowed = own | (self._one_each(satellite) & ~has_own[satellite.target])
            allowed &= ~others[satellite.target]
            self._let_contacts(allowed, index, satellite)
            goal = int(first_goal * satellite.weight[allowed].sum())
            value, path = self._first(satellite, allowed, goal)
            if value >= 0:
                self.taken[satellite.rows[path]] = True
        self.reward = self._worth(self.taken)
        if self.reward < before[1]:
            self.taken, self.reward = before

    def _first(self, satellite: SatelliteChoices, allowed: Bools, goal: int) -> tuple[int, Ints]:
        """Return units and tasks of a plan of allowed tasks, the best over a few last contacts."""
        best, path = -1, np.empty(0, dtype=np.int32)
        for closing in satellite.closings() if satellite.network.must_deliver else (None,):
            part, wanted, value = allowed.copy(), goal, -1
            if closing is not None:
                part[closing + 1 :] &= satellite.target[closing + 1 :] >= 0
            while value < 0 and not self._stop[0]:
                value, found = self._settled(satellite, part, max(wanted, best + 1))
                if wanted <= max(best, 0):
                    break
                wanted = int(wanted * (1.0 - TUNING.tight))
            if value > best:
                best, path = value, found
        return best, path

    def move(self) -> None:
        """Replan one satellite with some of its targets open; keep a plan that is worth no less."""
        index, satellite = self._satellites[self._turn % len(self._satellites)]
        self._turn += 1
        own = self.taken[satellite.rows]
        kept = own & (satellite.target >= 0)
        kept &= self._rng.random(len(kept)) >= self._rng.random() * TUNING.disturbance
        others = self.taken.copy()
        others[satellite.rows] = False
        elsewhere = self._taken_targets(others)
        is_settled = self._mask(satellite.target[kept])
        is_open = ~(is_settled | elsewhere)[satellite.target] & (satellite.target >= 0)
        share = TUNING.open_tasks / max(1, int(is_open.sum()))
        is_open &= self._rng.random(len(is_open)) < share
        allowed = kept | is_open | (own & (satellite.target >= 0))
        self._let_contacts(allowed, index, satellite)
        self._close(satellite, allowed, own)
        goal = satellite.value_of(own)
        value, path = self._settled(satellite, allowed, goal)
        if value < 0:
            return
        changed = others
        changed[satellite.rows[path]] = True
        reward = self._worth(changed)
        if reward >= self.reward:
            self.taken, self.reward = changed, reward
            self.usage += changed

    def _settled(self, satellite: SatelliteChoices, allowed: Bools, goal: int) -> tuple[int, Ints]:
        """Return units and tasks of a plan after settling each target on one task."""
        allowed = allowed.copy()
        num_targets = len(self._problem.target_ids)
        while True:
            value, path = satellite.best(allowed, goal, self._stop)
            # Kept tasks stay, even two images of a target.
            is_open = (satellite.target[path] >= 0) & ~satellite.network.is_kept[path]
            images = path[is_open]
            counts = np.bincount(satellite.target[images], minlength=num_targets + 1)
            if value < 0 or counts.max() <= 1:
                return value, path
            # A target collected more than once keeps its best task, a random one of equals.
            images = self._rng.permutation(images)
            images = images[np.argsort(satellite.weight[images], kind="stable")]
            chosen = np.full(num_targets + 1, -1)
            chosen[satellite.target[images]] = images
            once = (counts == 1) & (self._rng.random(num_targets + 1) < TUNING.disturbance)
            settled = (counts > 1) | once
            allowed &= ~settled[satellite.target]
            allowed[chosen[settled]] = True

    def _one_each(self, satellite: SatelliteChoices) -> Bools:
        """Return one task of each target, at random."""
        order = self._rng.permutation(len(satellite.target))
        order = order[satellite.target[order] >= 0]
        _, first = np.unique(satellite.target[order], return_index=True)
        chosen = np.zeros(len(satellite.target), dtype=np.bool_)
        chosen[order[first]] = True
        return chosen

    def _let_contacts(self, allowed: Bools, index: int, satellite: SatelliteChoices) -> None:
        """Allow the contacts whose stations the other satellites leave free."""
        others = self.taken.copy()
        others[satellite.rows] = False
        taken = [int(row) for row in np.flatnonzero(others)]
        blocked = blocked_rows(self._problem, self._problem.satellites[index], taken)
        allowed[(satellite.target < 0) & (blocked == 0)] = True

    def _close(self, satellite: SatelliteChoices, allowed: Bools, own: Bools) -> None:
        """If images must be downlinked, mostly keep the last contact of the plan as its last.

        Later ones would offer later images, and the last one offered decides how much may be left.
        """
        last = np.flatnonzero(own & (satellite.target < 0))
        if not satellite.network.must_deliver or len(last) == 0:
            return
        closing = last[-1]
        if self._rng.random() < TUNING.disturbance:
            closing = max(closing, self._rng.choice(satellite.closings()))
        allowed[closing + 1 :] &= satellite.target[closing + 1 :] >= 0

    def _mask(self, targets: Ints) -> Bools:
        """Return a mask of these targets; its last entry stands for contacts and is false."""
        mask = np.zeros(len(self._problem.target_ids) + 1, dtype=np.bool_)
        mask[targets] = True
        mask[-1] = False
        return mask

    def _taken_targets(self, taken: Bools) -> Bools:
        table = self._problem.opportunities
        return self._mask(table.site[taken & (table.kind == COLLECT)])

    def _worth(self, taken: Bools) -> float:
        table = self._problem.opportunities
        images = np.flatnonzero(taken & (table.kind == COLLECT))
        left = [cost_on_board(one.network, taken[one.rows]) for _, one in self._satellites]
        return worth_of(table.site[images], self._worths[images]) - sum(left)
