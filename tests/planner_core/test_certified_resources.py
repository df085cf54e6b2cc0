"""Plans with resources: the bound holds, the plan is valid, and "optimal" is the optimum."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.proofs.resource_bound import resource_value
from planner_core.certified.solver import Certified
from planner_core.referee.replay import replay
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem, varied_problem
from tests.planner_core.verdicts import encloses

SEEDS = st.integers(0, 10**6)
STARVED = replace(TIGHT, battery_min_fraction=0.5, initial_battery_fraction=0.62)

_problem = partial(varied_problem, scarce=STARVED)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(500)
@given(seed=SEEDS, num_satellites=st.integers(1, 3), has_quality=st.booleans())
def test_bound_and_plan_enclose_the_optimum(
    dynamics: Literal["physical", "paper"], seed: int, num_satellites: int, has_quality: bool
) -> None:
    problem = _problem(seed, dynamics, num_satellites, num_collects=6, has_quality=has_quality)
    encloses(problem, best_reward(problem), seed)


def test_small_problems_end_near_the_optimum() -> None:
    reached = 0
    for seed in range(30):
        problem = _problem(seed, "physical" if seed % 2 else "paper", 1 + seed % 2)
        plan = Certified().solve(problem, Budget(), 0).plan
        reached += replay(problem, plan).reward == best_reward(problem)
    assert reached >= 27


def test_what_is_stored_proves_the_bound_again() -> None:
    problem = random_problem(5, num_collects=60, num_targets=30, num_contacts=4)
    solution = Certified().solve(problem, Budget(), 0)
    assert solution.bound is not None
    assert solution.proven is not None
    assert solution.proven.proof == "dp"
    assert solution.proven.multipliers is not None
    assert solution.proven.unit is not None
    proven = resource_value(problem, solution.proven.multipliers, solution.proven.unit)
    assert solution.bound <= proven + 1e-6
    assert proven < solution.bound + 1.0


def test_the_same_seed_gives_the_same_plan() -> None:
    problem = random_problem(8, num_collects=60, num_targets=30, num_contacts=4)
    first, second = (Certified().solve(problem, Budget(), 3) for _ in range(2))
    assert first.plan == second.plan
    assert first.bound == second.bound


def test_bound_and_reward_close_in_and_a_gap_ends_the_search() -> None:
    problem = random_problem(11, num_collects=80, num_targets=40, num_contacts=4)
    seen: list[Progress] = []
    solution = Certified(gap=0.9).solve(problem, Budget(report=seen.append), 0)
    assert solution.termination in (Termination.GAP_REACHED, Termination.OPTIMAL)
    Certified().solve(problem, Budget(report=seen.append), 0)
    bounds = [p.bound for p in seen if p.bound is not None]
    rewards = [p.reward for p in seen if p.reward is not None]
    assert len(bounds) == len(rewards) > 0
    assert all(b >= r for b, r in zip(bounds, rewards, strict=True))


def test_cancelling_keeps_plan_and_bound() -> None:
    problem = random_problem(11, num_collects=80, num_targets=40, num_contacts=4)
    budget = Budget()
    budget.cancel()
    solution = Certified().solve(problem, budget, 0)
    assert solution.termination == Termination.CANCELLED
    assert solution.bound is not None
    assert replay(problem, solution.plan).is_valid
