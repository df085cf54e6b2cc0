"""A plan and a proof that close in on each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from planner_core.budget import Budget
from planner_core.certified.drivers.agility_only import Effort
from planner_core.certified.drivers.continuous import (
    among_opportunities,
    bounded,
    solve_continuous,
)
from planner_core.certified.drivers.fleet import solve_without_resources
from planner_core.certified.drivers.resources import solve_with_resources
from planner_core.problem import Problem
from planner_core.solvers.base import Constraint, Outlook, Solution
from planner_core.solvers.milp import Milp, is_free


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
            "description": "How long to improve the plan before the proof: moves for each "
            "opportunity.",
        },
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions it looks at."""
        return Outlook()

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the best plan and its bound; the same for the same seed if time suffices."""
        if problem.pointing is not None and not problem.use_resources:
            return solve_continuous(problem, budget, seed, self.gap, self.moves_per_task)
        if problem.use_resources or problem.turns_in_motion:
            if problem.pointing is not None:
                solution = solve_with_resources(
                    problem, among_opportunities(budget), seed, self.gap
                )
                return bounded(problem, solution, budget, seed, self.gap)
            return solve_with_resources(problem, budget, seed, self.gap)
        if not is_free(problem):
            return Milp(gap=self.gap).solve(problem, budget, seed)
        return solve_without_resources(
            problem, budget, seed, self.gap, Effort(moves_per_task=self.moves_per_task)
        )
