"""The bound holds for every plan, with any multipliers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.proofs.bound import Bound, accessible, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound, lagrangian_value
from planner_core.certified.proofs.totals import totals_bound
from planner_core.domain import Agility, Resources
from planner_core.problem import COLLECT, CONTACT, Sunlight
from planner_core.referee.replay import replay
from planner_core.solvers.registry import ForwardSearch
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import Task, make_problem, random_problem, with_rewards

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
        multipliers = rng.uniform(-1.0, 10.0, len(problem.target_ids))
        assert lagrangian_value(problem, multipliers)[0] >= best - 1e-9


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
    for multipliers in (np.zeros(4), np.ones(4), rng.uniform(0.0, 1.0, 4)):
        assert lagrangian_value(problem, multipliers)[0] >= best - 1e-9


@examples(40)
@given(seed=SEEDS)
def test_the_stored_multipliers_prove_the_bound_again(seed: int) -> None:
    problem = random_problem(seed, num_collects=60, num_targets=20, use_resources=False)
    plan = ForwardSearch().solve(problem, Budget(), 0).plan
    reward = replay(problem, plan).reward
    bound = lagrangian_bound(problem, reward)
    assert bound.multipliers is not None
    proven, _ = lagrangian_value(problem, bound.multipliers)
    assert reward <= bound.value <= proven + 1e-6


def test_multipliers_tighten_the_bound_where_targets_would_be_taken_twice() -> None:
    problem = random_problem(3, num_collects=60, num_targets=8, use_resources=False)
    free, _ = lagrangian_value(problem, np.zeros(8))
    assert lagrangian_bound(problem, reward=0.0).value <= 8.0 < free


def test_the_bound_says_how_often_its_paths_take_each_target() -> None:
    tasks = [
        Task(kind=COLLECT, site=site, start_s=200.0 * i, end_s=200.0 * i + 30.0)
        for i, site in enumerate([0, 1, 0, 2])
    ]
    problem = make_problem(tasks, num_targets=4, use_resources=False, rewards=[1.0, 1.0, 0.0, 1.0])
    value, counts = lagrangian_value(problem, np.array([0.25, 0.5, 0.5, 0.5]))
    assert (value, counts[:2].tolist(), counts[3]) == (0.75 + 0.75 * 2 + 0.5, [2, 1], 0)


def test_bounds_are_rounded_down_to_what_whole_rewards_add_up_to() -> None:
    problem = with_rewards(random_problem(3, num_targets=2, use_resources=False), [2.0, 4.0])
    assert problem.reward_unit == 2.0
    assert [rounded_bound(problem, v, 0.0) for v in (1.9, 2.0, 3.9, 4.0 - 1e-7)] == [0, 2, 2, 4]
    assert rounded_bound(problem, 3.9, 4.0) == 4.0, "some plan has earned it"
    odd = with_rewards(problem, [0.5, 1.25])
    assert 0.7 < rounded_bound(odd, 0.7, 0.0) < 0.7 + 2e-9
    # A sum of large rewards loses more to rounding than one of small ones.
    assert 1e9 + 1e-4 < rounded_bound(odd, 1e9, 0.0) < 1e9 + 1e-2


def test_a_bound_is_what_new_images_earn_and_those_on_board() -> None:
    new = Bound(value=3.0, proof="totals")
    both = new.with_on_board(1.0)
    assert (both.value, both.on_board) == (4.0, 1.0)
    assert (both.without_on_board().value, both.without_on_board().on_board) == (3.0, 0.0)
    assert accessible(with_rewards(random_problem(0, num_targets=2), [2.0, 4.0])).value == 6.0


def _pass(start_s: float, end_s: float, access: int) -> Task:
    return Task(kind=CONTACT, site=0, start_s=start_s, end_s=end_s, access=access)


_CHARGED = {"initial_battery_fraction": 0.6}
_FILLED = {"initial_recorder_fraction": 0.125}


@pytest.mark.parametrize(
    ("changes", "contacts", "sun_s", "images"),
    [
        # 0.3 of the battery at 0.1 per image; contacts only cost energy.
        (_CHARGED, [], 1000.0, 3.0),
        (_CHARGED, [_pass(0.0, 900.0, 0)], 1000.0, 3.0),
        ({"collect_drain_per_s": 0.0}, [], 1000.0, 20.0),
        ({"initial_battery_fraction": 0.2}, [], 1000.0, 0.0),
        # 240 s of sun give 0.2 more; seconds of an image do not charge.
        ({**_CHARGED, "sunpoint_charge_per_s": 1 / 1200}, [], 240.0, 5.0),
        ({**_CHARGED, "sunpoint_charge_per_s": 1 / 1200}, [], 1e3, 272 / 30),
        # 0.375 of the recorder at 0.15 per image.
        (_FILLED, [], 1000.0, 2.5),
        ({**_FILLED, "telemetry_per_s": 75e-6}, [], 1000.0, 2.0),
        # 75 s of contact downlink two images; only the longest contact of a pass counts.
        (_FILLED, [_pass(0.0, 75.0, 0), _pass(0.0, 50.0, 0)], 1e3, 4.5),
        (_FILLED, [_pass(0.0, 75.0, 0), _pass(90.0, 165.0, 1)], 1e3, 6.5),
        # A full recorder: 90 s of contact make room for as many images as the energy then allows.
        (
            {"initial_battery_fraction": 0.9, "initial_recorder_fraction": 0.5,
             "contact_drain_per_s": 1 / 250},
            [_pass(0.0, 300.0, 0)], 1000.0, 2.4,
        ),
    ],
)  # fmt: skip
def test_what_energy_and_downlink_add_up_to(
    changes: dict[str, Any], contacts: list[Task], sun_s: float, images: float
) -> None:
    """Images are worth 0.7 each, no multiple of a unit; the last one counts in part."""
    bare: dict[str, Any] = {
        "battery_min_fraction": 0.3, "initial_battery_fraction": 1.0, "sunpoint_charge_per_s": 0.0,
        "collect_drain_per_s": 1 / 300, "contact_drain_per_s": 0.0, "recorder_max_fraction": 0.5,
        "initial_recorder_fraction": 0.0, "collect_fill_per_s": 1 / 200,
        "downlink_per_s": 1 / 250, "telemetry_per_s": 0.0,
    }  # fmt: skip
    if "initial_recorder_fraction" not in changes:
        bare["collect_fill_per_s"] = 0.0
    tasks = [Task(kind=COLLECT, site=i, start_s=35.0 * i, end_s=35.0 * i + 30) for i in range(20)]
    problem = make_problem(
        [*tasks, *contacts], num_targets=20, rewards=[0.7] * 20,
        resources=Resources(**{**bare, **changes}),
        sunlight=Sunlight(enter_s=np.array([0.0]), exit_s=np.array([sun_s])),
    )  # fmt: skip
    bound = totals_bound(problem)
    assert bound is not None
    assert bound.value == pytest.approx(0.7 * images, rel=1e-6, abs=1e-6)
