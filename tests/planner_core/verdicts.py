"""Checks that hold for any plan and bound of any mission."""

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
"""Constants that make searches give up early: a small problem takes a third of the time.

Proofs must hold with any constants.
"""


def certified(problem: Problem, draw: int = 0) -> Solution:
    """Plan by `certified`: with its own constants in every eighth draw, else with hasty ones."""
    with tuned(**(HASTY if draw % 8 else {})):
        return Certified().solve(problem, Budget(), 0)


def encloses(problem: Problem, best: float, draw: int = 0) -> bool:
    """Check that `certified` encloses the best reward; return whether its plan has it.

    Parameters
    ----------
    draw
        The number of the problem, which selects the constants of the search.
    """
    solution = certified(problem, draw)
    timeline = replay(problem, solution.plan, in_detail=False)
    assert solution.bound is not None
    assert solution.bound >= best - 1e-6
    assert timeline.is_valid
    assert timeline.reward <= best + 1e-6
    if solution.termination == Termination.OPTIMAL:
        # Below ``LEAST_BOUND`` the solver calls any plan the best.
        assert timeline.reward == pytest.approx(best, rel=1e-6, abs=1e-9)
    return timeline.reward >= best - 1e-6


def require_accepted(solver: str, timeline: Timeline) -> None:
    """Check that the referee accepts the plan of a solver."""
    if solver == "graph":  # which ignores limits
        assert all(v.code in ("battery", "recorder", "duplicate") for v in timeline.violations)
    else:
        assert timeline.is_valid
