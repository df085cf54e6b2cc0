"""Transitions with acceleration limits and settling, compared with plain closures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Agility
from planner_core.precedence.relation import comes_before, excluded_beside, transitive_closure
from planner_core.problem.slew import INSTANT, slew_s
from planner_core.referee.replay import replay
from planner_core.solvers.registry import SOLVERS
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import random_problem

AGILITIES = st.builds(
    Agility,
    slew_rate_deg_s=st.sampled_from([0.2, 0.5, 1.0, 2.0]),
    acceleration_deg_s2=st.sampled_from([None, 0.01, 0.05, 0.25, 1.0]),
    settle_s=st.sampled_from([0.0, 2.0, 3.5, 15.0]),
)


@given(
    rate=st.floats(0.05, 5.0),
    acceleration=st.floats(0.005, 5.0),
    angle=st.floats(0.0, 180.0),
)
def test_a_slew_is_the_quickest_from_rest_to_rest(
    rate: float, acceleration: float, angle: float
) -> None:
    """The angle is the integral of the speed: up at the limit, along at the rate, down again."""
    took = slew_s(angle, rate, acceleration)
    t = np.linspace(0.0, took, 20_001)
    speed = np.minimum(np.minimum(acceleration * t, acceleration * (took - t)), rate)
    turned = float(np.trapezoid(speed, t))
    # The samples cut the corners of the profile a little.
    assert turned == pytest.approx(angle, rel=1e-4, abs=1e-9)


@given(
    rate=st.floats(0.05, 5.0),
    acceleration=st.one_of(st.just(INSTANT), st.floats(0.005, 5.0)),
    parts=st.tuples(st.floats(0.0, 90.0), st.floats(0.0, 90.0)),
)
def test_two_slews_take_no_less_than_one_through_both(
    rate: float, acceleration: float, parts: tuple[float, float]
) -> None:
    """The assumption of ``transitive_closure``."""
    first, second = (slew_s(part, rate, acceleration) for part in parts)
    assert first + second >= slew_s(sum(parts), rate, acceleration) - 1e-9
    assert slew_s(max(parts), rate, acceleration) >= max(first, second) - 1e-12


@examples(150)
@given(
    seed=st.integers(0, 10**6),
    agility=AGILITIES,
    max_turn_deg=st.sampled_from([0.0, 25.0, 60.0]),
)
def test_the_closure_is_what_single_steps_reach(
    seed: int, agility: Agility, max_turn_deg: float
) -> None:
    problem = random_problem(
        seed, num_collects=14, use_resources=False, agility=agility, max_turn_deg=max_turn_deg,
        span_s=500.0,
    )  # fmt: skip
    (satellite,) = problem.satellites
    n = len(satellite)
    reaches = np.array([[satellite.transitions.allows(a, b) for b in range(n)] for a in range(n)])
    for via in range(n):
        reaches |= np.outer(reaches[:, via], reaches[via])
    closure = transitive_closure(satellite)
    found = [[a < b and comes_before(closure, a, b) for b in range(n)] for a in range(n)]
    assert found == reaches.tolist()
    beside = reaches | reaches.T | np.eye(n, dtype=np.bool_)
    pairs = np.transpose(excluded_beside(satellite, np.arange(n, dtype=np.int32)))
    np.testing.assert_array_equal(pairs, np.argwhere(~beside))


@examples(40)
@given(
    seed=st.integers(0, 10**6),
    agility=AGILITIES,
    max_turn_deg=st.sampled_from([0.0, 40.0]),
    solver=st.sampled_from(["milp", "certified"]),
)
def test_plans_of_slow_starters_are_the_best(
    seed: int, agility: Agility, max_turn_deg: float, solver: str
) -> None:
    problem = random_problem(
        seed, num_satellites=2, has_rewards=True, use_resources=False, agility=agility,
        max_turn_deg=max_turn_deg, span_s=400.0,
    )  # fmt: skip
    solution = SOLVERS[solver]().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    best = best_reward(problem)
    assert math.isclose(timeline.reward, best)
    assert solution.bound is not None
    assert solution.bound >= best - 1e-6
