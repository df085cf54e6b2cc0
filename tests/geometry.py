"""Factories of orbits and ground points, and a second, plain computation of visibility.

Everything below the factories is independent of the planner's own geometry: positions come
from Skyfield, and limits are judged from vectors one instant at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cache, lru_cache

import numpy as np
import numpy.typing as npt
from sgp4.api import WGS72, Satrec
from sgp4.conveniences import sat_epoch_datetime
from skyfield.api import EarthSatellite, load, wgs84
from skyfield.framelib import itrs
from skyfield.timelib import Time, Timescale

from planner_core.domain import (
    Horizon,
    OrbitElements,
    Resources,
    Satellite,
    Sensor,
)
from planner_core.orbits.earth_orientation import shipped
from planner_core.orbits.sgp4_record import satrec

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

YEAR_2019 = datetime(2019, 1, 1, tzinfo=UTC)


def hours(count: float, start: datetime = YEAR_2019) -> Horizon:
    return Horizon(start=start, end=start + timedelta(hours=count))


def orbit(
    *,
    epoch: datetime = YEAR_2019,
    mean_motion_rev_day: float = 15.24162312,
    eccentricity: float = 0.001,
    inclination_deg: float = 90.0,
    raan_deg: float = 0.0,
    arg_perigee_deg: float = 0.0,
    mean_anomaly_deg: float = 0.0,
    bstar: float = 0.0,
) -> OrbitElements:
    """Return the given orbit; by default the paper's."""
    return OrbitElements(
        name="paper",
        norad_cat_id=1,
        object_id="",
        epoch=epoch,
        mean_motion_rev_day=mean_motion_rev_day,
        eccentricity=eccentricity,
        inclination_deg=inclination_deg,
        raan_deg=raan_deg,
        arg_perigee_deg=arg_perigee_deg,
        mean_anomaly_deg=mean_anomaly_deg,
        bstar=bstar,
    )


def orbit_from_tle(line1: str, line2: str) -> OrbitElements:
    record = Satrec.twoline2rv(line1, line2, WGS72)
    return orbit(
        epoch=sat_epoch_datetime(record).astimezone(UTC),
        mean_motion_rev_day=record.no_kozai * 1440.0 / (2.0 * math.pi),
        eccentricity=record.ecco,
        inclination_deg=math.degrees(record.inclo),
        raan_deg=math.degrees(record.nodeo),
        arg_perigee_deg=math.degrees(record.argpo),
        mean_anomaly_deg=math.degrees(record.mo),
        bstar=record.bstar,
    )


def orbit_from_omm(record: dict[str, str | float]) -> OrbitElements:
    return orbit(
        epoch=datetime.fromisoformat(str(record["EPOCH"])).replace(tzinfo=UTC),
        mean_motion_rev_day=float(record["MEAN_MOTION"]),
        eccentricity=float(record["ECCENTRICITY"]),
        inclination_deg=float(record["INCLINATION"]),
        raan_deg=float(record["RA_OF_ASC_NODE"]),
        arg_perigee_deg=float(record["ARG_OF_PERICENTER"]),
        mean_anomaly_deg=float(record["MEAN_ANOMALY"]),
        bstar=float(record["BSTAR"]),
    )


def satellite(
    elements: OrbitElements | None = None, *, name: str = "paper", sensor: Sensor | None = None
) -> Satellite:
    elements = elements or orbit()
    return Satellite(
        id=name,
        name=name,
        orbit=elements,
        sensor=sensor or Sensor(),
        resources=Resources.paper(elements.period_s),
    )


@cache
def _timescale() -> Timescale:
    scale = load.timescale(builtin=True)
    pole = shipped()
    terrestrial = pole.mjd + 2_400_000.5 + (pole.tai_utc_s + 32.184) / 86400.0
    scale.polar_motion_table = (
        terrestrial,
        np.degrees(pole.xp_rad) * 3600.0,
        np.degrees(pole.yp_rad) * 3600.0,
    )
    return scale


@lru_cache(maxsize=4)
def _times(start: datetime, after_s: bytes) -> Time:
    """Return instants; cached, because they hold the Earth's orientation, the slowest part."""
    return _timescale().utc(
        start.year, start.month, start.day, start.hour, start.minute,
        start.second + np.frombuffer(after_s),
    )  # fmt: skip


class SkyfieldPath:
    """A satellite's Earth-fixed states by Skyfield, with its own UT1 and our table's pole."""

    def __init__(self, elements: OrbitElements, horizon: Horizon):
        self._satellite = EarthSatellite.from_satrec(satrec(elements), _timescale())
        self._start = horizon.start

    def position_m(self, t_s: Floats) -> Floats:
        """Return positions in the ITRS. Shape ``(n, 3)``."""
        times = _times(self._start, np.asarray(t_s, dtype=np.float64).tobytes())
        found = self._satellite.at(times).frame_xyz(itrs).m
        return np.ascontiguousarray(np.asarray(found, dtype=np.float64).T)


class SkyfieldTable:
    """Skyfield's positions every ten seconds, and cubics between them, good to a centimetre.

    The cubics pass through four positions; they know no velocity.
    """

    step_s = 10.0

    def __init__(self, elements: OrbitElements, horizon: Horizon):
        self.duration_s = horizon.duration_s
        around = np.arange(-1.0, np.ceil(self.duration_s / self.step_s) + 2.0) * self.step_s
        self._position_m = SkyfieldPath(elements, horizon).position_m(around)
        self.seconds = np.arange(0.0, self.duration_s + 0.5)
        self.at_seconds_m = self.position_m(self.seconds)

    def position_m(self, t_s: Floats) -> Floats:
        """Return positions in the ITRS. Shape ``(n, 3)``."""
        steps = t_s / self.step_s
        k = np.minimum(np.floor(steps).astype(np.int64), len(self._position_m) - 4)
        u = (steps - k)[:, None]
        before, here, after, beyond = (self._position_m[k + i] for i in range(4))
        return np.asarray(
            -u * (u - 1) * (u - 2) / 6 * before
            + (u + 1) * (u - 1) * (u - 2) / 2 * here
            - (u + 1) * u * (u - 2) / 2 * after
            + (u + 1) * u * (u - 1) / 6 * beyond
        )


@dataclass(frozen=True)
class Ground:
    """A point on the ground by Skyfield's ellipsoid: position and geodetic vertical."""

    position_m: Floats
    up: Floats

    @classmethod
    def at(cls, lat_deg: float, lon_deg: float, alt_m: float = 0.0) -> Ground:
        here = wgs84.latlon(lat_deg, lon_deg, elevation_m=alt_m).itrs_xyz.m
        above = wgs84.latlon(lat_deg, lon_deg, elevation_m=alt_m + 1000.0).itrs_xyz.m
        return cls(position_m=here, up=(above - here) / 1000.0)


def angle_deg(a: Floats, b: Floats) -> Floats:
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.degrees(np.arctan2(cross, (a * b).sum(axis=-1))))


def vertical_at(position_m: Floats, nadir: str) -> Floats:
    """Return the vertical at a satellite: Skyfield's geodetic one, or the geocentric."""
    if nadir == "geocentric":
        return np.asarray(position_m / np.linalg.norm(position_m, axis=-1, keepdims=True))
    x, y, z = position_m.T
    # The plain fixed point, not the planner's closed form.
    e2 = 6.69437999014e-3
    across = np.hypot(x, y)
    lat = np.arctan2(z, across)
    for _ in range(8):
        normal_m = 6_378_137.0 / np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
        lat = np.arctan2(z + e2 * normal_m * np.sin(lat), across)
    lon = np.arctan2(y, x)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


def elevation_deg(position_m: Floats, ground: Ground) -> Floats:
    return 90.0 - angle_deg(position_m - ground.position_m, ground.up)


def off_nadir_deg(position_m: Floats, ground: Ground, nadir: str) -> Floats:
    return angle_deg(vertical_at(position_m, nadir), position_m - ground.position_m)


def windows_by_scan(
    holds: Callable[[Floats], Bools], duration_s: float, step_s: float = 1.0
) -> list[tuple[float, float]]:
    """Return the windows in which ``holds`` is true: a dense scan, edges bisected."""
    t = np.append(np.arange(0.0, duration_s, step_s), duration_s)
    inside = holds(t)
    change = np.flatnonzero(inside[:-1] != inside[1:])
    a, b = t[change], t[change + 1]
    for _ in range(30):
        middle = 0.5 * (a + b)
        same = holds(middle) == inside[change]
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    edges: Sequence[float] = [
        *([0.0] if inside[0] else []),
        *(0.5 * (a + b)).tolist(),
        *([duration_s] if inside[-1] else []),
    ]
    return list(zip(edges[::2], edges[1::2], strict=True))
