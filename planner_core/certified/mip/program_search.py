"""Plans of a fleet under battery and recorder by mixed-integer programs, with contacts drawn.

Near the best multipliers the relaxed plans of all satellites hold a few thousand tasks together,
and the best plans consist of those. With contacts fixed, the program over these tasks is nearly
tight, and HiGHS finds in seconds what no search from plan to plan does. The contacts are those of
each satellite's own best plan at slightly perturbed multipliers, less the needless ones, one
satellite after another as they share antennas. The relaxation tells good sets from others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Protocol

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.certified.mip.solution_pool import PlanPool, Rows, rows_of
from planner_core.certified.multipliers.resources import ResourceAscent
from planner_core.certified.proofs.resource_bound import leaving_whole_units, whole_worth
from planner_core.certified.tuning import TUNING
from planner_core.problem import (
    CONTACT,
    Bools,
    Floats,
    Ints,
    Problem,
)
from planner_core.solvers.sequential import blocked_rows


class Costs(Protocol):
    """Estimates of what opportunities cost."""

    @property
    def losses(self) -> Floats:
        """Approximate cost of taking each; infinite if no good plan does. Shape ``(n,)``."""


class ProgramSearch:
    """Steps that seek plans for a pool.

    Parameters
    ----------
    pool
        Where plans are taken from and added to.
    ascent
        Holds the satellites' programmes and the best multipliers.
    costs
        What taking each opportunity costs, as far as known at the time.

    Attributes
    ----------
    steps_beside
        How many steps of the other search take about as long as the next step here.
    """

    def __init__(
        self,
        problem: Problem,
        pool: PlanPool,
        ascent: ResourceAscent,
        costs: Costs,
        budget: Budget,
        seed: int,
    ) -> None:
        self._problem, self._budget, self._seed = problem, budget, seed
        self._pool = pool
        self._ascent = ascent
        self._satellites = ascent.satellites
        self._costs = costs
        self._offered_per_task = TUNING.tasks_per_task
        self._rng = np.random.default_rng(seed)
        self._work = self._steps()
        self.steps_beside = next(self._work, 1)

    def step(self) -> None:
        """Solve a program with the most promising contacts, known or drawn."""
        self.steps_beside = next(self._work, 1)

    def _steps(self) -> Iterator[int]:
        """Yield how long each step will take, before it."""
        yield TUNING.steps_beside
        while not self._budget.is_spent():
            group = self._group()
            # Tasks of the other satellites stay fixed, though the plan may change meanwhile.
            beside = self._tasks_beside(group)
            program = self._program(group, beside)
            before = self._pool.reward
            sets = [self._contacts(group, rows) for rows in self._known()]
            yield from self._improve_best(program, beside, sets)
            if self._pool.reward == before:
                yield TUNING.steps_beside
                sets = []
                while len(sets) < TUNING.several and not self._budget.is_spent():
                    sets.append(self._draw(group, beside))
                yield from self._improve_best(program, beside, sets)
            if self._pool.reward == before:
                self._offered_per_task = min(TUNING.more * self._offered_per_task, TUNING.several)
                yield TUNING.steps_beside

    def _improve_best(
        self, program: FixedContacts, beside: Rows, sets: Sequence[Rows]
    ) -> Iterator[int]:
        """Improve the plan with the most promising of some sets of contacts."""
        worth: dict[Rows, float] = {}
        for contacts in dict.fromkeys(sets):
            fixed = (*beside, *contacts)
            program.fix(fixed)
            worth[fixed] = program.relaxed()
        for fixed in sorted(worth, key=lambda fixed: -worth[fixed])[: TUNING.tries]:
            yield from self._improve(program, fixed)

    def _improve(self, program: FixedContacts, fixed: Rows) -> Iterator[int]:
        """Improve the plan with these tasks fixed, from several corners of the relaxation."""
        program.fix(fixed)
        value = program.relaxed()
        num_tries = 0
        while value >= self._pool.better and num_tries < TUNING.tries:
            before = self._pool.reward
            self._pool.add(program.plan(self._pool.better, is_rounded=True))
            num_tries = 0 if self._pool.reward > before else num_tries + 1
            program.turn_aside(self._rng)
            yield TUNING.steps_beside

    def _group(self) -> Bools:
        """Return which satellites the next program is for. Shape ``(num_satellites,)``."""
        group = np.zeros(len(self._problem.satellites), dtype=np.bool_)
        is_promising, num_offered = self._promising(), 0
        for relaxation in self._rng.permutation(np.array(self._satellites, dtype=object)):
            rows = relaxation.satellite.rows
            num_offered += int(is_promising[rows].sum())
            if num_offered > TUNING.most_columns and group.any():
                break
            group[self._problem.opportunities.satellite[rows[0]]] = True
        return group

    def _promising(self) -> Bools:
        """Return the tasks of least loss: a fixed number for each task of the best plan."""
        losses = self._costs.losses
        num_offered = int(self._offered_per_task * len(self._pool.plan.actions))
        cut_off = np.sort(losses[np.isfinite(losses)])[:num_offered].max(initial=0.0)
        promising: Bools = losses <= cut_off
        return promising

    def _known(self) -> tuple[Rows, Rows]:
        """Return the tasks of the best plan, and of the latest one of the other search."""
        return rows_of(self._pool.plan), self._pool.latest

    def _program(self, group: Bools, beside: Rows) -> FixedContacts:
        """Return the program of some satellites, with the others' tasks fixed."""
        offered = self._promising()
        offered[[*chain(*self._known())]] = True
        offered &= group[self._problem.opportunities.satellite]
        return FixedContacts(
            self._problem, offered, beside, self._budget, self._seed, self._contacts(group)
        )

    def _tasks_beside(self, group: Bools) -> Rows:
        """Return the tasks of the plan on the other satellites."""
        of = self._problem.opportunities.satellite
        return tuple(row for row in rows_of(self._pool.plan) if not group[of[row]])

    def _contacts(self, group: Bools, rows: Sequence[int] | None = None) -> Rows:
        """Return the contacts of some satellites, all or those among ``rows``."""
        table = self._problem.opportunities
        is_one = (table.kind == CONTACT) & group[table.satellite]
        if rows is not None:
            is_one &= np.isin(np.arange(len(table)), rows)
        return tuple(np.flatnonzero(is_one).tolist())

    def _draw(self, group: Bools, beside: Rows) -> Rows:
        """Return the contacts that satellites choose in turn at slightly perturbed multipliers."""
        most = self._problem.best_worth
        known, unit = self._ascent.multipliers, self._ascent.unit
        off = TUNING.near * most * self._rng.standard_normal(len(most)) * (known > 0.0)
        multipliers = leaving_whole_units(self._problem, np.clip(known + off, 0.0, most), unit)
        worth = whole_worth(self._problem, multipliers, unit, self._ascent.antenna_multipliers)
        table = self._problem.opportunities
        taken = [r for r in beside if table.kind[r] == CONTACT]
        drawn: list[int] = []
        for index in self._rng.permutation(len(self._satellites)):
            relaxation = self._satellites[index]
            satellite = relaxation.satellite
            if not group[table.satellite[satellite.rows[0]]]:
                continue
            if self._budget.is_spent():
                return ()
            is_shut = blocked_rows(self._problem, satellite, taken + drawn) != 0
            _, path = relaxation.without(is_shut).most(
                worth, unit, 0, self._budget.stop, keeps_path=True
            )
            if path is None:
                return ()
            drawn += satellite.rows[self._needed_contacts(relaxation.network, path)].tolist()
        return tuple(drawn)

    def _needed_contacts(self, network: Network, path: Ints) -> Ints:
        """Drop contacts of a path while its recorder overflows no more; return the others."""
        most = _overflow(network, path)
        for contact in self._rng.permutation(path[network.is_contact[path] != 0]):
            less = path[path != contact]
            if _overflow(network, less) <= most:
                path = less
        needed: Ints = path[network.is_contact[path] != 0]
        return needed


def _overflow(network: Network, path: Sequence[int] | Ints) -> float:
    """Return the most by which the recorder exceeds its limits on a path; 0 if it does not."""
    data, most, end = network.data_start, 0.0, network.data_end
    for k in path:
        most = max(most, data - network.data_before[k])
        data = max(network.data_floor[k], data + network.data_gain[k])
        most = max(most, data - network.data_after[k])
        if network.must_deliver and not network.is_contact[k]:
            end = min(end, network.delivered[k])
    return float(max(most, data - end))
