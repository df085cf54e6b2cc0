"""The whole mixed-integer program: all satellites at once, with antennas, battery and recorder.

It ends with a proof if time suffices.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.budget import Budget, Progress, ignored
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.downlinks import brought_down
from planner_core.certified.lns.search import improved
from planner_core.certified.mip.highs import Engine, Outcome
from planner_core.certified.mip.whole_relaxation import cut_by_cliques
from planner_core.certified.program.model import (
    Formulation,
    OnBoard,
    PlanProgram,
    binding_losses,
    plan_program,
)
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.sizes import MAX_PAIRS, PAUSE_S
from planner_core.certified.tolerances import INSIDE, TOUCHING
from planner_core.certified.tuning import TUNING
from planner_core.precedence.relation import num_near_pairs
from planner_core.problem import COLLECT, Floats, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution
from planner_core.solvers.forward_search import ForwardSearch
from planner_core.solvers.graph import Graph
from planner_core.solvers.rule import Rule


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeProgram:
    """HiGHS on the whole program.

    Attributes
    ----------
    formulation, cut_rounds, moves_per_task
        As ``planner_core.solvers.milp`` says.
    begins_smaller
        Whether, if images lose worth on board and tasks are many, a program that charges for all
        data left on board finds a plan first, in half of the time. It has no columns for images
        that come down: the demonstration's mission has its best plan after 2 s instead of 20. The
        paper's missions have the same plans after 10 s, under bounds that are up to 0.5 % higher.
    """

    formulation: Formulation = "antichain"
    cut_rounds: int = 200
    moves_per_task: float = 30.0
    begins_smaller: bool = False

    def solve(self, problem: Problem, budget: Budget, seed: int, gap: float) -> Solution:
        """Return the best plan; the same one for the same seed if the budget suffices."""
        best = Incumbent(problem, budget, gap, bound=Bound(value=np.inf, proof="milp"))
        for plan in _starts(problem, budget):
            best.offer(brought_down(problem, plan, budget))
        if not problem.use_resources and not problem.turns_in_motion:
            best.offer(improved(problem, best.plan, self.moves_per_task, budget, seed))
        if len(problem.opportunities) == 0 or budget.is_spent():
            return best.solution()
        if num_near_pairs(problem) > MAX_PAIRS:
            budget.report(
                Progress(
                    phase="solve",
                    fraction=1.0,
                    reward=best.reward,
                    message="The program is too large for HiGHS: returning the plan it would "
                    "start from.",
                )
            )
            return best.solution()
        is_large = len(problem.opportunities) > TUNING.open_tasks
        if self.begins_smaller and is_large and binding_losses(problem).any():
            part = budget.part(2.0 * TUNING.beginning)
            smaller = self._search(problem, part, seed, best, INSIDE, "at a cost")
            best.offer(_repaired(problem, _plan_of(problem, smaller)))
        # The limits are strict, which no linear program can express. The first search lets plans
        # touch them, so that its bound holds; if its plan is not valid, a second one stays inside.
        outcome = self._search(problem, budget, seed, best, TOUCHING)
        if outcome.is_infeasible:
            return best.solution()
        plan = _plan_of(problem, outcome)
        for offered in (plan, _repaired(problem, plan)):
            best.offer(offered)
        if not replay(problem, plan, in_detail=False).is_valid and not budget.is_spent():
            clear = self._search(problem, budget, seed, best, INSIDE)
            best.offer(_plan_of(problem, clear))
        if best.is_valid:
            best.lower(Bound(value=outcome.bound, proof="milp", log=outcome.log))
        return best.solution()

    def _search(
        self,
        problem: Problem,
        budget: Budget,
        seed: int,
        best: Incumbent,
        margin: float,
        on_board: OnBoard = "worth less",
    ) -> Outcome:
        model = plan_program(problem, self.formulation, margin, on_board=on_board)
        if problem.use_resources:
            model.program.tell_apart()
        engine = Engine(model.program, budget, seed, is_chained=problem.use_resources)
        report = _Reporter(budget)

        def watch(reward: float, bound: float) -> None:
            report(max(reward, best.reward), bound)

        if self.formulation == "antichain":
            cut_by_cliques(engine, model, self.cut_rounds, watch)
        return engine.search(_columns(best, model), best.gap, None, watch, unit=best.unit)


def exhaust(search: Search) -> Iterator[None]:
    """Leave the rest to the whole program.

    Of 240 small missions drawn for the tests, all were closed with it, and 222 without.
    """
    _ask(search, 1.0)
    yield


def images_by_contact(search: Search) -> Iterator[None]:
    """Solve the whole program first, for a part of the time.

    Four satellites over 80 targets with a half-life of one hour earn 59.16 and 64.71 after ten CPU
    seconds, and 59.02 and 62.63 without; bounds fall from 59.44 and 64.92 to 59.31 and 64.84.
    """
    _ask(search, TUNING.beginning)
    yield


def _ask(search: Search, share: float) -> None:
    """Seek a plan and a bound by the whole program, for a share of the time that is left."""
    best = search.best
    best.report("HiGHS")
    quiet = search.budget.part(share, report=ignored)
    solution = WholeProgram().solve(search.problem, quiet, search.seed, best.gap)
    best.offer(solution.plan)
    if solution.proven is not None:
        best.lower(solution.proven)
    best.report("HiGHS")


def _starts(problem: Problem, budget: Budget) -> list[Plan]:
    """Return the plans of the quick solvers; that of the quickest whatever the budget."""
    if budget.is_cancelled:
        return []
    plans = [Rule().solve(problem, Budget(), 0).plan]
    for solver in (Graph(), ForwardSearch(depth=3, breadth=3)):
        if not budget.is_spent():
            plans.append(solver.solve(problem, budget, 0).plan)
    return plans


def _plan_of(problem: Problem, outcome: Outcome) -> Plan:
    if outcome.columns is None:
        return Plan()
    taken = outcome.columns[: len(problem.opportunities)]
    return Plan.of(problem, np.flatnonzero(taken > 0.5))


def _columns(best: Incumbent, model: PlanProgram) -> Floats | None:
    """Return the plan as values of the integer columns, or None if it is not valid."""
    if not best.is_valid:
        return None
    down = model.down[_brought_down(best)]
    columns = np.zeros(len(model.taken) + np.count_nonzero(model.down >= 0))
    columns[model.taken[[action.opportunity for action in best.plan.actions]]] = 1.0
    columns[down[down >= 0]] = 1.0
    return columns


def _brought_down(best: Incumbent) -> list[int]:
    """Return the opportunities of the plan whose images are downlinked."""
    images = best.judge(best.plan).collected.values()
    return [best.plan.actions[i.position].opportunity for i in images if i.is_downlinked]


def _repaired(problem: Problem, plan: Plan) -> Plan:
    """Return the plan without the collects that bring it to a limit, the latest ones first."""
    table = problem.opportunities
    while True:
        timeline = replay(problem, plan, in_detail=False)
        broken = [v for v in timeline.violations if v.code in ("battery", "recorder")]
        if not broken:
            return plan
        first = broken[0]
        before = [
            action
            for action in plan.actions
            if table.satellite[action.opportunity] == first.satellite
            and table.kind[action.opportunity] == COLLECT
            and action.start_s <= first.at_s
            and action.opportunity not in problem.kept_rows
        ]
        if not before:
            return plan
        plan = Plan(tuple(action for action in plan.actions if action is not before[-1]))


class _Reporter:
    """Reports the progress of HiGHS, a few times a second."""

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._limit_s = budget.remaining_s()
        self._last_s = 0.0

    def __call__(self, reward: float, bound: float) -> None:
        """Report the best objective so far and the bound, unless the last report is too recent."""
        now_s = time.monotonic()
        if now_s - self._last_s < PAUSE_S:
            return
        self._last_s = now_s
        is_known = np.isfinite(reward)
        is_bounded = np.isfinite(bound)
        self._budget.report(
            Progress(
                phase="solve",
                fraction=self._fraction(reward, bound) if is_known and is_bounded else 0.0,
                reward=reward if is_known else None,
                bound=bound if is_bounded else None,
                message="HiGHS searches",
            )
        )

    def _fraction(self, reward: float, bound: float) -> float:
        """Return the share of the time that is over; without a limit, of the bound reached."""
        if self._limit_s:
            return 1.0 - (self._budget.remaining_s() or 0.0) / self._limit_s
        return min(1.0, max(0.0, reward / bound)) if bound > 0.0 else 1.0
