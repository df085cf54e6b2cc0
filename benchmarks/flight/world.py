"""Positions of satellite, sites and sun in SGP4's own frame (TEME), by independent formulas.

Earth turns by GMST of 1982, without polar motion and with UT1 = UTC (together below 0.002 deg);
the sun is the Astronomical Almanac's low-precision one (0.01 deg).
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numba
import numpy as np
from sgp4.api import jday

from benchmarks.flight.mission import Floats, Mission

EARTH_RATE_RAD_S: Final = 7.2921158553e-5
AU_KM: Final = 149_597_870.7
_STEP_S: Final = 10.0  # between calls of SGP4; cubic in between, at most 0.3 m off


class Orbit(NamedTuple):
    """SGP4's states at even steps, and the Earth's rotation angle at the first.

    Attributes
    ----------
    position_km, velocity_km_s
        TEME. Shape ``(n, 3)``.
    """

    step_s: float
    gmst_rad: float
    position_km: Floats
    velocity_km_s: Floats


def orbit(mission: Mission) -> Orbit:
    """Return the satellite's states over the flight, and some beyond it."""
    times_s = np.arange(0.0, mission.duration_s + 600.0, _STEP_S)
    start = mission.start
    day, fraction = jday(start.year, start.month, start.day, start.hour, start.minute,
                         start.second + start.microsecond * 1e-6)  # fmt: skip
    errors, position_km, velocity_km_s = mission.elements.sgp4_array(
        np.full(len(times_s), day), fraction + times_s / 86_400.0
    )
    if errors.any():
        raise ValueError(f"SGP4 does not carry {mission.name} over the whole flight")
    return Orbit(_STEP_S, _gmst_rad(day, fraction), position_km, velocity_km_s)


def _gmst_rad(day: float, fraction: float) -> float:
    """Return Greenwich mean sidereal time of 1982 (Aoki et al. 1982)."""
    centuries = (day - 2451545.0 + fraction) / 36525.0
    seconds = (
        67310.54841
        + (876600.0 * 3600.0 + 8640184.812866) * centuries
        + 0.093104 * centuries**2
        - 6.2e-6 * centuries**3
    )
    return math.radians(seconds / 240.0 % 360.0)


def sun_km(mission: Mission, time_s: float) -> Floats:
    """Return the sun's position, of date (Astronomical Almanac, section C). Shape ``(3,)``."""
    since = mission.start.timestamp() + time_s
    days = since / 86_400.0 + 2440587.5 - 2451545.0
    anomaly = math.radians((357.528 + 0.9856003 * days) % 360.0)
    longitude = math.radians(
        (280.460 + 0.9856474 * days + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly))
        % 360.0
    )
    obliquity = math.radians(23.439 - 4e-7 * days)
    distance = 1.00014 - 0.01671 * math.cos(anomaly) - 0.00014 * math.cos(2 * anomaly)
    return (AU_KM * distance) * np.array(
        [
            math.cos(longitude),
            math.cos(obliquity) * math.sin(longitude),
            math.sin(obliquity) * math.sin(longitude),
        ]
    )


@numba.njit(cache=True)
def satellite_km(where: Any, time_s: float) -> tuple[Floats, Floats]:
    """Return position and velocity between SGP4's states, by a cubic."""
    row = min(int(time_s / where.step_s), len(where.position_km) - 2)
    u, h = time_s / where.step_s - row, where.step_s
    p0, p1 = where.position_km[row], where.position_km[row + 1]
    v0, v1 = where.velocity_km_s[row] * h, where.velocity_km_s[row + 1] * h
    a, b = 2.0 * (p0 - p1) + v0 + v1, 3.0 * (p1 - p0) - 2.0 * v0 - v1
    position = ((a * u + b) * u + v0) * u + p0
    return position, ((3.0 * a * u + 2.0 * b) * u + v0) / h


@numba.njit(cache=True)
def site_km(where: Any, ecef_km: Floats, time_s: float) -> Floats:
    """Return an Earth-fixed point or direction in TEME."""
    angle = where.gmst_rad + EARTH_RATE_RAD_S * time_s
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = ecef_km
    return np.array([c * x - s * y, s * x + c * y, z])


@numba.njit(cache=True)
def line_of_sight(where: Any, ecef_km: Floats, time_s: float) -> tuple[Floats, Floats]:
    """Return the direction from satellite to site, and its rate of turn, rad/s."""
    position, velocity = satellite_km(where, time_s)
    site = site_km(where, ecef_km, time_s)
    site_velocity = EARTH_RATE_RAD_S * np.array([-site[1], site[0], 0.0])
    to_site, change = site - position, site_velocity - velocity
    distance = math.sqrt((to_site**2).sum())
    return to_site / distance, np.cross(to_site, change) / distance**2


@numba.njit(cache=True)
def elevation_deg(where: Any, ecef_km: Floats, up: Floats, time_s: float) -> float:
    """Return the satellite's elevation above a site's horizon."""
    direction, _ = line_of_sight(where, ecef_km, time_s)
    height = -(direction * site_km(where, up, time_s)).sum()
    return math.degrees(math.asin(min(1.0, max(-1.0, height))))
