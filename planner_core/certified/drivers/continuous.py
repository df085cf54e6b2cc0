"""Plans with continuous starts and their bound, until they meet or the effort is spent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.lns.continuous_search import ContinuousSearch
from planner_core.certified.lns.insertion_with_resources import filled_with_resources
from planner_core.certified.proofs.bound import Bound, reward_unit, rounded_bound
from planner_core.certified.proofs.continuous import quick_bound, search_prices
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution
from planner_core.solvers.rule import Rule

_TOLERANCE: Final = 1e-6  # of the reward
_MOVES_A_ROUND: Final = 1000  # on each satellite
_SHARE: Final = 0.6  # of the time for fixed starts first, where resources count
_BEFORE: Final = 0.25  # of the moves come before the bound


@dataclass(kw_only=True, eq=False)
class _Meeting:
    """A plan and a bound that close in on each other."""

    problem: Problem
    budget: Budget
    gap: float
    plan: Plan
    reward: float
    bound: Bound

    @property
    def is_optimal(self) -> bool:
        unit = reward_unit(self.problem)
        return self.bound.value < self.reward + max(unit, _TOLERANCE * self.reward, 4e-9)

    @property
    def is_close(self) -> bool:
        missing = self.bound.value - self.reward
        return self.is_optimal or missing <= self.gap * self.bound.value

    @property
    def is_done(self) -> bool:
        return self.is_close or self.budget.is_spent()

    def offer(self, plan: Plan, message: str) -> None:
        """Take a plan if it is better."""
        timeline = replay(self.problem, plan)
        if timeline.is_valid and timeline.reward > self.reward:
            self.plan, self.reward = plan, timeline.reward
        self.report(message)

    def move(self, search: ContinuousSearch, num_rounds: int) -> None:
        """Search for plans."""
        for _ in range(num_rounds):
            if self.is_done:
                return
            search.move(_MOVES_A_ROUND)
            self.offer(search.plan, "window search")

    def price(self) -> None:
        """Search for prices that prove a bound."""
        if self.is_close or self.budget.is_spent():
            return
        for value, prices in search_prices(self.problem, self.budget.stop):
            rounded = rounded_bound(self.problem, value, self.reward)
            if rounded < self.bound.value:
                self.bound = Bound(value=rounded, proof="lagrangian", prices=prices)
            self.report("prices")
            if self.is_done:
                return

    def report(self, message: str) -> None:
        reward, bound = self.reward, self.bound.value
        share = reward / bound if bound > 0.0 else 1.0
        self.budget.report(
            Progress(phase="solve", fraction=min(1.0, share), reward=reward, bound=bound,
                     message=message)
        )  # fmt: skip

    def solution(self) -> Solution:
        termination = self.budget.ending(is_optimal=self.is_optimal, is_close=self.is_close)
        return Solution(plan=self.plan, termination=termination, proven=self.bound)


def solve_continuous(
    problem: Problem, budget: Budget, seed: int, gap: float, moves_per_task: float
) -> Solution:
    """Return the best plan found of a problem without resources, and what bounds it.

    Parameters
    ----------
    moves_per_task
        Moves of the window search for each access.
    """
    meeting = _meeting(problem, Rule().solve(problem, Budget(), seed).plan, budget, gap)
    search = ContinuousSearch(problem, meeting.plan, budget, seed)
    search.fill()
    meeting.offer(search.plan, "insertion")
    num_tasks = max((len(s.spans.row) for s in search.satellites), default=0)
    num_rounds = int(np.ceil(moves_per_task * num_tasks / _MOVES_A_ROUND))
    first = int(np.ceil(_BEFORE * num_rounds))
    meeting.move(search, first)
    meeting.price()
    meeting.move(search, num_rounds - first)
    return meeting.solution()


def part_of(budget: Budget) -> Budget:
    """Return a budget for the search among the starts that opportunities have.

    What bounds that search bounds no plan with free starts: it is not reported.
    """
    remaining_s = budget.remaining_s()
    part = Budget(
        None if remaining_s is None else _SHARE * remaining_s,
        lambda progress: budget.report(replace(progress, bound=None)),
    )
    part.stop = budget.stop
    return part


def bounded(problem: Problem, solution: Solution, budget: Budget, gap: float) -> Solution:
    """Return a plan with resources after insertion, and what bounds it."""
    meeting = _meeting(problem, solution.plan, budget, gap)
    meeting.offer(filled_with_resources(problem, solution.plan, budget), "insertion")
    meeting.price()
    return meeting.solution()


def _meeting(problem: Problem, plan: Plan, budget: Budget, gap: float) -> _Meeting:
    timeline = replay(problem, plan)
    return _Meeting(
        problem=problem,
        budget=budget,
        gap=gap,
        plan=plan,
        reward=timeline.reward,
        bound=quick_bound(problem),
    )


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
