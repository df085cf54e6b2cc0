"""Budgets: how much time each part of the work may spend."""

from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from planner_core import run
from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.solver import Certified
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.certified.strategies.resources import tasks_alone
from planner_core.certified.strategies.whole_program import WholeProgram
from planner_core.domain import Objective, Quality
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.run import plan_scenario
from planner_core.solvers.base import Solution
from planner_core.solvers.rule import Rule
from tests.patience import wait_until
from tests.planner_core.flat_earth import flat_problem
from tests.planner_core.problems import random_problem
from tests.planner_core.test_worth import scenario


def test_a_part_works_on_as_many_threads_and_stops_with_the_whole() -> None:
    whole = Budget(num_threads=3)
    part = whole.part()
    assert part.num_threads == 3
    assert part.remaining_s() is None
    assert not part.is_spent()
    whole.cancel()
    assert part.is_spent()
    assert part.is_cancelled
    assert part.stop[0] == 1
    assert part.termination() is Termination.CANCELLED


def test_who_cancels_a_part_cancels_the_whole() -> None:
    whole = Budget()
    whole.part().cancel()
    assert whole.is_cancelled
    assert whole.is_spent()


def test_a_part_has_its_share_of_the_time_and_no_more_than_the_whole() -> None:
    whole = Budget(1000.0)
    part = whole.part(0.25)
    assert part.remaining_s() == pytest.approx(250.0, abs=1.0)
    assert part.part(0.5).remaining_s() == pytest.approx(125.0, abs=1.0)
    none = whole.part(0.0)
    assert none.is_spent()
    assert not whole.is_spent()
    assert none.termination() is Termination.TIME_LIMIT
    whole.expire()
    assert part.remaining_s() == 0.0
    assert part.is_spent()


def test_what_is_needed_as_a_whole_ends_when_somebody_cancels_and_not_with_the_time() -> None:
    told: list[Progress] = []
    budget = Budget(0.0, told.append, num_threads=3)
    needed = budget.part().until_cancelled()
    assert needed.num_threads == 3
    assert needed.remaining_s() is None
    needed.report(Progress(phase="access", fraction=0.0))
    assert len(told) == 1
    budget.expire()
    assert budget.is_spent()
    assert not needed.is_spent()
    assert needed.stop[0] == 0
    budget.cancel()
    assert needed.is_spent()
    assert needed.is_cancelled
    assert needed.stop[0] == 1


def test_who_cancels_what_is_needed_as_a_whole_cancels_all() -> None:
    budget = Budget()
    budget.until_cancelled().cancel()
    assert budget.is_cancelled
    assert budget.stop[0] == 1


def test_a_part_reports_what_it_is_told_to() -> None:
    seen: list[Progress] = []
    whole = Budget(report=seen.append)
    whole.part(report=lambda _: None).report(Progress(phase="solve", fraction=0.1))
    assert seen == []
    whole.part().report(Progress(phase="solve", fraction=0.2))
    assert [p.fraction for p in seen] == [0.2]


def test_fleets_with_continuous_starts_and_resources_work_on_all_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = flat_problem(2, num_targets=10, num_contacts=2, use_resources=True, spacing_s=60.0)
    given: list[int] = []
    beside = Search.beside

    def watched(search: Search, best: Incumbent, seed: int) -> Search:
        given.append(best.budget.num_threads)
        return beside(search, best, seed)

    monkeypatch.setattr(Search, "beside", watched)
    Certified().solve(problem, Budget(num_threads=2), 0)
    assert given == [2]


def test_agility_alone_leaves_most_of_the_time_to_plans_with_resources(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = random_problem(3, num_collects=40, num_targets=20, num_contacts=4)
    left_s: list[float | None] = []
    solved = Search.solved

    def watched(search: Search) -> Solution:
        left_s.append(search.budget.remaining_s())
        return solved(search)

    monkeypatch.setattr(Search, "solved", watched)
    tasks_alone(Search(Incumbent(problem, Budget(10_000.0), 0.0), 0, STRATEGIES))
    (alone_s,) = left_s
    assert alone_s is not None
    assert 0.0 < alone_s < 3_000.0


def test_a_job_that_is_cancelled_in_its_last_part_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(3, num_collects=40, num_targets=20, num_contacts=4)
    ended: list[Termination] = []
    solve = WholeProgram.solve

    def cancelled(
        self: WholeProgram, problem: Problem, budget: Budget, seed: int, gap: float
    ) -> Solution:
        budget.cancel()
        solution = solve(self, problem, budget, seed, gap)
        ended.append(solution.termination)
        return solution

    monkeypatch.setattr(WholeProgram, "solve", cancelled)
    monkeypatch.setattr(Incumbent, "is_within", lambda *_: False)
    budget = Budget()
    solution = Certified().solve(problem, budget, 0)
    assert budget.is_cancelled
    assert ended == [Termination.CANCELLED]
    assert solution.termination is Termination.CANCELLED


def test_an_enforced_budget_stops_kernels_once_its_time_is_over() -> None:
    budget = Budget(0.0)
    assert budget.stop[0] == 0
    with budget.enforced():
        wait_until(lambda: budget.stop[0] == 1)
    assert budget.termination() is Termination.TIME_LIMIT


@pytest.mark.parametrize("time_s", [None, 3600.0])
def test_an_enforced_budget_whose_time_is_not_over_goes_on(time_s: float | None) -> None:
    budget = Budget(time_s)
    with budget.enforced():
        watching = [one for one in threading.enumerate() if one.name == "budget"]
        assert len(watching) == (time_s is not None)
    assert not any(one.is_alive() for one in watching)
    assert not budget.is_spent()


def test_a_plan_is_ready_when_its_time_is_over_whatever_kernel_runs() -> None:
    """Kernels read no clock, so something else must stop them."""

    class Deaf(Rule):
        def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
            wait_until(lambda: budget.stop[0] == 1)
            return Solution(plan=Plan(), termination=budget.termination())

    judged = plan_scenario(scenario(Quality()), Deaf(), 0, Budget(0.1))
    assert judged.solution.termination is Termination.TIME_LIMIT


def test_a_quick_bound_is_asked_for_where_the_solver_has_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = list[str]()

    def quick(problem: Problem, reward: float) -> Bound:
        asked.append(solver.name)
        return quick_bound(problem, reward)

    monkeypatch.setattr(run, "quick_bound", quick)
    asks = replace(scenario(Quality()), use_resources=True)
    for solver in (Rule(), Certified()):
        judged = plan_scenario(asks, solver, 0, Budget(0.0))
        assert judged.bound is not None
    assert asked == ["rule"]


@pytest.mark.parametrize(
    ("bounds", "objective", "share"),
    [
        (False, Objective(collected_share=0.5), 0.8),
        (True, Objective(collected_share=0.5), 1.0),
        (False, Objective.collected(), 1.0),
        (True, Objective(collected_share=0.5, prefer=("early",)), 0.8),
    ],
)
def test_a_solver_leaves_time_for_what_follows_it(
    bounds: bool, objective: Objective, share: float
) -> None:
    """For preferences, and for contacts if the solver computes no bounds."""
    left_s = list[float]()

    class Watched(Rule):
        def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
            left_s.append(budget.remaining_s() or 0.0)
            return super().solve(problem, budget, seed)

    Watched.bounds = bounds
    asks = replace(scenario(Quality()), use_resources=True, objective=objective)
    plan_scenario(asks, Watched(), 0, Budget(100_000.0))
    assert left_s == [pytest.approx(100_000.0 * share, rel=0.05)]
