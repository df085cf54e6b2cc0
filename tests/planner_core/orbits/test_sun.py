"""The sun and the Earth's shadow agree with Skyfield's ephemeris."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from planner_core.domain import Horizon
from planner_core.orbits.eclipse import always_sunlit, sunlight
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.frames import julian_date
from planner_core.orbits.sun import is_in_shadow, sun_direction_teme
from tests.geometry import Floats, hours, orbit, orbit_from_tle, satellite


@pytest.mark.parametrize(
    ("instant", "right_ascension_deg", "declination_deg"),
    [
        # Meeus, Astronomical Algorithms, example 25.a (apparent place, 0h dynamical time).
        (datetime(1992, 10, 13, tzinfo=UTC), 198.38083, -7.78507),
        # Equinox and solstice of 2024: the sun's longitude is 0 and 90 deg.
        (datetime(2024, 3, 20, 3, 6, 24, tzinfo=UTC), 0.0, 0.0),
        (datetime(2024, 6, 20, 20, 51, 0, tzinfo=UTC), 90.0, 23.4385),
    ],
)
def test_sun_stands_where_the_almanac_says(
    instant: datetime, right_ascension_deg: float, declination_deg: float
) -> None:
    jd, fraction = julian_date(instant)
    sun = sun_direction_teme(jd, np.array([fraction]))[0]
    ra, dec = np.radians(right_ascension_deg), np.radians(declination_deg)
    expected = np.array([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)])
    assert np.degrees(np.linalg.norm(sun - expected)) < 0.015


def test_shadow_is_a_cylinder_behind_the_earth() -> None:
    sun = np.tile([1.0, 0.0, 0.0], (4, 1))
    position = np.array([[-7e6, 0, 0], [7e6, 0, 0], [-7e6, 6.37e6, 0], [-7e6, 0, 6.39e6]])
    assert is_in_shadow(position, sun).tolist() == [True, False, True, False]


@pytest.mark.parametrize("case", ["case_0001", "case_0002"])
def test_sunlit_windows_are_those_of_skyfield(shared_data: Path, case: str) -> None:
    """Every window, its edges to 3 s: the reference is given in whole seconds."""
    folder = shared_data / "refs/skyfield" / case
    lines = iter((folder / "satellites.yaml").read_text().splitlines())
    start = datetime(2025, 7, 17, 12, tzinfo=UTC)
    horizon = Horizon(start=start, end=start + timedelta(days=1))
    reference = {
        item["satellite_id"]: item["sunlit_windows"]
        for item in json.loads((folder / "illumination_windows.json").read_text())["satellites"]
    }
    num_windows = 0
    for line in lines:
        if not line.startswith("- id:"):
            continue
        tle = [next(lines).split(": ", 1)[1] for _ in range(2)]
        lit = sunlight(propagate(satellite(orbit_from_tle(*tle)), horizon))
        expected = np.array(
            [
                [
                    horizon.offset_s(datetime.fromisoformat(w[key]))
                    for key in ("start_utc", "end_utc")
                ]
                for w in reference[line.split(": ")[1]]
            ]
        )
        assert len(lit.enter_s) == len(expected)
        assert np.abs(lit.enter_s - expected[:, 0]).max() < 3.0
        assert np.abs(lit.exit_s - expected[:, 1]).max() < 3.0
        num_windows += len(expected)
    assert num_windows > 20


def test_sunlight_and_shadow_agree_at_every_instant() -> None:
    path = propagate(satellite(orbit(raan_deg=100.0)), hours(24))
    lit = sunlight(path)
    t = np.arange(0.5, 86400.0, 10.0)
    sun = path.sun_itrf(t)
    row = np.searchsorted(lit.enter_s, t, side="right") - 1
    inside = (row >= 0) & (t < lit.exit_s[row])
    assert (inside != is_in_shadow(path.state_itrf(t)[0], sun)).all()
    assert 0.5 < inside.mean() < 0.8


def test_an_orbit_that_only_grazes_the_shadow_keeps_its_short_eclipse() -> None:
    """Between an orbit with an eclipse and one without, some orbit has an eclipse of seconds."""

    def eclipses(raan_deg: float) -> Floats:
        lit = sunlight(
            propagate(satellite(orbit(inclination_deg=113.0, raan_deg=raan_deg)), hours(2.5))
        )
        return lit.enter_s[1:] - lit.exit_s[:-1]

    without, within = 11.0, 100.0
    assert len(eclipses(without)) == 0
    assert len(eclipses(within)) > 0
    for _ in range(22):
        middle = 0.5 * (without + within)
        if len(eclipses(middle)) > 0:
            within = middle
        else:
            without = middle
    assert eclipses(within).min() < 30.0


def test_always_sunlit_covers_the_horizon() -> None:
    assert always_sunlit(10.0).seconds_until(np.array([0.0, 4.0, 10.0])).tolist() == [0, 4, 10]
