"""Positions of satellites, targets and the sun by the benchmark's conventions, independently.

SGP4 with the WGS84 constants (the product uses those of WGS72), Earth rotation by GMST 1982 with
UT1 = UTC and no polar motion. All vectors are in the true equator, mean equinox frame (TEME),
which serves as the inertial frame: only angles matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from sgp4.api import WGS84, Satrec, jday

from benchmarks.aeossp.case import Case, Task

Floats = npt.NDArray[np.float64]

_EARTH_RADIUS_M = 6_378_137.0
_FLATTENING = 1.0 / 298.257223563
_SHADOW_RADIUS_M = 6_378_136.3
_J2000 = 2_451_545.0


@dataclass(frozen=True, slots=True, eq=False)
class Sky:
    """Positions in metres at seconds from the case's start; times ``(n,)``, vectors ``(n, 3)``."""

    day: float
    fraction: float
    records: dict[str, Satrec]

    @classmethod
    def of(cls, case: Case) -> Sky:
        """Return the sky of a case."""
        t = case.start
        day, fraction = jday(t.year, t.month, t.day, t.hour, t.minute, t.second)
        records = {
            s.id: Satrec.twoline2rv(s.tle[0], s.tle[1], WGS84) for s in case.satellites.values()
        }
        return cls(day, fraction, records)

    def satellite(self, satellite_id: str, t_s: Floats) -> Floats:
        """Return a satellite's positions."""
        fraction = self.fraction + t_s / 86400.0
        error, position_km, _ = self.records[satellite_id].sgp4_array(
            np.full_like(fraction, self.day), fraction
        )
        if error.any():
            raise ValueError(f"SGP4 cannot carry {satellite_id}: error {error.max()}")
        return np.asarray(position_km * 1000.0)

    def target(self, task: Task, t_s: Floats) -> Floats:
        """Return a target's positions."""
        return self.turned(self.fixed(task), t_s)

    @staticmethod
    def fixed(task: Task) -> Floats:
        """Return a target's Earth-fixed position. Shape ``(3,)``."""
        lat, lon = np.radians(task.lat_deg), np.radians(task.lon_deg)
        squared = _FLATTENING * (2.0 - _FLATTENING)
        normal_m = _EARTH_RADIUS_M / np.sqrt(1.0 - squared * np.sin(lat) ** 2)
        out_m = (normal_m + task.alt_m) * np.cos(lat)
        up_m = (normal_m * (1.0 - squared) + task.alt_m) * np.sin(lat)
        return np.array([out_m * np.cos(lon), out_m * np.sin(lon), up_m])

    def turned(self, fixed: Floats, t_s: Floats) -> Floats:
        """Return Earth-fixed points, ``(3,)`` or ``(n, 3)``, in TEME at instants."""
        centuries = ((self.day - _J2000) + self.fraction + t_s / 86400.0) / 36525.0
        sidereal_s = (
            67310.54841
            + (876600.0 * 3600.0 + 8640184.812866) * centuries
            + 0.093104 * centuries**2
            - 6.2e-6 * centuries**3
        )
        angle = np.radians((sidereal_s % 86400.0) / 240.0)
        cosine, sine = np.cos(angle), np.sin(angle)
        x, y, z = np.broadcast_to(fixed, (len(angle), 3)).T
        return np.stack([x * cosine - y * sine, x * sine + y * cosine, z], -1)

    def is_sunlit(self, position_m: Floats, t_s: Floats) -> npt.NDArray[np.bool_]:
        """Return whether positions lie outside the Earth's cylindrical shadow."""
        sun = self._sun(t_s)
        along = np.einsum("ij,ij->i", position_m, sun)
        across_m = np.linalg.norm(position_m - along[:, None] * sun, axis=1)
        return np.asarray(~((along < 0.0) & (across_m < _SHADOW_RADIUS_M)))

    def _sun(self, t_s: Floats) -> Floats:
        """Return the direction of the sun: Montenbruck and Gill's series, equinox of date."""
        centuries = ((self.day - _J2000) + self.fraction + t_s / 86400.0) / 36525.0
        anomaly = np.radians(357.5256 + 35999.049 * centuries)
        longitude = (
            282.94
            + np.degrees(anomaly)
            + (6892.0 * np.sin(anomaly) + 72.0 * np.sin(2.0 * anomaly)) / 3600.0
            + 1.397 * centuries
        )
        longitude, tilt = np.radians(longitude), np.radians(23.43929111)
        sine = np.sin(longitude)
        return np.stack([np.cos(longitude), sine * np.cos(tilt), sine * np.sin(tilt)], -1)


def angle_deg(a: Floats, b: Floats) -> Floats:
    """Return the angles between vectors, row by row."""
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.degrees(np.arctan2(cross, np.einsum("...i,...i->...", a, b))))


def turn_s(angle: float, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """Return the time from rest to rest: accelerate, coast at the rate limit, brake."""
    ramp_s = min(rate_deg_s / acceleration_deg_s2, float(np.sqrt(angle / acceleration_deg_s2)))
    return 2.0 * ramp_s + (angle - acceleration_deg_s2 * ramp_s**2) / rate_deg_s
