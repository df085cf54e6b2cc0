"""The bound holds for every plan, whatever the prices."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.proofs.lagrangian import lagrangian_bound, lagrangian_value
from planner_core.domain import Agility
from planner_core.referee.replay import replay
from planner_core.solvers.registry import ForwardSearch
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import random_problem, with_rewards

SEEDS = st.integers(0, 10**6)


@examples(100)
@given(
    seed=SEEDS,
    use_resources=st.booleans(),
    num_satellites=st.integers(1, 2),
    has_rewards=st.booleans(),
    has_quality=st.booleans(),
)
def test_no_plan_beats_the_bound(
    seed: int, use_resources: bool, num_satellites: int, has_rewards: bool, has_quality: bool
) -> None:
    problem = random_problem(
        seed, use_resources=use_resources, num_satellites=num_satellites, has_rewards=has_rewards,
        has_quality=has_quality,
    )  # fmt: skip
    best = best_reward(problem)
    assert lagrangian_bound(problem, reward=0.0).value >= best - 1e-9
    rng = np.random.default_rng(seed)
    for _ in range(5):
        prices = rng.uniform(-1.0, 10.0, len(problem.target_ids))
        assert lagrangian_value(problem, prices)[0] >= best - 1e-9


@examples(60)
@given(seed=SEEDS)
def test_a_slow_satellite_may_turn_by_way_of_tasks_that_are_worth_nothing(seed: int) -> None:
    problem = random_problem(
        seed, use_resources=False, num_collects=9, num_targets=4, span_s=300.0,
        max_turn_deg=25.0, agility=Agility(slew_rate_deg_s=0.3),
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    problem = with_rewards(problem, rng.integers(0, 2, 4))
    best = best_reward(problem)
    assert lagrangian_bound(problem, reward=0.0).value >= best - 1e-9
    for prices in (np.zeros(4), np.ones(4), rng.uniform(0.0, 1.0, 4)):
        assert lagrangian_value(problem, prices)[0] >= best - 1e-9


@examples(40)
@given(seed=SEEDS)
def test_the_stored_prices_prove_the_bound_again(seed: int) -> None:
    problem = random_problem(seed, num_collects=60, num_targets=20, use_resources=False)
    plan = ForwardSearch().solve(problem, Budget(), 0).plan
    reward = replay(problem, plan).reward
    bound = lagrangian_bound(problem, reward)
    assert bound.prices is not None
    proven, _ = lagrangian_value(problem, bound.prices)
    assert reward <= bound.value <= proven + 1e-6


def test_prices_tighten_the_bound_where_targets_would_be_taken_twice() -> None:
    problem = random_problem(3, num_collects=60, num_targets=8, use_resources=False)
    free, _ = lagrangian_value(problem, np.zeros(8))
    assert lagrangian_bound(problem, reward=0.0).value <= 8.0 < free
