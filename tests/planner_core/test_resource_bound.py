"""The bound under battery and recorder holds for every plan, and is tight if it can be."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from planner_core.certified.proofs import resource_bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound, resource_value
from planner_core.certified.proofs.satellite_relaxation import relaxations
from planner_core.problem import CONTACT
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem, varied_problem

SEEDS = st.integers(0, 10**6)
BATTERY_ONLY = replace(
    TIGHT,
    battery_min_fraction=0.5,
    initial_battery_fraction=0.65,
    recorder_max_fraction=1.0,
    initial_recorder_fraction=0.0,
    collect_fill_per_s=1 / 30000,
    telemetry_per_s=0.0,
)


_problem = partial(varied_problem, scarce=BATTERY_ONLY)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(500)
@example(seed=0, num_satellites=1, has_quality=False)
@given(seed=SEEDS, num_satellites=st.integers(1, 3), has_quality=st.booleans())
def test_no_plan_beats_the_bound(
    dynamics: Literal["physical", "paper"], seed: int, num_satellites: int, has_quality: bool
) -> None:
    problem = _problem(seed, dynamics, num_satellites, num_collects=6, has_quality=has_quality)
    best = best_reward(problem)
    assert quick_bound(problem, reward=0.0).value >= best - 1e-9
    rng = np.random.default_rng(seed)
    for unit in (1.0, 0.1, 0.37):
        multipliers = rng.uniform(-1.0, 6.0, len(problem.target_ids))
        assert resource_value(problem, multipliers, unit) >= best - 1e-9


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(60)
@given(seed=SEEDS)
def test_it_is_the_optimum_where_no_target_can_be_collected_twice(
    dynamics: Literal["physical", "paper"], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    tasks = [
        Task(kind=0, site=i, start_s=start_s, end_s=start_s + 30.0, angle_deg=angle_deg)
        for i, (start_s, angle_deg) in enumerate(
            zip(np.round(rng.uniform(0, 940, 9), 3), rng.uniform(-55, 55, 9), strict=True)
        )
    ]
    problem = make_problem(
        tasks, num_targets=9, dynamics=dynamics, resources=BATTERY_ONLY, rewards=range(1, 10)
    )
    assert quick_bound(problem, reward=0.0).value == best_reward(problem)


def test_it_lies_far_below_what_agility_allows_where_energy_is_short() -> None:
    problem = random_problem(1, num_collects=40, num_targets=40, num_contacts=0)
    starved = random_problem(
        1, num_collects=40, num_targets=40, num_contacts=0, use_resources=False
    )
    assert quick_bound(problem, 0.0).value < 0.7 * quick_bound(starved, 0.0).value


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(200)
@given(seed=SEEDS, has_quality=st.booleans())
def test_batteries_alone_prove_one_where_near_pairs_take_too_long(
    dynamics: Literal["physical", "paper"], seed: int, has_quality: bool
) -> None:
    problem = _problem(seed, dynamics, num_collects=6, has_quality=has_quality)
    with patch.object(resource_bound, "MAX_STEPS", 0):
        bound = quick_bound(problem, 0.0)
    assert bound.value >= best_reward(problem) - 1e-9
    assert is_proven(problem, from_json(to_json(bound)))
    assert bound.value <= lagrangian_bound(problem, 0.0).value + 1e-9


def test_batteries_alone_prove_less_than_agility_where_energy_is_short() -> None:
    problem = random_problem(1, num_collects=40, num_targets=40, num_contacts=0)
    with patch.object(resource_bound, "MAX_STEPS", 0):
        bound = quick_bound(problem, 0.0)
    assert bound.proof == "dp"
    assert bound.value < 0.9 * lagrangian_bound(problem, 0.0).value


@examples(30)
@given(seed=SEEDS)
def test_the_stored_multipliers_prove_the_bound_again(seed: int) -> None:
    problem = _problem(seed, "physical", 2, num_collects=60, num_targets=30, num_contacts=4)
    bound = quick_bound(problem, reward=0.0)
    assert is_proven(problem, bound)
    assert not is_proven(problem, replace(bound, value=0.9 * bound.value))


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(40)
@given(seed=SEEDS, near=st.sampled_from([None, 0.5, 1.0, 1.5]))
def test_a_multiplier_of_data_changes_nothing_but_the_time(
    dynamics: Literal["physical", "paper"], seed: int, near: float | None
) -> None:
    problem = _problem(seed, dynamics, num_collects=14, num_targets=10, num_contacts=4)
    num_rows = len(problem.opportunities)
    worth = np.random.default_rng(seed).integers(0, 30, num_rows).astype(np.int32)
    worth[problem.opportunities.kind == CONTACT] = 0
    stop = np.zeros(1, dtype=np.uint8)
    for relaxation in relaxations(problem, 2):
        most, _ = replace(relaxation, data_multiplier=0.0).most(worth, 1.0, 0, stop)
        expected = None if near is None else int(near * most)
        for data_multiplier in (relaxation.with_data_multiplier(10).data_multiplier, 0.1, 0.5, 2.0):
            priced = replace(relaxation, data_multiplier=data_multiplier)
            found, path = priced.most(worth, 1.0, 0, stop, near=expected, keeps_path=True)
            assert found == most
            assert path is not None
            assert worth[relaxation.satellite.rows[path]].sum() == most
