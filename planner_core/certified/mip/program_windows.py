"""Windows of a plan replanned, contacts and images together, by small mixed-integer programs.

Searches that move images leave contacts where they are, and those that move contacts first settle
what images earn. If images age, each depends on the other. HiGHS decides both together in a window
of some hundred opportunities of all satellites, with the rest of the plan unchanged.
"""

from __future__ import annotations

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine
from planner_core.certified.program.model import plan_program
from planner_core.certified.tolerances import INSIDE
from planner_core.certified.tuning import TUNING
from planner_core.problem import Bools, Problem
from planner_core.problem.plan import Plan


class ProgramWindows:
    """Replans random windows of a plan."""

    def __init__(self, problem: Problem, budget: Budget, seed: int) -> None:
        self._problem, self._budget, self._seed = problem, budget, seed
        self._rng = np.random.default_rng(seed)
        self._by_start = np.argsort(problem.opportunities.start_s, kind="stable")

    def move(self, plan: Plan, num_tasks: int) -> Plan:
        """Return the plan with a window of ``num_tasks`` opportunities replanned."""
        problem, open_ = self._problem, self._window(num_tasks)
        own = np.zeros_like(open_)
        own[[action.opportunity for action in plan.actions]] = True
        rows = np.flatnonzero(own | open_).astype(np.int32)
        model = plan_program(problem, "antichain", INSIDE, rows)
        engine = Engine(model.program, self._budget, self._seed, is_chained=True)
        held = model.taken[(own & ~open_)[rows]]
        engine.hold(held, np.ones(len(held)))
        outcome = engine.search(
            None, TUNING.little**2, None, lambda _reward, _bound: None, TUNING.highs_nodes
        )
        self._seed += 1
        if outcome.columns is None:
            return plan
        return Plan.of(problem, rows[outcome.columns[: len(rows)] > 0.5])

    def _window(self, num_tasks: int) -> Bools:
        """Return which opportunities lie within a window. Shape ``(n,)``."""
        table, order = self._problem.opportunities, self._by_start
        first = int(self._rng.integers(-num_tasks // 2, len(order) - num_tasks // 2))
        last = min(first + num_tasks, len(order)) - 1
        from_s, until_s = table.start_s[order[max(first, 0)]], table.end_s[order[last]]
        within: Bools = (table.start_s >= from_s) & (table.end_s <= until_s)
        return within
