"""The certified solver: a plan and a proven bound that close in on each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from planner_core.budget import Budget
from planner_core.certified.driver import Effort
from planner_core.certified.strategies.every import solved
from planner_core.problem import Problem
from planner_core.solvers.base import Constraint, Outlook, Solution


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """Find a plan and prove how good it is, until that is good enough."""

    name: ClassVar[str] = "certified"
    title: ClassVar[str] = "Certified planning"
    about: ClassVar[str] = (
        "Finds a plan and proves how far it can be from the best one. The one to choose for "
        "operations."
    )
    paper: ClassVar[str] = "Not in the paper"
    exact: ClassVar[bool] = True
    bounds: ClassVar[bool] = True
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    gap: float = field(
        default=0.0,
        metadata={
            "minimum": 0,
            "maximum": 1,
            "description": "Stop when the plan is within this share of the bound.",
        },
    )
    moves_per_task: float = field(
        default=30.0,
        metadata={
            "minimum": 0,
            "maximum": 100_000,
            "description": "Most moves to improve the plan, per opportunity.",
        },
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions the solver considers."""
        return Outlook()

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the best plan and its bound; the same for the same seed, if time suffices."""
        effort = Effort(moves_per_task=self.moves_per_task)
        return solved(problem, budget, seed, self.gap, effort)
