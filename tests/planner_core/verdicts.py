"""What holds of any plan and any bound, whatever mission they are of."""

from __future__ import annotations

import pytest

from planner_core.budget import Budget, Termination
from planner_core.certified.solver import Certified
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline


def encloses(problem: Problem, best: float) -> bool:
    """Check that `certified` encloses the best reward; return whether its plan has it."""
    solution = Certified().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert solution.bound is not None
    assert solution.bound >= best - 1e-6
    assert timeline.is_valid
    assert timeline.reward <= best + 1e-6
    if solution.termination == Termination.OPTIMAL:
        assert timeline.reward == pytest.approx(best, rel=1e-6)
    return timeline.reward >= best - 1e-6


def require_accepted(solver: str, timeline: Timeline) -> None:
    """Check that the referee accepts the plan of a solver."""
    if solver == "graph":  # which knows no limits
        assert all(v.code in ("battery", "recorder", "duplicate") for v in timeline.violations)
    else:
        assert timeline.is_valid
