"""Frames: TEME (SGP4's own), the Earth-fixed ITRF, and geodetic coordinates.

Vectors are in metres unless they are directions. The Earth's orientation is the one that Vallado
(AIAA 2006-6753) prescribes for SGP4: GMST of 1982 in UT1, then small-angle polar motion.
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

EARTH_RADIUS_M = 6_378_137.0
EARTH_POLAR_RADIUS_M = 6_356_752.314245
EARTH_ROTATION_RAD_S = 7.292115146706979e-5
ARCSEC_RAD = np.pi / 648_000.0

_FLATTENING = 1.0 / 298.257223563
_E2 = _FLATTENING * (2.0 - _FLATTENING)
_MIDNIGHT_2000 = datetime(2000, 1, 1, tzinfo=UTC)
_JD_J2000 = 2_451_545.0


def julian_date(instant: datetime) -> tuple[float, float]:
    """Return the Julian date as midnight and the fraction of the day since.

    >>> julian_date(datetime(2000, 1, 1, 12, tzinfo=UTC))
    (2451544.5, 0.5)
    """
    elapsed = instant - _MIDNIGHT_2000
    seconds = elapsed.seconds + elapsed.microseconds * 1e-6
    return _JD_J2000 - 0.5 + elapsed.days, seconds / 86400.0


def gmst82_rad(jd_midnight: float, fraction: Floats) -> Floats:
    """Return Greenwich mean sidereal time (IAU 1982).

    The angle grows steadily with ``fraction`` (no jump at 2 pi), so that it may be interpolated.

    Parameters
    ----------
    jd_midnight
        A Julian date in UT1 ending in .5.
    fraction
        Days in UT1 since then. Shape ``(n,)``.
    """
    centuries = (jd_midnight - _JD_J2000 + fraction) / 36525.0
    slow_s = (
        67310.54841 + 8640184.812866 * centuries + 0.093104 * centuries**2 - 6.2e-6 * centuries**3
    )
    # The formula's 876600 h per century are one rotation a day: only the part of the day is added,
    # as whole rotations would cost digits. Julian days begin at noon, hence the half.
    start_s = slow_s[:1] % 86400.0
    seconds = start_s + (slow_s - slow_s[:1]) + 86400.0 * (fraction - 0.5)
    return np.asarray(seconds * (2.0 * np.pi / 86400.0))


def teme_to_itrf(
    position: Floats, velocity: Floats, gmst_rad: Floats, xp_rad: Floats, yp_rad: Floats
) -> tuple[Floats, Floats]:
    """Return Earth-fixed position and velocity relative to the rotating Earth.

    Parameters
    ----------
    position, velocity
        In TEME, any length unit, and the same per second. Shape ``(n, 3)``.
    gmst_rad, xp_rad, yp_rad
        Sidereal time and polar motion at each instant. Shape ``(n,)``.
    """
    fixed = _turn_z(position, gmst_rad)
    moving = _turn_z(velocity, gmst_rad)
    moving[:, 0] += EARTH_ROTATION_RAD_S * fixed[:, 1]
    moving[:, 1] -= EARTH_ROTATION_RAD_S * fixed[:, 0]
    return _polar(fixed, xp_rad, yp_rad), _polar(moving, xp_rad, yp_rad)


def rotate_to_itrf(vector: Floats, gmst_rad: Floats, xp_rad: Floats, yp_rad: Floats) -> Floats:
    """Return TEME vectors in Earth-fixed axes. Shapes ``(n, 3)`` and ``(n,)``."""
    return _polar(_turn_z(vector, gmst_rad), xp_rad, yp_rad)


def itrf_to_teme(vector: Floats, gmst_rad: Floats, xp_rad: Floats, yp_rad: Floats) -> Floats:
    """Return Earth-fixed vectors in TEME axes. Shapes ``(n, 3)`` and ``(n,)``."""
    return _turn_z(_polar(vector, -xp_rad, -yp_rad), -gmst_rad)


def _turn_z(vector: Floats, angle_rad: Floats) -> Floats:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z = vector[:, 0], vector[:, 1], vector[:, 2]
    return np.stack([c * x + s * y, c * y - s * x, z], axis=1)


def _polar(vector: Floats, xp_rad: Floats, yp_rad: Floats) -> Floats:
    x, y, z = vector[:, 0], vector[:, 1], vector[:, 2]
    return np.stack(
        [x + xp_rad * z, y - yp_rad * z, z - xp_rad * x + yp_rad * y], axis=1
    )  # fmt: skip


def unit(vector: Floats) -> Floats:
    """Return the directions of vectors. Shape ``(n, 3)``."""
    return np.asarray(vector / np.linalg.norm(vector, axis=1)[:, None])


def geodetic_to_itrf(lon_deg: Floats, lat_deg: Floats, alt_m: Floats) -> Floats:
    """Return positions of points on or above the WGS84 ellipsoid. Shape ``(n, 3)``."""
    lon, lat = np.radians(lon_deg), np.radians(lat_deg)
    curvature_m = EARTH_RADIUS_M / np.sqrt(1.0 - _E2 * np.sin(lat) ** 2)
    across = (curvature_m + alt_m) * np.cos(lat)
    up = (curvature_m * (1.0 - _E2) + alt_m) * np.sin(lat)
    return np.stack([across * np.cos(lon), across * np.sin(lon), up], axis=1)


def itrf_to_geodetic(position: Floats) -> tuple[Floats, Floats, Floats]:
    """Return longitude (deg), latitude (deg) and altitude (m) above WGS84. Shape ``(n,)``."""
    x, y, z = position[:, 0], position[:, 1], position[:, 2]
    across = np.hypot(x, y)
    sine, cosine = _latitude(across, z)
    # This form of the altitude is as accurate at the poles as at the equator.
    alt_m = across * cosine + z * sine - EARTH_RADIUS_M * np.sqrt(1.0 - _E2 * sine**2)
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(sine, cosine)), alt_m


def geodetic_normal(position: Floats) -> Floats:
    """Return the ellipsoid's outward normal below (or at) each position. Shape ``(n, 3)``."""
    x, y, z = position[:, 0], position[:, 1], position[:, 2]
    across = np.hypot(x, y)
    sine, cosine = _latitude(across, z)
    ratio = cosine / np.maximum(across, 1e-6)
    return np.stack([ratio * x, ratio * y, sine], axis=1)


def _latitude(across: Floats, z: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine of the geodetic latitude, by Bowring's method.

    Two iterations are exact to 1e-12 rad from the ground to the geostationary belt.
    """
    ratio = EARTH_POLAR_RADIUS_M / EARTH_RADIUS_M
    reduced = latitude = _normalised(z, across * ratio)
    for _ in range(2):
        sine, cosine = reduced
        latitude = _normalised(
            z + _E2 / ratio * EARTH_RADIUS_M * sine**3, across - _E2 * EARTH_RADIUS_M * cosine**3
        )
        reduced = _normalised(ratio * latitude[0], latitude[1])
    return latitude


def _normalised(sine: Floats, cosine: Floats) -> tuple[Floats, Floats]:
    length = np.hypot(sine, cosine)
    return np.asarray(sine / length), np.asarray(cosine / length)


def up_east_north(lon_deg: Floats, lat_deg: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the local unit vectors of the geodetic horizon, Earth-fixed. Shape ``(n, 3)``."""
    lon, lat = np.radians(lon_deg), np.radians(lat_deg)
    zero = np.zeros_like(lon)
    up = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)
    east = np.stack([-np.sin(lon), np.cos(lon), zero], axis=1)
    north = np.stack([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)], axis=1)
    return up, east, north
