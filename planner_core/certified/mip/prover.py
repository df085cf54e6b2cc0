"""HiGHS on the tasks that the multipliers leave open: a plan worth an amount, or proof of none."""

from __future__ import annotations

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine, Watch
from planner_core.certified.program.linear_program import Program
from planner_core.problem import Problem
from planner_core.problem.plan import Plan


class Prover(Engine):
    """The program of the plans worth at least ``amount``; one worth ``enough`` ends the search.

    ``program`` counts worth in units of the greatest of ``problem``; its first columns are x.
    """

    def __init__(
        self,
        problem: Problem,
        program: Program,
        amount: float,
        enough: float,
        budget: Budget,
        seed: int,
    ) -> None:
        self._problem = problem
        self._scale = float(problem.worth.max(initial=1e-300))
        super().__init__(program, budget, seed, is_chained=False)
        highs = self._highs
        for option, limit in (("objective_bound", amount), ("objective_target", enough)):
            highs.setOptionValue(option, (limit - 1e-6 * max(1.0, limit)) / self._scale)

    def prove(
        self, heuristic_effort: float, watch: Watch, max_nodes: int | None = None
    ) -> tuple[Plan | None, float]:
        """Return a plan worth the amount, if there is one, and what no plan exceeds.

        The bound is infinite if the budget did not suffice for one.
        """
        outcome = self.search(None, 0.0, heuristic_effort, watch, max_nodes)
        plan = None
        if outcome.columns is not None:
            taken = outcome.columns[: len(self._problem.opportunities)]
            plan = Plan.of(self._problem, np.flatnonzero(taken > 0.5))
        bound = -np.inf if outcome.is_infeasible else outcome.bound * self._scale
        return plan, bound
