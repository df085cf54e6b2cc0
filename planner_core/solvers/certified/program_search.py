"""Plans of a fleet under battery and recorder by mixed-integer programs, with contacts drawn.

Near the best prices the relaxed plans of all satellites hold a few thousand tasks between them,
and the best plans are made of those. With its contacts fixed the program over them is nearly
tight, and HiGHS finds in seconds what no search from plan to plan does. Which contacts: those of a
satellite's own best plan at prices that are off by a little, less what it can do without, one
satellite after another where they share antennas. The relaxation tells good sets from others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from planner_core.bounds.bound import reward_unit
from planner_core.bounds.resource_bound import leaving_whole_units, whole_worth
from planner_core.bounds.resource_network import Network
from planner_core.plan import Plan
from planner_core.problem import CONTACT, Bools, Floats, Ints, Problem
from planner_core.solvers.base import Budget
from planner_core.solvers.certified.contact_sets import FixedContacts
from planner_core.solvers.certified.resource_prices import PriceSearch
from planner_core.solvers.sequential import blocked_rows
from planner_core.timeline import replay

_BEST: Final = 2  # of those sets that are planned with
_TRIES: Final = 2  # of a program without a better plan
_DRAWS: Final = 3  # sets of contacts beside those of plans
_OFF: Final = 0.2  # of a reward: what prices are off by at a draw
_MOST_OFFERED: Final = 6000  # tasks of a program: of a larger fleet it takes some satellites
_LEAST_GAIN: Final = 1e-6  # of the reward

Rows = tuple[int, ...]


class ProgramSearch:
    """The best plan so far, and turns that try to better it.

    Parameters
    ----------
    prices
        The satellites' programmes, and the best prices.
    usage
        How many plans that are relaxed at about these prices took each opportunity.
        Shape ``(n,)``.

    Attributes
    ----------
    plan, reward
        The plan, and what it is worth.
    """

    def __init__(
        self,
        problem: Problem,
        prices: PriceSearch,
        usage: Floats,
        budget: Budget,
        seed: int,
    ) -> None:
        self._problem, self._budget, self._seed = problem, budget, seed
        self._prices, self._unit = prices.prices, prices.unit
        self._satellites = prices.satellites
        self._is_promising = usage > 0.0
        self._rng = np.random.default_rng(seed)
        self._gain = reward_unit(problem)
        self._work = self._steps()
        self.plan, self.reward = Plan(), 0.0
        self._learned: list[int] = []

    def learn(self, plan: Plan) -> None:
        """Note what another search has found, and go on from there if that is better."""
        self._learned = [action.opportunity for action in plan.actions]
        self._offer(plan)

    def turn(self) -> None:
        """Draw some sets of contacts, or solve a program with one of the best."""
        next(self._work, None)

    def _steps(self) -> Iterator[None]:
        while not self._budget.is_spent():
            group = self._group()
            program = self._program(group)
            own = [action.opportunity for action in self.plan.actions]
            sets = [self._contacts(group, rows) for rows in (own, self._learned)]
            sets += [self._draw(group) for _ in range(_DRAWS)]
            if self._budget.is_spent():
                return
            ranked = self._ranked(program, group, sets)
            yield
            for fixed in ranked[:_BEST]:
                yield from self._improve(program, fixed)

    def _ranked(self, program: FixedContacts, group: Bools, sets: Sequence[Rows]) -> list[Rows]:
        """Return tasks to fix, those with which the relaxation is worth most first."""
        worth: dict[Rows, float] = {}
        for contacts in dict.fromkeys(sets):
            fixed = (*self._tasks_beside(group), *contacts)
            program.fix(fixed)
            worth[fixed] = program.relaxed()
        return sorted(worth, key=lambda fixed: -worth[fixed])

    def _improve(self, program: FixedContacts, fixed: Rows) -> Iterator[None]:
        """Better the plan with what is fixed, from one corner of the relaxation after another."""
        program.fix(fixed)
        value = program.relaxed()
        num_tries = 0
        while value >= self._better and num_tries < _TRIES:
            before = self.reward
            self._offer(program.plan(self._better, is_rounded=True))
            num_tries = 0 if self.reward > before else num_tries + 1
            yield
            program.turn_aside(self._rng)

    @property
    def _better(self) -> float:
        """What a better plan is worth at least."""
        return self.reward + max(self._gain, _LEAST_GAIN * self.reward)

    def _offer(self, plan: Plan | None) -> None:
        if plan is None:
            return
        timeline = replay(self._problem, plan)
        if timeline.is_valid and timeline.reward > self.reward:
            self.plan, self.reward = plan, timeline.reward

    def _group(self) -> Bools:
        """Return which satellites the next program is for. Shape ``(num_satellites,)``."""
        group = np.zeros(len(self._problem.satellites), dtype=np.bool_)
        num_offered = 0
        for relaxation in self._rng.permutation(np.array(self._satellites, dtype=object)):
            rows = relaxation.satellite.rows
            num_offered += int(self._is_promising[rows].sum())
            if num_offered > _MOST_OFFERED and group.any():
                break
            group[self._problem.opportunities.satellite[rows[0]]] = True
        return group

    def _program(self, group: Bools) -> FixedContacts:
        """Return the program of some satellites; the others do what they do in the plan."""
        offered = self._is_promising.copy()
        offered[[*self._learned, *(action.opportunity for action in self.plan.actions)]] = True
        offered &= group[self._problem.opportunities.satellite]
        beside = self._tasks_beside(group)
        return FixedContacts(
            self._problem, offered, beside, self._budget, self._seed, self._contacts(group)
        )

    def _tasks_beside(self, group: Bools) -> Rows:
        """Return what the plan has the other satellites do."""
        of = self._problem.opportunities.satellite
        rows = (action.opportunity for action in self.plan.actions)
        return tuple(row for row in rows if not group[of[row]])

    def _contacts(self, group: Bools, rows: Sequence[int] | None = None) -> Rows:
        """Return the contacts of some satellites, of all or among some opportunities."""
        table = self._problem.opportunities
        is_one = (table.kind == CONTACT) & group[table.satellite]
        if rows is not None:
            is_one &= np.isin(np.arange(len(table)), rows)
        return tuple(np.flatnonzero(is_one).tolist())

    def _draw(self, group: Bools) -> Rows:
        """Return contacts that satellites would have in turn, at prices that are a little off."""
        reward = self._problem.target_reward
        off = _OFF * reward * self._rng.standard_normal(len(reward)) * (self._prices > 0.0)
        prices = np.clip(self._prices + off, 0.0, reward)
        prices = leaving_whole_units(self._problem, prices, self._unit)
        worth = whole_worth(self._problem, prices, self._unit)
        table = self._problem.opportunities
        taken = [r for r in self._tasks_beside(group) if table.kind[r] == CONTACT]
        drawn: list[int] = []
        for index in self._rng.permutation(len(self._satellites)):
            relaxation = self._satellites[index]
            satellite = relaxation.satellite
            if not group[table.satellite[satellite.rows[0]]]:
                continue
            is_shut = blocked_rows(self._problem, satellite, taken + drawn) != 0
            _, path = relaxation.without(is_shut).most(worth, 0, self._budget.stop, keeps_path=True)
            if path is None:
                return ()
            drawn += satellite.rows[self._needed_contacts(relaxation.network, path)].tolist()
        return tuple(drawn)

    def _needed_contacts(self, network: Network, path: Ints) -> Ints:
        """Return contacts of a path without which the recorder would hold more than with all."""
        most = _overflow(network, path)
        for contact in self._rng.permutation(path[network.is_contact[path] != 0]):
            less = path[path != contact]
            if _overflow(network, less) <= most:
                path = less
        needed: Ints = path[network.is_contact[path] != 0]
        return needed


def _overflow(network: Network, path: Sequence[int] | Ints) -> float:
    """Return by how much the recorder passes its limits on a path, at most; 0 if it does not."""
    data, most = network.data_start, 0.0
    for k in path:
        most = max(most, data - network.data_before[k])
        data = max(network.data_floor[k], data + network.data_gain[k])
        most = max(most, data - network.data_after[k])
    return float(max(most, data - network.data_end))
