"""The cubic path follows SGP4, and SGP4's errors stop it by name."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from sgp4.api import jday

from planner_core.domain import OrbitElements
from planner_core.errors import PropagationFailed
from planner_core.orbits.ephemeris import check_propagation, propagate
from planner_core.orbits.sgp4_record import satrec
from tests.geometry import YEAR_2019, SkyfieldPath, hours, orbit, satellite


@pytest.mark.parametrize(
    ("elements", "within_m"),
    [
        (orbit(), 0.5),
        (orbit(mean_motion_rev_day=2.006, eccentricity=0.74, inclination_deg=63.4), 0.1),
        (orbit(mean_motion_rev_day=13.0, eccentricity=0.09), 0.5),
        (orbit(mean_motion_rev_day=1.0027, eccentricity=0.0002, inclination_deg=0.05), 0.01),
    ],
    ids=["paper", "molniya", "eccentric", "geostationary"],
)
def test_positions_between_nodes_follow_sgp4(elements: OrbitElements, within_m: float) -> None:
    path = propagate(satellite(elements), hours(24))
    t = np.arange(1.0, 86400.0, 7.0)
    jd, fraction = jday(2019, 1, 1, 0, 0, 0)
    _, exact_km, _ = satrec(elements).sgp4_array(np.full_like(t, jd), fraction + t / 86400.0)
    position, _ = path.state_teme(t)
    assert np.linalg.norm(position - exact_km * 1000.0, axis=1).max() < within_m


@pytest.mark.parametrize("year", [2001, 2012, 2019, 2024])
def test_earth_fixed_positions_agree_with_skyfield(year: int) -> None:
    """Within a metre, including its own precession, nutation and UT1."""
    start = datetime(year, 3, 1, tzinfo=UTC)
    elements = orbit(epoch=start)
    path = propagate(satellite(elements), hours(24, start))
    t = np.arange(0.0, 86400.0, 301.0)
    position, _ = path.state_itrf(t)
    away_m = position - SkyfieldPath(elements, hours(24, start)).position_m(t)
    assert np.linalg.norm(away_m, axis=1).max() < 1.0


def test_earth_fixed_velocity_is_the_rate_of_position_up_to_the_ends() -> None:
    path = propagate(satellite(), hours(2))
    t = np.arange(0.5, 7200.0, 13.0)
    ahead, behind = path.state_itrf(t + 0.5)[0], path.state_itrf(t - 0.5)[0]
    assert np.abs(ahead - behind - path.state_itrf(t)[1]).max() < 0.01


def test_directions_turn_with_the_earth_and_back() -> None:
    path = propagate(satellite(), hours(5))
    t = np.array([0.0, 1234.5, 18000.0])
    vector = np.eye(3)
    assert np.abs(path.to_itrf(path.to_teme(vector, t), t) - vector).max() < 1e-11
    assert np.allclose(path.to_teme(path.state_itrf(t)[0], t), path.state_teme(t)[0], atol=2.0)


def test_a_horizon_shorter_than_a_step_ends_on_time() -> None:
    path = propagate(satellite(), hours(12.0 / 3600.0))
    assert path.node_s[-1] == path.duration_s == 12.0
    assert np.isfinite(path.velocity_itrf_m_s).all()


def test_a_decayed_orbit_stops_with_name_and_code() -> None:
    low = orbit(mean_motion_rev_day=16.4, bstar=0.1)
    with pytest.raises(PropagationFailed) as caught:
        propagate(satellite(low, name="FALLEN"), hours(24 * 20))
    assert caught.value.satellite == "FALLEN"
    assert caught.value.sgp4_code in range(1, 7)
    assert "FALLEN" in caught.value.detail
    with pytest.raises(PropagationFailed):
        check_propagation(satellite(low, name="FALLEN"), hours(24 * 20))


def test_a_sound_orbit_passes_the_check() -> None:
    check_propagation(satellite(), hours(24, YEAR_2019))
