"""Whenever a search's time is over, it ends with a valid plan and a bound above it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from typing import Final

import numpy as np
import pytest

from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.solver import Certified
from planner_core.certified.tuning import tuned
from planner_core.domain import Agility, Objective
from planner_core.precedence.relation import is_transitive
from planner_core.problem import Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.pinned import Kept, Pinned
from planner_core.referee.replay import replay
from planner_core.solvers.rule import Rule
from tests.planner_core.flat_earth import flat_problem
from tests.planner_core.problems import random_problem

SLOW: Final = Agility(slew_rate_deg_s=0.3)
_FIRST: Final = 6
_STOPS: Final = 7


class CountingBudget(Budget):
    """A budget that is spent after this many checks; then kernels stop too."""

    def __init__(self, checks: int | None) -> None:
        super().__init__()
        self._left = checks
        self._lock = threading.Lock()
        self.num_checks = 0
        self.told_after: list[int] = []
        self.report = self._note

    def _note(self, _: Progress) -> None:
        self.told_after.append(self.num_checks)

    def is_spent(self) -> bool:
        with self._lock:
            self.num_checks += 1
            if self._left is not None and self.num_checks > self._left:
                self.stop[0] = 1
        return super().is_spent()

    def stops(self) -> list[int]:
        """Return how many checks to stop after: the first few, around reports, evenly between."""
        reports = np.array(self.told_after)[:: max(1, len(self.told_after) // _STOPS)]
        evenly = np.linspace(_FIRST, self.num_checks, _STOPS, dtype=np.int64)
        every = np.concatenate([np.arange(_FIRST), reports, reports + 1, evenly])
        return [int(checks) for checks in np.unique(every[every < self.num_checks])]


def _pinned() -> Problem:
    """Return a problem in which HiGHS has to plan around pins."""
    problem = random_problem(4, num_collects=60, num_targets=30, use_resources=False,
                             max_turn_deg=60.0, has_rewards=True, agility=SLOW)  # fmt: skip
    assert not is_transitive(problem)
    row = Rule().solve(problem, Budget(), 0).plan.actions[0].opportunity
    return replace(problem, pinned=Pinned(kept=(Kept(row=row, pointer="/pins/keep/0"),)))


def _fleet_with_resources() -> Problem:
    return random_problem(0, num_collects=16, num_targets=8, num_contacts=3, num_satellites=2,
                          has_rewards=True)  # fmt: skip


FAMILIES: Final[dict[str, Callable[[], Problem]]] = {
    "agility only": lambda: random_problem(
        0, num_collects=250, num_targets=150, use_resources=False, has_rewards=True
    ),
    "a choice of starts": lambda: random_problem(
        2, num_collects=60, num_targets=30, use_resources=False, has_rewards=True, num_offers=4
    ),
    "pinned": _pinned,
    "fleet": lambda: random_problem(
        2, num_collects=200, num_targets=80, num_satellites=3, use_resources=False,
        has_rewards=True,
    ),
    "resources": lambda: random_problem(
        0, num_collects=40, num_targets=20, num_contacts=4, has_rewards=True
    ),
    "fleet with resources": _fleet_with_resources,
    "large fleet with resources": _fleet_with_resources,
    "large share, and images that age": lambda: with_objective(
        random_problem(0, num_collects=40, num_targets=20, num_contacts=4, has_rewards=True),
        Objective(collected_share=0.9, half_life_s=600.0),
    ),
    "continuous starts": lambda: flat_problem(
        1, num_targets=20, horizon_s=600.0
    ),
    "continuous starts with resources": lambda: flat_problem(
        2, num_targets=10, num_contacts=2, use_resources=True, spacing_s=60.0
    ),
}  # fmt: skip


@pytest.mark.parametrize("family", FAMILIES)
def test_a_budget_that_ends_at_any_stage_leaves_a_plan(family: str) -> None:
    problem = FAMILIES[family]()
    is_large = family.startswith("large")
    with tuned(large=3, fleet_patience=3, epochs=40) if is_large else nullcontext():
        _stop_at_each_stage(problem)


def _stop_at_each_stage(problem: Problem) -> None:
    whole = CountingBudget(None)
    Certified().solve(problem, whole, 0)
    assert len(whole.stops()) > _FIRST
    for checks in whole.stops():
        budget = CountingBudget(checks)
        solution = Certified().solve(problem, budget, 0)
        timeline = replay(problem, solution.plan)
        assert timeline.is_valid, checks
        assert solution.bound is None or solution.bound >= timeline.reward - 1e-9, checks
        # With HiGHS the number of checks depends on timing: this run may have ended earlier.
        # Calling ``is_spent`` here would be one more check and could spend the budget only now.
        if budget.stop[0]:
            assert solution.termination in (Termination.TIME_LIMIT, Termination.OPTIMAL), checks
