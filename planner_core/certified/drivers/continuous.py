"""Plans with continuous starts and their bound, until they meet or the effort is spent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.budget import Budget, Termination
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.continuous_search import ContinuousSearch
from planner_core.certified.lns.insertion_with_resources import (
    filled_with_resources,
    replanned_window,
)
from planner_core.certified.multipliers.chains import ascend_on_chains
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.continuous import quick_bound
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Solution
from planner_core.solvers.rule import Rule


def solve_continuous(
    problem: Problem, budget: Budget, seed: int, gap: float, moves_per_task: float
) -> Solution:
    """Return the best plan found of a problem without resources, and what bounds it.

    Parameters
    ----------
    moves_per_task
        Moves of the window search for each access.
    """
    best = _incumbent(problem, Rule().solve(problem, Budget(), seed).plan, budget, gap)
    search = ContinuousSearch(problem, best.plan, budget, seed)
    search.fill()
    best.offer(search.plan)
    best.report("insertion")
    num_tasks = max((len(s.spans.row) for s in search.satellites), default=0)
    num_rounds = int(np.ceil(moves_per_task * num_tasks / TUNING.moves_at_a_time))
    first = int(np.ceil(TUNING.beginning * num_rounds))
    _move(best, search, first)
    _price(best)
    _move(best, search, num_rounds - first)
    return best.solution()


def _move(best: Incumbent, search: ContinuousSearch, num_rounds: int) -> None:
    """Search for plans."""
    for _ in range(num_rounds):
        if best.is_done:
            return
        search.move(TUNING.moves_at_a_time)
        best.offer(search.plan)
        best.report("window search")


def _price(best: Incumbent) -> None:
    """Search for multipliers that prove a bound."""
    if best.is_close or best.budget.is_spent():
        return
    for value, prices in ascend_on_chains(best.problem, best.budget.stop):
        best.lower(Bound(value=value, proof="lagrangian", prices=prices))
        best.report("prices")
        if best.is_done:
            return


def among_opportunities(budget: Budget) -> Budget:
    """Return a budget for the search among the starts that opportunities have.

    What bounds that search bounds no plan with free starts: it is not reported.
    """
    return budget.part(
        TUNING.first_share, lambda progress: budget.report(replace(progress, bound=None))
    )


def bounded(
    problem: Problem, solution: Solution, budget: Budget, seed: int, gap: float
) -> Solution:
    """Return a plan with resources after insertion, and what bounds it."""
    best = _incumbent(problem, solution.plan, budget, gap)
    best.offer(filled_with_resources(problem, solution.plan, budget))
    best.report("insertion")
    _price(best)
    _replan_windows(best, seed)
    return best.solution()


def _replan_windows(best: Incumbent, seed: int) -> None:
    """Drop a few images and put in others, again and again, until that gets nowhere."""
    rng = np.random.default_rng(seed)
    plan, num_idle = best.plan, 0
    while num_idle < TUNING.fleet_patience and plan.actions and not best.is_done:
        new = replanned_window(best.problem, plan, best.budget, rng)
        if best.judge(new).reward >= best.judge(plan).reward:
            plan = new
        is_better = best.offer(plan)
        num_idle = 0 if is_better else num_idle + 1
        best.report("window search")


def _incumbent(problem: Problem, plan: Plan, budget: Budget, gap: float) -> Incumbent:
    return Incumbent(problem, budget, gap, plan, quick_bound(problem), covers_starts=True)


def with_own_starts(problem: Problem, solution: Solution, budget: Budget) -> Solution:
    """Return another solver's answer with what fits between its tasks once those may move.

    "Optimal" meant the starts that opportunities have.
    """
    if solution.termination is Termination.OPTIMAL and solution.proven is None:
        solution = replace(solution, termination=Termination.HORIZON_COMPLETE)
    if problem.pointing is None or solution.proven is not None or budget.is_cancelled:
        # What has a bound here was searched with free starts already.
        return solution
    if problem.use_resources:
        plan = filled_with_resources(problem, solution.plan, Budget())
        return replace(solution, plan=plan)
    search = ContinuousSearch(problem, solution.plan, Budget(), 0)
    search.fill()
    return replace(solution, plan=search.plan)
