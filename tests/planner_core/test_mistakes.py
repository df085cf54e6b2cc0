"""Warnings about likely mistakes: when they appear, and when not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.domain import GroundStation, Objective, Quality, Resources, Scenario
from planner_core.mistakes import mistakes_of_accesses, usual_mistakes
from planner_core.problem import CONTACT
from tests.planner_core.test_worth import scenario

STATION = GroundStation(id="n", name="North", lat_deg=78.2, lon_deg=15.4)


def optical(**sensor: object) -> Scenario:
    """Return a mission in watts and megabits that images by day only, with a station."""
    asked = scenario(Quality())
    first = asked.satellites[0]
    resources = replace(Resources.paper(first.orbit.period_s), recorder_capacity_mbit=1000.0)
    limits = {"sun_elevation_min_deg": 10.0} | sensor
    satellite = replace(
        first,
        resources=resources,
        sensor=replace(first.sensor, **limits),  # type: ignore[arg-type]
    )
    return replace(asked, satellites=(satellite,), ground_stations=(STATION,), use_resources=True)


def test_a_sound_question_has_none() -> None:
    assert usual_mistakes(optical()) == ()
    assert usual_mistakes(scenario(Quality())) == ()


def test_optical_images_at_night_are_named() -> None:
    asked = optical(sun_elevation_min_deg=None)
    (warning,) = usual_mistakes(asked)
    assert "at night" in warning
    assert repr(asked.satellites[0].name) in warning


@pytest.mark.parametrize("sensor_type", ["SAR", "X-band radar"])
def test_radar_needs_no_light(sensor_type: str) -> None:
    assert usual_mistakes(optical(sun_elevation_min_deg=None, sensor_type=sensor_type)) == ()


def test_whoever_has_thought_of_the_sun_is_not_told_of_it() -> None:
    asked = optical(sun_elevation_min_deg=None)
    by_day = tuple(replace(target, sun_elevation_min_deg=0.0) for target in asked.targets)
    assert usual_mistakes(replace(asked, targets=by_day)) == ()
    curves = Quality(sun_elevation_deg=((0.0, 0.0), (10.0, 1.0)))
    assert usual_mistakes(replace(asked, quality=curves)) == ()
    (warning,) = usual_mistakes(replace(asked, targets=(asked.targets[0], *by_day[1:])))
    assert f"1 of {len(by_day)} targets" in warning


def test_data_must_have_a_way_down() -> None:
    asked = optical()
    (warning,) = usual_mistakes(replace(asked, ground_stations=()))
    assert "no ground station" in warning
    assert usual_mistakes(replace(asked, ground_stations=(), use_resources=False)) == ()
    table = compute_opportunities(asked, Budget()).opportunities
    assert np.any(table.kind == CONTACT)
    assert mistakes_of_accesses(asked, table) == ()
    out_of_sight = replace(asked, ground_stations=(replace(STATION, min_elevation_deg=89.9),))
    table = compute_opportunities(out_of_sight, Budget()).opportunities
    (warning,) = mistakes_of_accesses(out_of_sight, table)
    assert "no image can be downlinked" in warning


def but_long(asked: Scenario) -> tuple[str, ...]:
    """Return the warnings other than those about images too long for any access."""
    return tuple(one for one in usual_mistakes(asked) if "takes longer than" not in one)


def test_an_image_must_fit_a_recorder() -> None:
    asked = optical()
    resources = replace(asked.satellites[0].resources, collect_drain_per_s=0.0)
    asked = replace(asked, satellites=(replace(asked.satellites[0], resources=resources),))
    longest_s = resources.recorder_max_fraction / resources.collect_fill_per_s
    targets = list(asked.targets)
    targets[0] = replace(targets[0], collect_s=0.999 * longest_s)
    assert but_long(replace(asked, targets=tuple(targets))) == ()
    targets[0] = replace(targets[0], collect_s=1.001 * longest_s)
    targets[1] = replace(targets[1], collect_s=2.0 * longest_s)
    (warning,) = but_long(replace(asked, targets=tuple(targets)))
    assert repr(targets[0].id) in warning
    assert "and 1 more" in warning


@pytest.mark.parametrize("collected_share", [0.5, 1.0])
@pytest.mark.parametrize("half_life_s", [None, 3600.0])
def test_a_half_life_of_nothing_is_told(collected_share: float, half_life_s: float | None) -> None:
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    told = usual_mistakes(replace(optical(), objective=objective))
    is_told = any("half_life_s has no effect" in one for one in told)
    assert is_told == (collected_share == 1.0 and half_life_s is not None)


def test_more_data_than_all_contacts_take_is_told() -> None:
    asked = optical()
    own = asked.satellites[0].resources
    for rate_per_s, is_told in ((1e-9, True), (1.0, False)):
        slow = replace(own, downlink_per_s=rate_per_s)
        question = replace(asked, satellites=(replace(asked.satellites[0], resources=slow),))
        table = compute_opportunities(question, Budget()).opportunities
        assert (table.kind == CONTACT).any()
        assert bool(mistakes_of_accesses(question, table)) is is_told
        # With half the rate needed the warning says 50 %.
    most = float((table.end_s - table.start_s)[table.kind == CONTACT].sum())
    images = np.unique(table.site[table.kind != CONTACT])
    needed = sum(asked.targets[i].collect_s for i in images) * own.collect_fill_per_s
    half = replace(own, downlink_per_s=0.5 * needed / most)
    question = replace(asked, satellites=(replace(asked.satellites[0], resources=half),))
    (warning,) = mistakes_of_accesses(question, table)
    assert " 50 % " in warning


def test_an_image_longer_than_any_access_is_told_before_there_are_any() -> None:
    asked = optical()
    own = asked.satellites[0]
    free = replace(own.resources, collect_drain_per_s=0.0, collect_fill_per_s=0.0)
    for off_nadir_max_deg in (20.0, 45.0, 80.0):
        sensor = replace(own.sensor, off_nadir_max_deg=off_nadir_max_deg, min_elevation_deg=0.0)
        sensor = replace(sensor, sun_elevation_min_deg=-90.0)
        wide = replace(asked, satellites=(replace(own, sensor=sensor, resources=free),))
        table = compute_opportunities(wide, Budget()).opportunities
        lengths_s = (table.access_end_s - table.access_start_s)[table.kind != CONTACT]
        # No warning for the length found, which is possible; a warning for twice that.
        assert lengths_s.size > 3
        for longest_s, is_told in ((lengths_s.max(), False), (2.0 * lengths_s.max(), True)):
            targets = (replace(wide.targets[0], collect_s=float(longest_s)), *wide.targets[1:])
            told = usual_mistakes(replace(wide, targets=targets))
            assert any("takes longer than" in one for one in told) == is_told, off_nadir_max_deg


def of_places(*sites: tuple[float, float]) -> Scenario:
    asked = optical()
    first = asked.targets[0]
    targets = tuple(
        replace(first, id=f"t{number}", lat_deg=lat_deg, lon_deg=lon_deg)
        for number, (lat_deg, lon_deg) in enumerate(sites)
    )
    return replace(asked, targets=targets)


EUROPE = tuple(
    (lat_deg, lon_deg) for lat_deg in (45.0, 47.0, 49.0, 51.0) for lon_deg in (9, 11, 13)
)
AFRICA = tuple((lat_deg, lon_deg) for lat_deg in (5, 8, 11) for lon_deg in (20.0, 22.0, 24.0, 26.0))
# In rainy Brazil; off Antarctica if the columns are swapped.
ATLANTIC_COAST = tuple(
    (float(lat), float(lon)) for lat in (-12, -9, -6) for lon in (-62, -58, -54, -50)
)
ATLANTIC = tuple((lat_deg, -35.0) for lat_deg in range(-20, 20, 3))


def test_targets_at_sea_are_told_and_how_they_would_be_on_land() -> None:
    assert usual_mistakes(of_places(*EUROPE, *AFRICA)) == ()
    (warning,) = usual_mistakes(of_places(*((lon, lat) for lat, lon in ATLANTIC_COAST)))
    assert "with latitude and longitude swapped" in warning
    assert usual_mistakes(of_places(*ATLANTIC_COAST)) == ()
    (warning,) = usual_mistakes(of_places(*ATLANTIC))
    assert "13 of 14 targets are at sea, the first of them 't0'" in warning
    assert "swapped" not in warning


def test_a_few_targets_and_such_as_are_drawn_over_the_globe_are_no_mistake() -> None:
    assert usual_mistakes(of_places(*ATLANTIC[:5])) == ()
    random = np.random.default_rng(0)
    lat_deg = np.degrees(np.arcsin(random.uniform(-1, 1, 1000)))
    lon_deg = random.uniform(-180, 180, 1000)
    assert usual_mistakes(of_places(*zip(lat_deg.tolist(), lon_deg.tolist(), strict=True))) == ()


def test_an_image_that_no_battery_can_pay_is_named() -> None:
    asked = optical()
    targets = (replace(asked.targets[0], collect_s=9e5), *asked.targets[1:])
    small = replace(asked.satellites[0].resources, collect_fill_per_s=0.0)
    satellites = (replace(asked.satellites[0], resources=small),)
    (warning,) = but_long(replace(asked, targets=targets, satellites=satellites))
    assert "more energy" in warning
    assert repr(targets[0].id) in warning
