"""Mixed-integer linear programming (section of that name): the optimum, and its proof.

The paper's program, over all satellites at once, with station antennas, and with battery
and recorder (its stated future work). Exact for the plan model.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

from planner_core.budget import Budget
from planner_core.certified.driver import Effort
from planner_core.certified.program.model import Formulation
from planner_core.certified.strategies.every import solved
from planner_core.certified.strategies.supports import is_agility_only
from planner_core.certified.strategies.whole_program import WholeProgram
from planner_core.problem import Problem
from planner_core.solvers.base import Constraint, Outlook, Solution


@dataclass(frozen=True, slots=True, kw_only=True)
class Milp:
    """Let HiGHS find the best plan of all satellites together, and prove it."""

    name: ClassVar[str] = "milp"
    title: ClassVar[str] = "Mixed-integer linear programming"
    about: ClassVar[str] = (
        "Passes the whole problem to a mathematical solver, and proves the plan optimal if there "
        "is time. For small missions."
    )
    paper: ClassVar[str] = "Section Mixed-Integer Linear Programming"
    exact: ClassVar[bool] = True
    bounds: ClassVar[bool] = False
    honours: ClassVar[frozenset[Constraint]] = frozenset(Constraint) - {Constraint.DUPLICATE}

    formulation: Formulation = field(
        default="antichain",
        metadata={
            "description": "antichain: one row for each set of tasks that exclude each other, "
            "and cutting planes; without resources HiGHS then only closes the remaining gap. "
            "pairwise: the paper's, one row for each pair of such tasks."
        },
    )
    gap: float = field(
        default=0.0,
        metadata={
            "minimum": 0,
            "maximum": 1,
            "description": "Stop when the bound is within this share of the reward.",
        },
    )
    cut_rounds: int = field(
        default=200,
        metadata={
            "minimum": 0,
            "maximum": 1000,
            "description": "Most rounds of cutting planes before the search (antichain only).",
        },
    )

    moves_per_task: float = field(
        default=30.0,
        metadata={
            "minimum": 0,
            "maximum": 100_000,
            "description": "Moves of a local search for each opportunity, so that the proof "
            "starts from a good plan (without resources only).",
        },
    )

    @property
    def outlook(self) -> Outlook:
        """Which actions it considers."""
        return Outlook()

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the best plan; the same one for the same seed if the budget suffices."""
        fixed = replace(problem, pointing=None)
        if self.formulation == "antichain" and is_agility_only(fixed):
            effort = Effort(moves_per_task=self.moves_per_task, max_rounds=self.cut_rounds)
            return solved(fixed, budget, seed, self.gap, effort)
        program = WholeProgram(
            formulation=self.formulation,
            cut_rounds=self.cut_rounds,
            moves_per_task=self.moves_per_task,
            begins_smaller=True,
        )
        return program.solve(problem, budget, seed, self.gap)
