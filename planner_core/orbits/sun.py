"""The direction to the sun, and the Earth's shadow.

The direction is the Astronomical Almanac's low-precision formula (0.01 deg from 1950 to
2050), in axes of mean equator and equinox of date, which differ from TEME by nutation only
(0.005 deg). The shadow is a cylinder behind a sphere of the Earth's equatorial radius: the
sun is a point, so there is no penumbra, and there is no refraction.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from planner_core.domain import Horizon
from planner_core.orbits.frames import EARTH_RADIUS_M, julian_date
from planner_core.problem.sun_turns import SunPath

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_PATH_STEP_S = 3600.0
"""The sun moves by 0.04 deg in that time, so linear interpolation between directions suffices."""


def sun_direction_teme(jd_midnight: float, fraction: Floats) -> Floats:
    """Return unit vectors from the Earth to the sun.

    Parameters
    ----------
    jd_midnight, fraction
        Julian date in UTC: a day, and the days since. ``fraction`` has shape ``(n,)``.

    Returns
    -------
    Directions in TEME. Shape ``(n, 3)``.
    """
    days = jd_midnight - 2_451_545.0 + fraction
    anomaly = np.radians(357.528 + 0.9856003 * days)
    longitude = np.radians(
        280.460 + 0.9856474 * days + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2.0 * anomaly)
    )
    obliquity = np.radians(23.439 - 4e-7 * days)
    return np.stack(
        [
            np.cos(longitude),
            np.cos(obliquity) * np.sin(longitude),
            np.sin(obliquity) * np.sin(longitude),
        ],
        axis=1,
    )


def sun_path(horizon: Horizon) -> SunPath:
    """Return the direction to the sun over a horizon."""
    num_steps = max(1, math.ceil(horizon.duration_s / _PATH_STEP_S))
    midnight, start = julian_date(horizon.start)
    t_s = np.linspace(0.0, horizon.duration_s, num_steps + 1)
    return SunPath(
        step_s=horizon.duration_s / num_steps,
        directions=sun_direction_teme(midnight, start + t_s / 86400.0),
    )


def is_in_shadow(position_m: Floats, sun: Floats) -> Bools:
    """Return whether each position is in the Earth's cylindrical shadow.

    Parameters
    ----------
    position_m, sun
        Satellite position and direction to the sun, in the same axes. Shape ``(n, 3)``.
    """
    along = np.einsum("ij,ij->i", position_m, sun)
    across2 = np.einsum("ij,ij->i", position_m, position_m) - along**2
    return np.asarray((along < 0.0) & (across2 < EARTH_RADIUS_M**2))
