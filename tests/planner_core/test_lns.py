"""The window search: plans stay valid, never get worse, and depend only on the seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.lns.search import WindowSearch, improved
from planner_core.domain import Agility
from planner_core.problem import Kept, Pinned
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Graph
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import random_problem

SEEDS = st.integers(0, 10**6)


@pytest.mark.parametrize("slew_rate_deg_s", [1.0, 0.3])
@examples(40)
@given(
    seed=SEEDS, num_satellites=st.integers(1, 3), has_rewards=st.booleans(),
    num_offers=st.sampled_from([1, 4]), span_s=st.sampled_from([800.0, 8000.0]),
)  # fmt: skip
def test_plans_stay_valid_and_never_get_worse(
    slew_rate_deg_s: float,
    seed: int,
    num_satellites: int,
    has_rewards: bool,
    num_offers: int,
    span_s: float,
) -> None:
    problem = random_problem(
        seed, num_collects=60, num_targets=25, num_satellites=num_satellites,
        use_resources=False, has_rewards=has_rewards, max_turn_deg=25.0, num_offers=num_offers,
        span_s=span_s, agility=Agility(slew_rate_deg_s=slew_rate_deg_s),
    )  # fmt: skip
    problem = replace(problem, horizon_s=span_s + 100.0)
    plan = Graph().solve(problem, Budget(), 0).plan
    reward = replay(problem, plan).reward
    for start in (plan, Plan()):
        better = improved(problem, start, 30.0, Budget(), seed)
        timeline = replay(problem, better)
        assert not timeline.violations
        assert timeline.reward >= (reward if start is plan else 0.0)
        assert improved(problem, start, 30.0, Budget(), seed) == better


@pytest.mark.parametrize("num_offers", [1, 3])
def test_small_problems_end_at_the_optimum(num_offers: int) -> None:
    reached = 0
    for seed in range(20):
        problem = random_problem(
            seed, use_resources=False, num_satellites=2, has_rewards=True, span_s=600.0,
            num_collects=9 // num_offers, num_offers=num_offers,
        )  # fmt: skip
        plan = improved(problem, Plan(), 100.0, Budget(), 0)
        reached += replay(problem, plan).reward == best_reward(problem)
    assert reached >= 18


def test_a_plan_is_never_given_up_for_targets_that_are_only_preferred() -> None:
    """Preferences decide between plans that earn the same; the current plan stays."""
    problem = random_problem(
        4, use_resources=False, num_collects=40, num_targets=20, num_offers=4, span_s=900.0
    )
    problem = replace(problem, pinned=Pinned(kept=(Kept(row=7, pointer="/pins/0"),)))
    rng = np.random.default_rng(4)
    start = improved(problem, Plan(), 20.0, Budget(), 0)
    reward = replay(problem, start).reward
    for seed in range(10):
        preference = rng.uniform(0.5, 1.5, len(problem.target_ids))
        search = WindowSearch(problem, seed, preference=preference)
        search.adopt(start)
        search.make_moves(800, Budget())
        timeline = replay(problem, search.plan)
        assert not timeline.violations
        assert timeline.reward >= reward
        assert 7 in {action.opportunity for action in search.plan.actions}


def test_a_cancelled_search_returns_the_plan_at_once() -> None:
    problem = random_problem(4, use_resources=False, num_collects=40, num_targets=20)
    plan = Graph().solve(problem, Budget(), 0).plan
    budget = Budget()
    budget.cancel()
    assert improved(problem, plan, 1e6, budget, 0) == plan
