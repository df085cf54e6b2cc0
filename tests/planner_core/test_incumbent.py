"""One plan, one bound and one meaning of "optimal" for all searches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.highs import Engine, Outcome
from planner_core.certified.proofs.bound import Bound, is_optimal
from planner_core.certified.strategies.agility import AgilitySearch
from planner_core.certified.strategies.fleet import FleetSearch
from planner_core.certified.tolerances import SAME
from planner_core.problem import COLLECT, Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import Certified, Milp
from tests.planner_core.problems import Task, make_problem, random_problem

BEYOND = 5.0 * SAME  # a relative gap, smaller than one that was once ignored


def problem_with_rewards(*, use_resources: bool) -> Problem:
    """Return a problem with fractional rewards and a pin that HiGHS has to respect."""
    tasks = [
        Task(kind=COLLECT, site=i, start_s=100.0 * i, end_s=100.0 * i + 30.0) for i in range(3)
    ]
    problem = make_problem(
        tasks, num_targets=3, use_resources=use_resources, rewards=[1.25, 2.5, 1.0 / 3.0]
    )
    return replace(problem, pinned=Pinned(kept=(Kept(row=0, pointer="/pins/keep/0"),)))


@pytest.mark.parametrize("share", [0.5 * SAME, BEYOND])
@pytest.mark.parametrize("solver", [Milp(formulation="pairwise"), Certified()])
def test_what_highs_leaves_open_is_not_called_optimal(
    solver: Solver, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = problem_with_rewards(use_resources=False)
    search = Engine.search

    def leaves_open(self: Engine, *args: object, **kwargs: object) -> Outcome:
        outcome = search(self, *args, **kwargs)  # type: ignore[arg-type]
        return replace(outcome, bound=outcome.bound * (1.0 + share))

    monkeypatch.setattr(Engine, "search", leaves_open)
    # No other bound may close the gap.
    monkeypatch.setattr(
        "planner_core.certified.incumbent.accessible", lambda _: Bound(value=np.inf, proof="milp")
    )
    for module in ("certified.strategies.supports", "solvers.milp"):
        monkeypatch.setattr(f"planner_core.{module}.is_agility_only", lambda _: False)
    solution = solver.solve(problem, Budget(), 0)
    assert solution.bound is not None
    reward = replay(problem, solution.plan).reward
    assert solution.bound == pytest.approx(reward * (1.0 + share), abs=1e-8)
    is_proven = solution.termination is Termination.OPTIMAL
    assert is_proven == is_optimal(reward, solution.bound, 0.0) == (share < SAME)


def test_searches_agree_on_what_is_optimal() -> None:
    problem = replace(problem_with_rewards(use_resources=False), pinned=Pinned())
    reward = replay(problem, Plan.of(problem, range(3))).reward
    for share in (0.5 * SAME, BEYOND):
        best = Incumbent(problem, Budget(), 0.0, Plan.of(problem, range(3)))
        best.bound = Bound(value=reward * (1.0 + share), proof="milp")
        searches = (AgilitySearch(best, 0), FleetSearch(best, 0))
        assert {search.best.is_optimal for search in searches} == {share < SAME}
        ended = {search.best.solution().termination for search in searches}
        assert (Termination.OPTIMAL in ended) == (share < SAME)


def test_a_valid_plan_is_better_than_any_other_and_what_is_kept_is_in_it() -> None:
    problem = random_problem(3, use_resources=False, num_collects=30, num_targets=20)
    every = Plan.of(problem, range(len(problem.opportunities)))
    best = Incumbent(problem, Budget(), 0.0, every)
    assert not best.is_valid
    assert best.offer(Plan())
    assert (best.is_valid, best.reward) == (True, 0.0)
    assert not best.offer(every)
    pinned = replace(problem, pinned=Pinned(kept=(Kept(row=4, pointer="/pins/keep/0"),)))
    kept = Incumbent(pinned, Budget(), 0.0)
    assert [action.opportunity for action in kept.plan.actions] == [4]
    assert kept.reward == 1.0


def test_bounds_only_fall_and_are_rounded_to_what_rewards_add_up_to() -> None:
    problem = random_problem(3, use_resources=False, num_collects=30, num_targets=20)
    best = Incumbent(problem, Budget(), 0.0)
    first = len(np.unique(problem.opportunities.site))
    assert best.bound.value == first
    assert best.lower(Bound(value=first - 1.5, proof="milp"))
    assert best.bound.value == first - 2.0
    assert not best.lower(Bound(value=first - 1.2, proof="milp"))
    assert best.bound.value == first - 2.0


def test_reports_tell_of_a_better_plan_in_the_making() -> None:
    seen: list[Progress] = []
    problem = random_problem(3, use_resources=False, num_collects=30, num_targets=20)
    best = Incumbent(problem, Budget(report=seen.append), 0.0)
    best.report("first")
    best.report("better", 4.0)
    bound = best.bound.value
    assert [(p.reward, p.bound) for p in seen] == [(0.0, bound), (4.0, bound)]
    assert seen[1].fraction == 4.0 / bound


def test_without_any_bound_a_plan_is_never_close() -> None:
    problem = random_problem(3, use_resources=False, num_collects=30, num_targets=20)
    for gap in (0.0, 0.5, 1.0):
        best = Incumbent(problem, Budget(), gap, bound=Bound(value=np.inf, proof="milp"))
        assert not best.is_close
        assert best.solution().proven is None
