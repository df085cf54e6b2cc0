"""Frames agree with published numbers and with each other."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.orbits import frames


def test_teme_to_itrf_reproduces_vallados_example() -> None:
    """AIAA 2006-6753, 2004-04-06 07:51:28.386009 UTC: to 5 cm."""
    jd, fraction = frames.julian_date(datetime(2004, 4, 6, 7, 51, 28, 386009, tzinfo=UTC))
    gmst = frames.gmst82_rad(jd, np.array([fraction - 0.439962 / 86400.0]))
    position, velocity = frames.teme_to_itrf(
        np.array([[5094.18016210, 6127.64465950, 6380.34453270]]) * 1000.0,
        np.array([[-4.7461314870, 0.7858180410, 5.5319312880]]) * 1000.0,
        gmst,
        np.array([-0.140682]) * frames.ARCSEC_RAD,
        np.array([0.333309]) * frames.ARCSEC_RAD,
    )
    expected = np.array([[-1033.47938300, 7901.29527540, 6380.35659580]]) * 1000.0
    assert np.abs(position - expected).max() < 0.05
    expected = np.array([[-3.2256365200, -2.8724514500, 5.5319244460]]) * 1000.0
    assert np.abs(velocity - expected).max() < 1e-3


def test_gmst_grows_by_one_sidereal_day_without_jumps() -> None:
    jd, fraction = frames.julian_date(datetime(2026, 1, 1, tzinfo=UTC))
    turned = np.diff(frames.gmst82_rad(jd, fraction + np.arange(0.0, 31.0)))
    assert np.allclose(turned, 2.0 * np.pi * 1.00273790935, rtol=0, atol=1e-9)


@given(st.integers(-(43 * 366 * 86400), 56 * 366 * 86400), st.integers(0, 999_999))
def test_julian_date_counts_days_from_midnight(seconds: int, microseconds: int) -> None:
    instant = datetime(2000, 1, 1, tzinfo=UTC) + timedelta(0, seconds, microseconds)
    jd, fraction = frames.julian_date(instant)
    assert jd % 1.0 == 0.5
    assert 0.0 <= fraction < 1.0
    days = jd - 2_451_544.5 + fraction
    back = datetime(2000, 1, 1, tzinfo=UTC) + timedelta(days=days)
    assert abs((back - instant).total_seconds()) < 1e-4


@given(st.floats(-180.0, 180.0), st.floats(-90.0, 90.0), st.floats(-500.0, 4e7))
def test_geodetic_coordinates_come_back(lon: float, lat: float, alt: float) -> None:
    position = frames.geodetic_to_itrf(np.array([lon]), np.array([lat]), np.array([alt]))
    found = frames.itrf_to_geodetic(position)
    again = frames.geodetic_to_itrf(*found)
    assert np.abs(again - position).max() < 1e-6
    assert abs(found[1][0] - lat) < 1e-10
    assert abs(found[2][0] - alt) < 1e-6


@given(st.floats(-180.0, 180.0), st.floats(-90.0, 90.0))
def test_local_axes_are_right_handed(lon: float, lat: float) -> None:
    up, east, north = frames.up_east_north(np.array([lon]), np.array([lat]))
    assert np.allclose(np.cross(east, north), up)
    assert np.allclose(np.cross(up, east), north)
    assert east[0, 2] == 0.0
    assert north[0, 2] >= 0.0


@given(st.floats(0.0, 6.3), st.floats(-2e-6, 2e-6), st.floats(-2e-6, 2e-6))
def test_inertial_axes_come_back(gmst: float, xp: float, yp: float) -> None:
    vector = np.array([[0.6, -0.48, 0.64]])
    angles = (np.array([gmst]), np.array([xp]), np.array([yp]))
    again = frames.itrf_to_teme(frames.rotate_to_itrf(vector, *angles), *angles)
    assert np.abs(again - vector).max() < 1e-11
