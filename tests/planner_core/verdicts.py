"""What holds of any plan and any bound, whatever mission they are of."""

from __future__ import annotations

from typing import Final

import pytest

from planner_core.budget import Budget, Termination
from planner_core.certified.solver import Certified
from planner_core.certified.tuning import tuned
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.solvers.base import Solution

HASTY: Final = {
    "tries": 1, "several": 2, "patience": 1, "rounds": 4, "epochs": 20, "many_epochs": 10,
}  # fmt: skip
"""Constants by which searches give up early: a small problem takes a third of the time.

What is proven must hold whatever they are.
"""


def certified(problem: Problem, *, is_hasty: bool) -> Solution:
    """Plan by `certified`, with its own constants or with hasty ones."""
    with tuned(**(HASTY if is_hasty else {})):
        return Certified().solve(problem, Budget(), 0)


def encloses(problem: Problem, best: float, *, is_hasty: bool = False) -> bool:
    """Check that `certified` encloses the best reward; return whether its plan has it."""
    solution = certified(problem, is_hasty=is_hasty)
    timeline = replay(problem, solution.plan)
    assert solution.bound is not None
    assert solution.bound >= best - 1e-6
    assert timeline.is_valid
    assert timeline.reward <= best + 1e-6
    if solution.termination == Termination.OPTIMAL:
        assert timeline.reward == pytest.approx(best, rel=1e-6, abs=1e-9)
    return timeline.reward >= best - 1e-6


def require_accepted(solver: str, timeline: Timeline) -> None:
    """Check that the referee accepts the plan of a solver."""
    if solver == "graph":  # which knows no limits
        assert all(v.code in ("battery", "recorder", "duplicate") for v in timeline.violations)
    else:
        assert timeline.is_valid
