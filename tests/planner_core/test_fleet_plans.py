"""Fleets with battery and recorder: plans found along with multipliers, and with programs."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.tuning import tuned
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified
from tests.examples import examples
from tests.planner_core.problems import random_problem


@examples(10)
@given(seed=st.integers(0, 10**6), num_satellites=st.integers(2, 4))
def test_the_plan_is_the_same_however_many_threads_work(seed: int, num_satellites: int) -> None:
    problem = random_problem(
        seed, num_satellites=num_satellites, num_collects=24, num_targets=16, num_contacts=4,
        has_rewards=seed % 2 == 0,
    )  # fmt: skip
    with tuned(large=3, fleet_patience=2, epochs=20):
        alone, together = (
            Certified().solve(problem, Budget(num_threads=num_threads), seed)
            for num_threads in (1, 3)
        )
    timeline = replay(problem, alone.plan)
    assert timeline.is_valid
    assert timeline.reward > 0.0
    assert together.plan == alone.plan
    assert together.bound == alone.bound
