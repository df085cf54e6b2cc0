"""A search for plans under battery and recorder: satellites take turns to replan windows."""

from __future__ import annotations

import math

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.dp.resource_network import (
    cost_on_board,
    strict_network_of,
    worth_before_left,
)
from planner_core.certified.lns.moves import Assignment
from planner_core.certified.lns.resource_labels import SearchData, workspace_for
from planner_core.certified.lns.resource_moves import make_moves
from planner_core.certified.signs import UNASSIGNED
from planner_core.certified.tuning import TUNING
from planner_core.draws import draws_of
from planner_core.precedence.relation import is_transitive
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.solvers.sequential import blocked_rows


class ResourceWindows:
    """A plan of all satellites, and moves that improve it or leave it as good."""

    def __init__(self, problem: Problem, seed: int) -> None:
        self._problem = problem
        self._draws = draws_of(seed)
        num_targets = len(problem.target_ids)
        self._workspace = workspace_for(num_targets)
        self._turn = 0
        is_locked = _locked_targets(problem)
        self._worths = worth_before_left(problem)
        table = problem.opportunities
        self._contacts = np.flatnonzero(table.kind == CONTACT)
        self._shut_by, self._is_shut = self._contacts[:0], dict[int, Bools]()
        self._searches = [
            SearchData(
                network=strict_network_of(problem, satellite),
                rows=satellite.rows,
                local=problem.local_row,
                satellite=table.satellite,
                number=index,
                target=np.where(satellite.kind == COLLECT, satellite.site, num_targets).astype(
                    np.int32
                ),
                worth=self._worths,
                typical=problem.typical_worth,
                is_locked=is_locked,
                is_shut=np.zeros(len(satellite), dtype=np.bool_),
                liking=np.zeros(len(table)),
                is_polish=False,
                noise=0.0,
            )
            for index, satellite in enumerate(problem.satellites)
            if len(satellite)
        ]
        self.adopt(Plan())

    def go_by(self, worth: Floats, liking: Floats) -> None:
        """Become a polish: leave the worth of the plan and its contacts alone from now on.

        Parameters
        ----------
        worth
            Of each opportunity with those contacts. Shape ``(n,)``.
        liking
            Secondary objective of each opportunity, from -1 to 1. Shape ``(n,)``.
        """
        # The referee judges each step: it rejects a drop of a task that a slow satellite needs.
        kept = _kept_targets(self._problem)
        self._searches = [
            search._replace(
                network=search.network._replace(left_cost=0.0),
                worth=worth,
                liking=liking,
                is_locked=kept,
                is_polish=True,
            )
            for search in self._searches
        ]

    def adopt(self, plan: Plan) -> None:
        """Continue from another plan."""
        table = self._problem.opportunities
        is_taken = np.zeros(len(table), dtype=np.bool_)
        is_taken[plan.columns.row] = True
        imaged_by = np.full(len(self._problem.target_ids) + 1, UNASSIGNED, dtype=np.int32)
        # The best image of a target counts; of equally good ones, the first.
        images = np.flatnonzero(is_taken & (table.kind == COLLECT))[::-1]
        images = images[np.argsort(self._worths[images], kind="stable")]
        imaged_by[table.site[images]] = images
        self._assignment = Assignment(is_taken=is_taken, imaged_by=imaged_by)
        self._note_contacts()

    def make_moves(self, num_moves: int, budget: Budget) -> None:
        """Make at most ``num_moves`` moves, fewer if tasks are few or the budget is spent first."""
        while self._searches and num_moves > 0 and not budget.is_spent():
            search = self._searches[self._turn % len(self._searches)]
            self._turn += 1
            self._make_moves_on(search, min(num_moves, _in_a_step(search)), budget)
            num_moves -= TUNING.moves_in_a_step

    def make_moves_on_each(self, num_moves: float, budget: Budget) -> None:
        """Make ``num_moves`` moves on each satellite, with the same exceptions.

        If that is less than one, one move on that share of the satellites, which take turns.
        """
        searches, each = self._searches, max(1, int(num_moves))
        if num_moves < 1.0:
            first, self._turn = self._turn, self._turn + max(1, round(num_moves * len(searches)))
            searches = [searches[turn % len(searches)] for turn in range(first, self._turn)]
        for search in searches:
            if budget.is_spent():
                break
            self._make_moves_on(search, min(each, TUNING.patience * _in_a_step(search)), budget)

    def anneal(self, num_moves: float, budget: Budget) -> None:
        """Make ``num_moves`` moves on each satellite at each noise level; keep the better plan.

        The noising method (Charon and Hudry 1993): worths are drawn up to twice as high, then less
        and less, and a move may lose as much. If images differ in worth, few moves lead to plans of
        the same worth, and a search that never loses is soon stuck: five real satellites over 500
        cities, images worth less off nadir, stood at 315 of at most 327 from the third second to
        the thirtieth.
        """
        known, plan = self.reward, self.plan
        for noise in (*np.geomspace(1.0, TUNING.little, TUNING.rounds - 1).tolist(), 0.0):
            self._searches = [search._replace(noise=noise) for search in self._searches]
            self.make_moves_on_each(num_moves, budget)
        if self.reward < known:
            self.adopt(plan)

    def _make_moves_on(self, search: SearchData, num_moves: int, budget: Budget) -> None:
        search = search._replace(is_shut=self._shut(search))
        make_moves(search, self._assignment, self._workspace, self._draws, num_moves, budget.stop)

    def _note_contacts(self) -> None:
        """Forget which contacts are shut if the plan's contacts have changed."""
        taken = self._contacts[self._assignment.is_taken[self._contacts]]
        if not np.array_equal(taken, self._shut_by):
            self._shut_by, self._is_shut = taken, {}

    def _shut(self, search: SearchData) -> Bools:
        """Return the contacts of a satellite whose antenna another satellite holds, as a mask."""
        if not search.is_polish:  # a polish moves no contact
            self._note_contacts()
        index, taken = search.number, self._shut_by
        if index not in self._is_shut:
            satellite = self._problem.satellites[index]
            others = taken[self._problem.opportunities.satellite[taken] != index]
            blocked = blocked_rows(self._problem, satellite, others.tolist())
            self._is_shut[index] = blocked != 0
        return self._is_shut[index]

    @property
    def plan(self) -> Plan:
        """The current plan."""
        return Plan.of(self._problem, np.flatnonzero(self._assignment.is_taken).tolist())

    @property
    def reward(self) -> float:
        """What the plan's targets earn, less the cost of data that stays on board."""
        held, taken = self._assignment.imaged_by[:-1], self._assignment.is_taken
        left = [cost_on_board(one.network, taken[one.rows]) for one in self._searches]
        return float(self._worths[held[held != UNASSIGNED]].sum()) - sum(left)


def _locked_targets(problem: Problem) -> Bools:
    """Return which targets stay where they are imaged; the last entry stands for contacts."""
    locked = _kept_targets(problem)
    if not is_transitive(problem):
        # The tasks around a dropped one might not be compatible without it.
        locked[:] = True
    return locked


def _kept_targets(problem: Problem) -> Bools:
    """Return which targets are imaged by a kept task; the last entry stands for contacts."""
    is_kept = np.zeros(len(problem.target_ids) + 1, dtype=np.bool_)
    table, kept = problem.opportunities, problem.kept_rows
    is_kept[table.site[kept[table.kind[kept] == COLLECT]]] = True
    return is_kept


def _in_a_step(search: SearchData) -> int:
    """Return how many moves a satellite makes at a time: few if it has few tasks."""
    return min(TUNING.moves_in_a_step, math.ceil(TUNING.moves_per_task * len(search.rows)))
