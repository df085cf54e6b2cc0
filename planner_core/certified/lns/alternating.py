"""Two alternating searches for plans under battery and recorder.

The window search finds most of a plan in a second. When it stalls, the exact programmes over
choices of tasks, each over a satellite's whole horizon, lead to other plans of the same worth: with
other contacts, and energy left elsewhere.
"""

from __future__ import annotations

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.sizes import MAX_STARTS
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Plan


class AlternatingSearch:
    """Plans by windows and by choices of tasks, alternating, from one start after another.

    The same seed gives the same plans, whatever other searches run beside it.

    Parameters
    ----------
    start
        The plan to begin with, and to restart from when the search stalls, until another is
        adopted.
    unit
        Of worth, as the exact programmes count it.

    Attributes
    ----------
    ended
        The final plan of each start but the current one.
    usage
        How many of the plans on the way took each opportunity. Shape ``(n,)``.
    """

    def __init__(self, problem: Problem, start: Plan, unit: float, budget: Budget, seed: int):
        self.problem, self._start, self._budget = problem, start, budget
        self._num_satellites = sum(len(s) > 0 for s in problem.satellites)
        # If satellites turn to the sun to charge, tasks come in batches. Only replanning whole days
        # moves dense ones: of 2,000 targets 253 images instead of 251 after 15 s, with four
        # satellites 889 instead of 882. Otherwise more steps of windows take next to no time beside
        # a day and earn up to 2 % more (docs/bounds.md); without such turns they cost fleets worth.
        has_batches = problem.turns_to_the_sun
        num_images = np.count_nonzero(problem.opportunities.kind == COLLECT)
        is_dense = has_batches and num_images > self._num_satellites * TUNING.dense
        least = TUNING.several if has_batches else 1
        each = TUNING.patience if is_dense else 1
        self._num_choices = max(each * self._num_satellites, least)
        self._num_first_steps = 1 if has_batches else TUNING.patience
        # One satellite gains nothing by noise: with rewards of 1 to 10 it ends 0.2 % lower.
        worths = np.unique(problem.worth[problem.worth > 0.0])
        self._is_uneven = self._num_satellites > 1 and len(worths) > 1
        has_more_steps = self._is_uneven or (has_batches and not is_dense)
        self._num_steps = TUNING.several if has_more_steps else 1
        self._choices = ChoiceSearch(problem, unit, seed, budget.stop)
        self._seed, self._num_starts, self._idle_steps = seed, 0, TUNING.patience
        self._windows = self._afresh()
        self._windows.adopt(start)
        self.ended: list[Plan] = []
        self.usage = np.zeros(len(problem.opportunities))

    def step(self, num_steps: int) -> None:
        """Let each search continue from the other's plan, or restart once both have stalled."""
        for _ in range(num_steps):
            if self._idle_steps == TUNING.patience:
                self._begin()
                continue
            before = self._windows.reward
            self._replan_days()
            self._replan_windows(self._num_steps)
            self._note()
            self._idle_steps = 0 if self._windows.reward > before else self._idle_steps + 1

    def _begin(self) -> None:
        if self._num_starts:
            self.ended.append(self.plan)
            self._windows = self._afresh()
        self._windows.adopt(self._start)
        self._num_starts, self._idle_steps = self._num_starts + 1, 0
        # Whole days first: once most targets are taken, contacts hardly move.
        self._replan_days()
        self._replan_windows(self._num_first_steps)
        self._note()

    def _afresh(self) -> ResourceWindows:
        # Each start of each search has its own seed.
        return ResourceWindows(self.problem, self._seed + MAX_STARTS * self._num_starts)

    def adopt(self, plan: Plan) -> None:
        """Restart from another plan, now and from now on."""
        self._start, self._idle_steps = plan, TUNING.patience

    def _note(self) -> None:
        self.usage[[action.opportunity for action in self.plan.actions]] += 1.0

    def _replan_days(self) -> None:
        """Replan each satellite's whole day by choices of tasks."""
        self._choices.adopt(self._windows.plan)
        for _ in range(self._num_choices):
            if self._budget.is_spent():
                return
            self._choices.move()
        if self._choices.reward >= self._windows.reward:
            self._windows.adopt(self._choices.plan)

    def _replan_windows(self, num_steps: int) -> None:
        each = num_steps * TUNING.moves_in_a_step
        if self._is_uneven:
            self._windows.anneal(each / TUNING.rounds, self._budget)
        else:
            self._windows.make_moves(each * self._num_satellites, self._budget)

    @property
    def plan(self) -> Plan:
        """The current plan."""
        return self._windows.plan

    @property
    def reward(self) -> float:
        """What the plan's targets earn, less the cost of data that stays on board."""
        return self._windows.reward
