"""The search for plans with continuous starts, without resources."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.lns.continuous_moves import RouteSearch, make_moves, scratch_of
from planner_core.certified.lns.insertion import insert_each
from planner_core.certified.lns.route import Route, empty_route, remove, update_early, update_late
from planner_core.certified.proofs.continuous import rough_cell_s, width_for
from planner_core.certified.signs import ELSEWHERE, FIXED, UNASSIGNED
from planner_core.certified.sizes import MAX_FOLLOWERS
from planner_core.certified.tuning import TUNING
from planner_core.draws import draws_of
from planner_core.precedence.earliest_starts import EarliestStarts, earliest_starts_of
from planner_core.precedence.time_windows import (
    TimeWindows,
    View,
    action_of,
    time_windows_of,
    view_of,
)
from planner_core.problem import (
    COLLECT,
    Floats,
    Ints,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Satellite:
    """One satellite's search data, and its part of the plan."""

    spans: TimeWindows
    view: View
    worth: Floats
    route: Route

    @classmethod
    def of(cls, problem: Problem, index: int, plan: Plan) -> Satellite:
        """Return a satellite with its part of a plan, in which each target is taken once."""
        table = problem.opportunities
        spans, view = time_windows_of(problem, index), view_of(problem, index)
        worth = problem.worth[spans.row]
        # A kept task is worth more than all others together, so that no move drops it.
        worth[spans.is_kept] += 1.0 + float(problem.best_worth.sum())
        tasks: dict[int, int] = {}
        for action in plan.actions:
            i = action.opportunity
            if table.satellite[i] == index and table.kind[i] == COLLECT:
                is_its = (table.access[spans.row] == table.access[i]) & (
                    spans.close_s > action.start_s - 1e-3
                )
                tasks.setdefault(int(table.site[i]), int(np.flatnonzero(is_its)[0]))
        route = empty_route(len(spans.row) + 128)
        route.size[0] = len(tasks)
        route.task[: len(tasks)] = list(tasks.values())
        is_timed = update_early(spans, view, route, 0, len(tasks)) and update_late(
            spans, view, route, len(tasks) - 1, -1
        )
        if not is_timed:
            route.size[0] = 0
        return cls(spans=spans, view=view, worth=worth, route=route)

    @property
    def tasks(self) -> Ints:
        """Tasks of its part of the plan, in order."""
        return self.route.task[: self.route.size[0]]


class ContinuousSearch:
    """A plan of a problem without resources, and moves that improve it.

    Contacts of the plan to start from are dropped.
    """

    def __init__(self, problem: Problem, plan: Plan, budget: Budget, seed: int) -> None:
        self.problem, self.budget = problem, budget
        timeline = replay(problem, plan, in_detail=False)
        self.plan, self.reward, self._is_valid = plan, timeline.reward, timeline.is_valid
        self._draws = draws_of(seed)
        self.satellites = [
            Satellite.of(problem, index, plan) for index in range(len(problem.satellites))
        ]
        self._tables: dict[int, EarliestStarts] = {}
        self._num_kept = self._num_calls = 0
        self._width_s = max(rough_cell_s(), width_for(problem))

    def earliest(self, index: int) -> EarliestStarts:
        """Return a satellite's table; keep it for later calls if all kept ones stay small."""
        table = self._tables.get(index)
        if table is None:
            satellite = self.satellites[index]
            table = earliest_starts_of(
                satellite.spans, satellite.view, self._width_s, self.budget.stop
            )
            if self._num_kept + len(table.to) <= MAX_FOLLOWERS:
                self._tables[index] = table
                self._num_kept += len(table.to)
        return table

    def fill(self) -> None:
        """Insert tasks that fit into the gaps of the plan, in order of worth."""
        for index, satellite in enumerate(self.satellites):
            order = np.lexsort((satellite.spans.open_s, -satellite.worth)).astype(np.int32)
            insert_each(
                satellite.spans, satellite.view, order, self._imaged_by(index), satellite.route,
                self.budget.stop,
            )  # fmt: skip
        self._note()

    def move(self, num_moves: int) -> bool:
        """Make moves on each satellite in turn; return whether the plan earns more.

        A satellite whose table is not kept makes the moves of several calls in one of them.
        """
        before = self.reward
        self._num_calls += 1
        for index in range(len(self.satellites)):
            left = num_moves
            if self._num_calls > 1 and index not in self._tables:
                if self._num_calls % TUNING.rounds:
                    continue
                left = num_moves * TUNING.rounds
            if self.budget.is_spent() or len(self.satellites[index].spans.row) == 0:
                continue
            earliest = self.earliest(index)
            while left > 0 and not self.budget.is_spent():
                self._turn(index, earliest, min(left, TUNING.moves_at_a_time))
                left -= TUNING.moves_at_a_time
        self._note()
        return self.reward > before

    def _turn(self, index: int, earliest: EarliestStarts, num_moves: int) -> None:
        """Make moves on one satellite."""
        satellite = self.satellites[index]
        spans, view = satellite.spans, satellite.view
        num_cells = int(earliest.first_cell[-1])
        scratch = scratch_of(len(spans.row), num_cells, len(self.problem.target_ids))
        imaged_by = self._imaged_by(index)
        before = imaged_by.copy()
        search = RouteSearch(
            spans, view, earliest, satellite.worth, imaged_by, satellite.route, scratch, self._draws
        )
        make_moves(search, num_moves, TUNING.window_tasks[1], self.budget.stop)
        for site in np.flatnonzero((before == ELSEWHERE) & (imaged_by >= 0)).tolist():
            self._give_up(index, site)

    def _imaged_by(self, index: int) -> Ints:
        """Return what images each target, as one satellite sees it."""
        imaged_by = np.full(len(self.problem.target_ids), UNASSIGNED, dtype=np.int32)
        for other in self.satellites:
            is_kept = other.spans.is_kept[other.tasks]
            imaged_by[other.spans.site[other.tasks]] = np.where(is_kept, FIXED, ELSEWHERE)
        satellite = self.satellites[index]
        imaged_by[satellite.spans.site[satellite.tasks]] = satellite.tasks
        return imaged_by

    def _give_up(self, index: int, site: int) -> None:
        """Remove a target from the other satellites' routes."""
        for other, satellite in enumerate(self.satellites):
            if other == index:
                continue
            for p in np.flatnonzero(satellite.spans.site[satellite.tasks] == site).tolist():
                remove(satellite.spans, satellite.view, satellite.route, p)

    def _note(self) -> None:
        """Keep the plan of the current routes if it is better."""
        actions = []
        for satellite in self.satellites:
            starts = satellite.route.early_s[: satellite.route.size[0]].tolist()
            rows = satellite.spans.row[satellite.tasks].tolist()
            actions += [action_of(self.problem, *pair) for pair in zip(rows, starts, strict=True)]
        plan = Plan(tuple(sorted(actions)))
        timeline = replay(self.problem, plan, in_detail=False)
        if (timeline.is_valid, timeline.reward) > (self._is_valid, self.reward):
            self.plan, self.reward, self._is_valid = plan, timeline.reward, timeline.is_valid
