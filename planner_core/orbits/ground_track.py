"""What maps show of a satellite: the points below it, and where a station can see it."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from planner_core.domain import GroundStation
from planner_core.orbits import frames
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.mask import mask_elevation_deg
from planner_core.orbits.sites import Sites

Floats = npt.NDArray[np.float64]

_NUM_DIRECTIONS: Final = 72  # of the compass


def sub_points(ephemeris: Ephemeris, t_s: Floats) -> tuple[Floats, Floats, Floats]:
    """Return longitude (deg), latitude (deg) and altitude (m) of the satellite.

    Parameters
    ----------
    t_s
        Instants in the horizon. Shape ``(n,)``, like each result.
    """
    position_m, _ = ephemeris.state_itrf(t_s)
    return frames.itrf_to_geodetic(position_m)


def visibility_ring(station: GroundStation, altitude_m: float) -> tuple[Floats, Floats]:
    """Return the border of the area over which a satellite is within a station's limits.

    Parameters
    ----------
    station
        Its elevation mask and its minimum elevation both count.
    altitude_m
        Of the satellite above the ellipsoid; greater than the station's.

    Returns
    -------
    Longitude and latitude in degrees, counter-clockwise from north; the first point is not
    repeated. Shape ``(72,)``.
    """
    azimuth_deg = np.linspace(0.0, -360.0, _NUM_DIRECTIONS, endpoint=False)
    elevation_deg = np.full(_NUM_DIRECTIONS, station.min_elevation_deg)
    if station.elevation_mask:
        above = mask_elevation_deg(station.elevation_mask, azimuth_deg)
        elevation_deg = np.maximum(elevation_deg, above)
    azimuth, elevation = np.radians(azimuth_deg)[:, None], np.radians(elevation_deg)[:, None]
    site = Sites.of([station])
    level = np.sin(azimuth) * site.east + np.cos(azimuth) * site.north
    sight = np.cos(elevation) * level + np.sin(elevation) * site.up
    lon_deg, lat_deg, _ = frames.itrf_to_geodetic(_at_altitude(site.position_m, sight, altitude_m))
    return lon_deg, lat_deg


def _at_altitude(start_m: Floats, direction: Floats, altitude_m: float) -> Floats:
    """Return where rays that start below an altitude reach it.

    Points of equal altitude lie on an ellipsoid to within metres; scaled to a unit sphere, that
    gives a quadratic equation.
    """
    axes_m = np.array([frames.EARTH_RADIUS_M] * 2 + [frames.EARTH_POLAR_RADIUS_M]) + altitude_m
    p, d = start_m / axes_m, direction / axes_m
    a = np.sum(d * d, axis=1)
    half_b = np.sum(p * d, axis=1)
    c = np.sum(p * p, axis=1) - 1.0
    length_m = (np.sqrt(half_b**2 - a * c) - half_b) / a
    return np.asarray(start_m + length_m[:, None] * direction)
