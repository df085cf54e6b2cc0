"""The window search: plans stay valid, never get worse, and are the same for the same seed."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.domain import Agility
from planner_core.plan import Plan
from planner_core.solvers import Graph
from planner_core.solvers.base import Budget
from planner_core.solvers.lns import improved
from planner_core.timeline import replay
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import random_problem

SEEDS = st.integers(0, 10**6)


@pytest.mark.parametrize("slew_rate_deg_s", [1.0, 0.3])
@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, num_satellites=st.integers(1, 3), has_rewards=st.booleans())
def test_plans_stay_valid_and_never_get_worse(
    slew_rate_deg_s: float, seed: int, num_satellites: int, has_rewards: bool
) -> None:
    problem = random_problem(
        seed, num_collects=60, num_targets=25, num_satellites=num_satellites,
        use_resources=False, has_rewards=has_rewards, max_turn_deg=25.0,
        agility=Agility(slew_rate_deg_s=slew_rate_deg_s),
    )  # fmt: skip
    plan = Graph().solve(problem, Budget(), 0).plan
    reward = replay(problem, plan).reward
    for start in (plan, Plan()):
        better = improved(problem, start, 30.0, Budget(), seed)
        timeline = replay(problem, better)
        assert not timeline.violations
        assert timeline.reward >= (reward if start is plan else 0.0)
        assert improved(problem, start, 30.0, Budget(), seed) == better


def test_small_problems_end_at_the_optimum() -> None:
    reached = 0
    for seed in range(20):
        problem = random_problem(seed, use_resources=False, num_satellites=2, has_rewards=True)
        plan = improved(problem, Plan(), 100.0, Budget(), 0)
        reached += replay(problem, plan).reward == best_reward(problem)
    assert reached >= 18
