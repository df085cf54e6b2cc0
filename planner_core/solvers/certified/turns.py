"""Two searches for plans under battery and recorder that take turns.

The window search finds most in a second. Where it stalls, the exact programmes over choices of
tasks, each a satellite's whole horizon, lead to other plans that are worth the same: with other
contacts, and energy left elsewhere.
"""

from __future__ import annotations

from typing import Final

from planner_core.plan import Plan
from planner_core.problem import Problem
from planner_core.solvers.base import Budget
from planner_core.solvers.certified.choices import ChoiceSearch
from planner_core.solvers.certified.resource_windows import ResourceWindows

_MOVES: Final = 250  # of the window search in a turn, for each satellite
_CHOICES: Final = 1  # moves over a satellite's day, the same


class TurnSearch:
    """Plans by windows and by choices of tasks, in turn.

    Attributes
    ----------
    plan, reward
        The plan as it is now; it never gets worse.
    """

    def __init__(
        self, problem: Problem, choices: ChoiceSearch, plan: Plan, budget: Budget, seed: int
    ) -> None:
        self._num_satellites = sum(len(s) > 0 for s in problem.satellites)
        self._choices, self._budget = choices, budget
        self._windows = ResourceWindows(problem, seed)
        self._windows.adopt(plan)

    def windows(self, num_turns: int) -> None:
        """Replan windows, as many as in so many turns."""
        self._windows.make_moves(num_turns * _MOVES * self._num_satellites, self._budget)

    def turn(self) -> None:
        """Let one search go on from where the other got to."""
        self._choices.adopt(self._windows.plan)
        for _ in range(_CHOICES * self._num_satellites):
            if self._budget.is_spent():
                return
            self._choices.move()
        if self._choices.reward >= self._windows.reward:
            self._windows.adopt(self._choices.plan)
        self.windows(1)

    @property
    def plan(self) -> Plan:
        """The plan as it is now."""
        return self._windows.plan

    @property
    def reward(self) -> float:
        """What its targets are worth."""
        return self._windows.reward
