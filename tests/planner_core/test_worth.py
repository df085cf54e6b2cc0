"""Worth and quality: curves over angles, the resulting worth of collects, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Curve, Quality, Scenario, Target
from planner_core.errors import InvalidScenario
from planner_core.problem import COLLECT
from planner_core.worth import common_unit, gain, quality_of, surplus, weights, worth_of
from tests.geometry import hours, satellite

OFF_NADIR: Curve = ((10.0, 1.0), (40.0, 0.4))
LIGHT: Curve = ((0.0, 0.0), (20.0, 0.5), (60.0, 1.0))


def scenario(quality: Quality) -> Scenario:
    """Return targets of different rewards along the track of one satellite."""
    targets = tuple(
        Target(id=f"t{i}", lat_deg=8.0 + i, lon_deg=-100.0 + 2 * (i % 5), reward=float(i % 4))
        for i in range(30)
    )
    return Scenario(
        horizon=hours(24.0),
        satellites=(satellite(),),
        targets=targets,
        use_resources=False,
        quality=quality,
    )


def test_curves_are_linear_between_knots_constant_beyond_and_multiplied() -> None:
    off_nadir_deg = np.array([0.0, 10.0, 25.0, 40.0, 70.0])
    sun_elevation_deg = np.array([60.0, 90.0, 10.0, 40.0, -30.0])
    one = np.array([1.0, 1.0, 0.7, 0.4, 0.4])
    other = np.array([1.0, 1.0, 0.25, 0.75, 0.0])
    for curves, expected in (
        (Quality(), np.ones(5)),
        (Quality(off_nadir_deg=OFF_NADIR), one),
        (Quality(sun_elevation_deg=LIGHT), other),
        (Quality(off_nadir_deg=OFF_NADIR, sun_elevation_deg=LIGHT), one * other),
    ):
        assert quality_of(curves, off_nadir_deg, sun_elevation_deg) == pytest.approx(expected)


def test_collects_are_worth_reward_times_quality() -> None:
    quality = Quality(off_nadir_deg=OFF_NADIR, sun_elevation_deg=LIGHT)
    asked = scenario(quality)
    problem = build_problem(asked, compute_opportunities(asked, Budget()), Budget())
    table = problem.opportunities
    assert len(table) > 20
    assert np.all(table.kind == COLLECT)
    reward = np.array([target.reward for target in asked.targets])[table.site]
    by_angle = np.interp(table.off_nadir_deg, *np.transpose(OFF_NADIR))
    by_light = np.interp(table.sun_elevation_deg, *np.transpose(LIGHT))
    assert problem.worth == pytest.approx(reward * by_angle * by_light)
    assert len(set(problem.worth.tolist())) > 10


def test_opportunities_do_not_depend_on_quality() -> None:
    asked = scenario(Quality(off_nadir_deg=OFF_NADIR))
    plain = replace(asked, quality=Quality())
    one, other = (compute_opportunities(each, Budget()) for each in (asked, plain))
    assert one.to_bytes() == other.to_bytes()


def test_a_target_earns_its_best_image_and_another_one_what_it_is_better_by() -> None:
    assert worth_of(np.array([0, 2, 2]), np.array([1.0, 4.0, 5.0])) == 6.0
    assert worth_of(np.empty(0, dtype=np.int32), np.empty(0)) == 0.0
    others = np.array([0.25, 0.5])
    assert [gain(worth, others) for worth in (0.75, 0.5, 0.25)] == [0.25, 0.0, 0.0]
    assert gain(0.75, np.empty(0)) == 0.75


def test_what_paths_are_paid_and_what_targets_keep_is_what_the_best_image_earns() -> None:
    multiplier, best = np.array([-1.0, 0.0, 0.25, 0.5, 2.0]), np.full(5, 0.5)
    kept = surplus(multiplier, best)
    assert kept.tolist() == [0.0, 0.0, 0.25, 0.5, 0.5]
    assert (kept + weights(best, kept)).tolist() == best.tolist()
    assert weights(best, multiplier).tolist() == [1.5, 0.5, 0.25, 0.0, 0.0]


def test_rewards_have_a_common_unit_as_far_as_doubles_count_by_ones() -> None:
    most = 2.0**50
    assert common_unit(np.array([0.0, most - 2.0])) == most - 2.0
    assert common_unit(np.array([2.0, most])) == 0.0
    # Zero rewards are multiples of anything; a unit of 0 would deny that.
    assert common_unit(np.zeros(2)) == common_unit(np.empty(0)) == 1.0


@pytest.mark.parametrize(
    ("knots", "row"),
    [
        (((0.0, 1.0), (91.0, 1.0)), 1),
        (((-1.0, 1.0),), 0),
        (((10.0, 1.0), (5.0, 0.5)), 1),
        (((10.0, 1.0), (20.0, 0.5), (20.0, 0.4)), 2),
        (((10.0, 1.1),), 0),
        (((10.0, -0.1),), 0),
        (((float("nan"), 1.0),), 0),
    ],
)
def test_a_knot_that_cannot_be_is_named(knots: Curve, row: int) -> None:
    with pytest.raises(InvalidScenario) as caught:
        Quality(off_nadir_deg=knots)
    assert caught.value.fault.pointer == f"/quality/off_nadir_deg/{row}"


def test_quality_is_refused_where_collects_may_start_anywhere() -> None:
    asked = scenario(Quality(sun_elevation_deg=LIGHT))
    with pytest.raises(InvalidScenario, match="use collect_spacing_s with quality") as caught:
        replace(asked, continuous_starts=True)
    assert caught.value.fault.pointer == "/continuous_starts"
    assert replace(asked, collect_spacing_s=15.0).quality
    assert replace(asked, quality=Quality(), continuous_starts=True).continuous_starts
