"""Merged plans: valid, made of the pool's plans, and the best that can be made of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.mip.solution_pool import PlanPool, rows_of
from planner_core.certified.tuning import tuned
from planner_core.domain import Dynamics
from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem, varied_problem
from tests.planner_core.test_program_search import STARVED

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
ROOMY = replace(
    TIGHT, sunpoint_charge_per_s=1 / 900, collect_fill_per_s=1 / 600, telemetry_per_s=1e-5
)


def plans_of(problem: Problem, num_plans: int, num_moves: int) -> list[Plan]:
    """Return the results of short searches with different seeds."""
    start, plans = Rule().solve(problem, Budget(), 0).plan, []
    for seed in range(num_plans):
        search = ResourceWindows(problem, seed)
        search.adopt(start)
        search.make_moves(num_moves, Budget())
        plans.append(search.plan)
    return plans


def large_problem(seed: int, dynamics: Dynamics = "physical") -> Problem:
    problem = random_problem(
        seed, num_collects=400, num_targets=150, num_contacts=16, num_satellites=3,
        span_s=9000.0, resources=ROOMY, dynamics=dynamics,
    )  # fmt: skip
    return replace(problem, horizon_s=9100.0)


@examples(40)
@given(seed=SEEDS, dynamics=DYNAMICS, num_satellites=st.integers(1, 3))
def test_merged_plans_are_no_better_than_the_best_of_what_is_merged(
    seed: int, dynamics: Dynamics, num_satellites: int
) -> None:
    problem = varied_problem(seed, dynamics, num_satellites, scarce=STARVED)
    plans = [Rule().solve(problem, Budget(), 0).plan, *plans_of(problem, 3, 5)]
    pool = PlanPool(problem, Budget(), seed)
    pool.learn(plans[1:], plans[0])
    known = [timeline.reward for p in plans if (timeline := replay(problem, p)).is_valid]
    assert pool.reward == max(known, default=0.0)
    pool.merge()
    pool.merge()
    timeline = replay(problem, pool.plan)
    rows = np.array(sorted({row for plan in plans for row in rows_of(plan)}), dtype=np.int32)
    assert set(rows_of(pool.plan)) <= set(rows.tolist())
    if known:
        assert timeline.is_valid
        assert timeline.reward == pytest.approx(pool.reward)
        assert pool.reward <= best_reward(restricted(problem, rows)) + 1e-6


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
def test_a_plan_that_was_taken_apart_is_found_again(dynamics: Dynamics) -> None:
    for seed in range(6):
        problem = large_problem(seed, dynamics)
        (whole,) = plans_of(problem, 1, 1500)
        images = [a for a in whole.actions if problem.opportunities.kind[a.opportunity] == COLLECT]
        thirds = [{*images[part::3]} for part in range(3)]
        pool = PlanPool(problem, Budget(), seed)
        for third in thirds:
            pool.add(Plan(tuple(a for a in whole.actions if a not in third)))
        pool.merge()
        assert replay(problem, pool.plan).is_valid
        assert pool.reward >= replay(problem, whole).reward > 20.0


def test_what_another_search_is_at_is_merged_only_if_it_is_the_best() -> None:
    problem = large_problem(0)
    first, second, third = sorted(
        plans_of(problem, 3, 300), key=lambda p: replay(problem, p).reward
    )
    pool = PlanPool(problem, Budget(), 0)
    pool.learn([], third)
    pool.learn([], first)
    assert pool.latest == rows_of(first)
    assert pool.plan == third
    pool.merge()
    assert pool.plan == third  # there is nothing to merge it with
    pool.learn([second], first)
    pool.merge()
    assert set(rows_of(pool.plan)) <= {*rows_of(second), *rows_of(third)}


def test_of_a_large_fleet_as_many_plans_are_merged_as_a_program_bears() -> None:
    problem = large_problem(1)
    plans = plans_of(problem, 4, 300)
    best = sorted(plans, key=lambda plan: -replay(problem, plan).reward)[:2]
    offered = {row for plan in best for row in rows_of(plan)}
    pool = PlanPool(problem, Budget(), 0)
    for plan in plans:
        pool.add(plan)
    with tuned(most_columns=len(offered)):
        pool.merge()
    assert set(rows_of(pool.plan)) <= offered
