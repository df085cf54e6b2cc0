"""The demonstration's mission is the paper's, and the same every time."""

from __future__ import annotations

from datetime import UTC, datetime

from planner_core.orbits.omm import elements_from_omm
from service.catalogs.wrs2 import wrs2_land_csv
from service.commands.demo_mission import HORIZON, SATELLITE, targets_csv


def test_targets_are_a_thousand_different_shipped_scenes() -> None:
    drawn = targets_csv().splitlines()[1:]
    assert len(set(drawn)) == 1000
    assert set(drawn) <= set(wrs2_land_csv().splitlines())


def test_the_same_seed_draws_the_same_targets_and_another_seed_others() -> None:
    assert targets_csv(20, seed=1) == targets_csv(20, seed=1)
    assert targets_csv(20, seed=1) != targets_csv(20, seed=2)


def test_the_orbit_is_the_papers() -> None:
    orbit = elements_from_omm(SATELLITE["omm"])
    assert orbit.epoch == datetime(2019, 1, 1, tzinfo=UTC)
    assert (orbit.inclination_deg, orbit.eccentricity) == (90.0, 0.001)
    assert orbit.mean_motion_rev_day == 15.24162312
    assert HORIZON["start"] == "2019-01-01T00:00:00Z"
