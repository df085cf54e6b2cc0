"""Sites on the ground, and how a satellite is seen from them (and they from it)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from planner_core.domain import Nadir
from planner_core.orbits import frames
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.sun import is_in_shadow

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]

_HALF_STEP_S = 0.5


class _Point(Protocol):
    @property
    def lon_deg(self) -> float: ...
    @property
    def lat_deg(self) -> float: ...
    @property
    def alt_m(self) -> float: ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sites:
    """Points on the ground with their geodetic horizon, Earth-fixed. Shape ``(n, 3)`` each."""

    position_m: Floats
    up: Floats
    east: Floats
    north: Floats
    lon_deg: Floats

    @classmethod
    def of(cls, points: Sequence[_Point]) -> Sites:
        """Return the sites of targets or stations, in their order."""
        lon, lat, alt = (
            np.array([getattr(point, name) for point in points], dtype=np.float64)
            for name in ("lon_deg", "lat_deg", "alt_m")
        )
        up, east, north = frames.up_east_north(lon, lat)
        position = frames.geodetic_to_itrf(lon, lat, alt)
        return cls(position_m=position, up=up, east=east, north=north, lon_deg=lon)

    def __len__(self) -> int:
        return len(self.position_m)

    def at(self, rows: npt.NDArray[np.integer]) -> Sites:
        """Return the sites in these rows (repeats allowed)."""
        return Sites(
            position_m=self.position_m.take(rows, axis=0),
            up=self.up.take(rows, axis=0),
            east=self.east.take(rows, axis=0),
            north=self.north.take(rows, axis=0),
            lon_deg=self.lon_deg[rows],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """The geometry between a satellite and a site at an instant, one row for each pair.

    Attributes
    ----------
    off_nadir_deg, elevation_deg, azimuth_deg, range_m
        At the satellite; at the site; at the site, from north over east; between both.
    sun_elevation_deg, in_eclipse
        Of the sun at the site; whether the satellite is in the Earth's shadow.
    """

    off_nadir_deg: Floats
    elevation_deg: Floats
    azimuth_deg: Floats
    range_m: Floats
    sun_elevation_deg: Floats
    in_eclipse: Bools


def view(ephemeris: Ephemeris, sites: Sites, t_s: Floats, nadir: Nadir) -> View:
    """Return the geometry of row ``i``'s site at ``t_s[i]``. Shape ``(n,)``."""
    position, _ = ephemeris.state_itrf(t_s)
    vertical = frames.geodetic_normal(position) if nadir == "geodetic" else frames.unit(position)
    sight = position - sites.position_m
    range_m = np.sqrt(_row_dot(sight, sight))
    azimuth, elevation = _azimuth_elevation_deg(sight, sites)
    sun = ephemeris.sun_itrf(t_s)
    return View(
        off_nadir_deg=_angle_deg(_row_dot(vertical, sight) / range_m),
        elevation_deg=elevation,
        azimuth_deg=azimuth,
        range_m=range_m,
        sun_elevation_deg=90.0 - _angle_deg(_row_dot(sites.up, sun)),
        in_eclipse=is_in_shadow(position, sun),
    )


def azimuth_elevation_deg(ephemeris: Ephemeris, sites: Sites, t_s: Floats) -> tuple[Floats, Floats]:
    """Return the satellite's azimuth, in [0, 360), and elevation as seen from each site."""
    position, _ = ephemeris.state_itrf(t_s)
    return _azimuth_elevation_deg(position - sites.position_m, sites)


def elevations_deg(ephemeris: Ephemeris, sites: Sites, t_s: Floats) -> Floats:
    """Return the satellite's elevation as seen from each site."""
    position, _ = ephemeris.state_itrf(t_s)
    east, north, up = _east_north_up(position - sites.position_m, sites)
    return np.degrees(np.arctan2(up, np.hypot(east, north)))


def _azimuth_elevation_deg(sight: Floats, sites: Sites) -> tuple[Floats, Floats]:
    east, north, up = _east_north_up(sight, sites)
    azimuth = np.degrees(np.arctan2(east, north)) % 360.0
    return azimuth, np.degrees(np.arctan2(up, np.hypot(east, north)))


def _east_north_up(sight: Floats, sites: Sites) -> tuple[Floats, Floats, Floats]:
    return _row_dot(sight, sites.east), _row_dot(sight, sites.north), _row_dot(sight, sites.up)


def line_of_sight_teme(ephemeris: Ephemeris, sites: Sites, t_s: Floats) -> Floats:
    """Return unit vectors from the satellite to row ``i``'s site, inertial. ``(n, 3)``."""
    position, _ = ephemeris.state_itrf(t_s)
    return ephemeris.to_teme(frames.unit(sites.position_m - position), t_s)


def los_rate_deg_s(ephemeris: Ephemeris, sites: Sites, t_s: Floats) -> Floats:
    """Return the angular velocities of lines of sight, in deg/s, inertial. Shape ``(n, 3)``.

    From the rotation between half a second before and half a second after, clipped to the horizon.
    It does not include rotation about the line of sight.
    """
    before_s = np.maximum(t_s - _HALF_STEP_S, 0.0)
    after_s = np.minimum(t_s + _HALF_STEP_S, ephemeris.duration_s)
    before = line_of_sight_teme(ephemeris, sites, before_s)
    after = line_of_sight_teme(ephemeris, sites, after_s)
    # An angle this small equals its sine.
    turned = np.degrees(np.cross(before, after))
    return np.asarray(turned / (after_s - before_s)[:, None])


def _row_dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _angle_deg(cosine: Floats) -> Floats:
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
