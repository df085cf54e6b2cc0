"""A plan and a proof that close in on each other."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

from planner_core.plan import Plan
from planner_core.problem import Problem
from planner_core.resource_bound import quick_bound
from planner_core.solvers.base import Budget, Constraint, Progress, Solution, Termination
from planner_core.solvers.certified.free import solve_free
from planner_core.solvers.forward_search import ForwardSearch
from planner_core.solvers.graph import Graph
from planner_core.solvers.rule import Rule
from planner_core.timeline import replay


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """Find a plan and prove how good it is, until that is good enough."""

    name: ClassVar[str] = "certified"
    title: ClassVar[str] = "Certified planning"
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
            "description": "Moves of the window search for each opportunity before the proof.",
        },
    )

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the best plan and its bound; the same for the same seed if time suffices."""
        if problem.use_resources:
            return _best_of_the_quick(problem, budget, seed)
        return solve_free(problem, budget, seed, self.gap, self.moves_per_task)


def _best_of_the_quick(problem: Problem, budget: Budget, seed: int) -> Solution:
    """Return the best plan of the quick solvers, and the quick bound."""
    best, reward = Solution(plan=Plan(), termination=Termination.HORIZON_COMPLETE), 0.0
    for solver in (Rule(), Graph(), ForwardSearch()):
        solution = solver.solve(problem, budget, seed)
        timeline = replay(problem, solution.plan)
        if timeline.is_valid and timeline.reward > reward:
            best, reward = solution, timeline.reward
        budget.report(Progress(phase="solve", fraction=0.5, reward=reward, message=solver.name))
    if budget.is_spent():
        return replace(best, termination=budget.termination())
    bound = quick_bound(problem, reward)
    return replace(
        best,
        termination=Termination.OPTIMAL if bound.value <= reward else Termination.HORIZON_COMPLETE,
        bound=bound.value,
        bound_proof=bound.proof,
    )
