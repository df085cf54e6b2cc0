"""Plans with continuous starts and their bound, until they meet or the effort is spent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner_core.budget import Budget, Termination
from planner_core.certified.driver import Search, slices_beyond_the_first_plan
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.continuous_search import ContinuousSearch
from planner_core.certified.lns.insertion_with_resources import (
    filled_with_resources,
    replanned_window,
)
from planner_core.certified.lns.sampled_starts import with_own_rows, with_sampled_starts
from planner_core.certified.multipliers.chains import ascend_on_chains
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.problem.retimed import Retimed
from planner_core.solvers.base import Solution


def insertion(search: Search) -> Iterator[None]:
    """Insert tasks that fit into the gaps of the plan."""
    engine = search.engine(FreeStarts)
    engine.search.fill()
    engine.offer("insertion")
    yield


def windows(search: Search) -> Iterator[None]:
    """Search windows of the plan."""
    engine = search.engine(FreeStarts)
    num_tasks = max((len(s.spans.row) for s in engine.search.satellites), default=0)
    left = int(np.ceil(search.effort.moves_per_task * num_tasks / TUNING.moves_at_a_time))
    while left > 0:
        # The driver compares gains by slice, and a slice of the multipliers takes seconds.
        for _ in range(min(left, TUNING.several)):
            engine.search.move(TUNING.moves_at_a_time)
            engine.offer("window search")
        left -= TUNING.several
        yield


class FreeStarts:
    """The search for plans with continuous starts, from the best plan at its beginning."""

    def __init__(self, best: Incumbent, seed: int) -> None:
        self._best = best
        self.search = ContinuousSearch(best.problem, best.plan, best.budget, seed)

    def offer(self, message: str) -> None:
        """Offer the search's plan."""
        self._best.offer(self.search.plan)
        self._best.report(message)


def chain_multipliers(search: Search) -> Iterator[None]:
    """Ascend on chains of tasks with continuous starts, in slices that each prove a bound."""
    best = search.best
    for proven in ascend_on_chains(search.problem, search.budget.stop):
        if proven is not None:
            best.lower(proven)
            best.report("multipliers")
        if proven is not None or best.is_done:
            yield


def fixed_starts(search: Search) -> Iterator[None]:
    """Plan among the opportunities' own starts, and insert tasks that fit in between."""
    problem = search.problem
    every = np.arange(len(problem.opportunities), dtype=np.int32)
    yield from _plans_among(search, Retimed(problem, every))


def sampled_starts(search: Search) -> Iterator[None]:
    """Plan among many starts in each access, and insert tasks that fit in between.

    Plans earn up to 9 % more than with the own starts alone (docs/bounds.md).
    """
    yield from _plans_among(search, with_sampled_starts(search.problem))


def _plans_among(search: Search, made: Retimed) -> Iterator[None]:
    """Plan the problem with fixed starts that was made from the one with continuous starts.

    The bound of that search does not hold for plans with continuous starts, so it is not reported.
    """
    budget, best = search.budget, search.best
    part = budget.part(1.0, lambda progress: budget.report(replace(progress, bound=None)))
    inner = Incumbent(replace(made.problem, pointing=None), part, best.gap)
    beside, known = search.beside(inner, search.seed), Plan()
    for _ in slices_beyond_the_first_plan(beside):
        if inner.plan != known:
            known = inner.plan
            _offer_filled(best, with_own_rows(best.problem, made, known))
        yield
    if inner.plan != known:
        _offer_filled(best, with_own_rows(best.problem, made, inner.plan))


def _offer_filled(best: Incumbent, plan: Plan) -> None:
    """Offer a plan, also with tasks that fit in between."""
    best.offer(plan)
    best.offer(filled_with_resources(best.problem, plan, best.budget))
    best.report("insertion")


def windows_with_resources(search: Search) -> Iterator[None]:
    """Drop a few images and insert others, repeatedly, until that improves nothing."""
    best, rng = search.best, np.random.default_rng(search.seed)
    plan, num_idle = best.plan, 0
    while num_idle < TUNING.fleet_patience and plan.actions:
        before = best.reward
        if best.judge(plan).reward < before:
            plan, num_idle = best.plan, 0
        for _ in range(TUNING.several):
            new = replanned_window(search.problem, plan, search.budget, rng)
            if best.judge(new).reward >= best.judge(plan).reward:
                plan = new
            best.offer(plan)
        num_idle = 0 if best.reward > before else num_idle + TUNING.several
        best.report("window search")
        yield


def with_own_starts(problem: Problem, solution: Solution, budget: Budget) -> Solution:
    """Return another solver's solution with tasks that fit in between if those of it may move.

    If it was "optimal", that was among the opportunities' own starts only.
    """
    if solution.termination is Termination.OPTIMAL and solution.proven is None:
        solution = replace(solution, termination=Termination.HORIZON_COMPLETE)
    if problem.pointing is None or solution.proven is not None or budget.is_cancelled:
        # A solution with a bound was searched with continuous starts already.
        return solution
    if problem.use_resources:
        plan = filled_with_resources(problem, solution.plan, Budget())
        return replace(solution, plan=plan)
    search = ContinuousSearch(problem, solution.plan, Budget(), 0)
    search.fill()
    return replace(solution, plan=search.plan)
