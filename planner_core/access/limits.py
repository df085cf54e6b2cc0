"""What a site must meet to be seen: the limits of sensors, targets and stations as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict

import numpy as np
import numpy.typing as npt

from planner_core.domain import (
    GroundStation,
    Nadir,
    Sensor,
    Target,
)
from planner_core.orbits import crossings as codes
from planner_core.orbits.mask import Mask

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Row = tuple[int, float, Floats]

_NO_LIMIT = -2.0  # a threshold below every cosine
_DEG_PER_HOUR = 15.0
_BOUNDS = (
    "off_nadir_min_deg",
    "off_nadir_max_deg",
    "min_elevation_deg",
    "sun_elevation_min_deg",
    "sun_elevation_max_deg",
    "local_time_from_h",
    "local_time_to_h",
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetLimits:
    """The targets' own limits as columns, made once for many satellites.

    Attributes
    ----------
    lon_deg
        Shape ``(n,)``.
    bounds
        Numeric limits by field name, NaN for none. Shape ``(n,)`` each.
    choices
        Look sides and orbit directions by field name, "any" for none. Shape ``(n,)`` each.
    """

    lon_deg: Floats
    bounds: Mapping[str, Floats]
    choices: Mapping[str, npt.NDArray[np.str_]]

    @classmethod
    def of(cls, targets: Sequence[Target]) -> TargetLimits:
        """Return the limits of targets, in their order."""
        return cls(
            lon_deg=np.array([target.lon_deg for target in targets], dtype=np.float64),
            bounds={
                name: np.array(
                    [_number(getattr(target, name)) for target in targets], dtype=np.float64
                )
                for name in _BOUNDS
            },
            choices={
                name: np.array([getattr(target, name) for target in targets], dtype=np.str_)
                for name in ("look_side", "orbit_direction")
            },
        )

    def at(self, rows: npt.NDArray[np.integer]) -> TargetLimits:
        """Return the limits of these targets."""
        return TargetLimits(
            lon_deg=self.lon_deg[rows],
            bounds={name: values[rows] for name, values in self.bounds.items()},
            choices={name: values[rows] for name, values in self.choices.items()},
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Bounds on angles, one column per kind of limit and one row per site.

    Attributes
    ----------
    nadir
        The vertical that off-nadir angles are measured from.
    widest_off_nadir_deg, lowest_elevation_deg
        The loosest bounds over all sites: no site is seen outside them.
    codes, signs
        Which angle (``orbits.crossings``), and +1 for "at most" or -1 for "at least".
        Shape ``(m,)``.
    thresholds
        ``sign * cos(bound)``. Shape ``(n, m)``.
    meridians
        Direction of the sun's meridian in the middle of the local-time span that the sensor
        allows, and of the one that the target allows. Shape ``(n, 2, 3)``.
    masks
        Azimuth-elevation masks, one per site (empty for none), or no masks at all.
    """

    nadir: Nadir
    widest_off_nadir_deg: float
    lowest_elevation_deg: float
    codes: Ints
    signs: Floats
    thresholds: Floats
    meridians: Floats
    masks: tuple[Mask, ...] = ()

    @classmethod
    def of_targets(cls, sensor: Sensor, targets: Sequence[Target] | TargetLimits) -> Limits:
        """Return a sensor's limits, narrowed by each target's own."""
        own = targets if isinstance(targets, TargetLimits) else TargetLimits.of(targets)

        def highest(name: str) -> Floats:
            return np.fmax(_number(getattr(sensor, name)), own.bounds[name])

        def lowest(name: str) -> Floats:
            return np.fmin(_number(getattr(sensor, name)), own.bounds[name])

        def wanted(name: str, choice: str) -> Floats:
            everyone = getattr(sensor, name) == choice
            return np.where(everyone | (own.choices[name] == choice), 90.0, np.nan)

        widest = lowest("off_nadir_max_deg")
        narrowest = highest("off_nadir_min_deg")
        elevation = highest("min_elevation_deg")
        half_deg, meridian = _local_time(
            np.full_like(own.lon_deg, _number(sensor.local_time_from_h)),
            np.full_like(own.lon_deg, _number(sensor.local_time_to_h)),
            own.lon_deg,
        )
        own_half_deg, own_meridian = _local_time(
            own.bounds["local_time_from_h"], own.bounds["local_time_to_h"], own.lon_deg
        )
        sun_exclusion_deg = np.full_like(own.lon_deg, _number(sensor.sun_exclusion_deg))
        rows = [
            # The search drops an interval at the first limit that never holds in it; with the sun
            # first it drops nights at once.
            _at_most(codes.SUN_ELEVATION, 90.0 - highest("sun_elevation_min_deg")),
            _at_most(codes.OFF_NADIR, np.where(widest < 90.0, widest, np.nan)),
            _at_most(codes.ELEVATION, 90.0 - elevation),
            _at_least(codes.OFF_NADIR, np.where(narrowest > 0.0, narrowest, np.nan)),
            _at_least(codes.SUN_ELEVATION, 90.0 - lowest("sun_elevation_max_deg")),
            _at_most(codes.SUN_EXCLUSION, 180.0 - sun_exclusion_deg),
            _at_most(codes.LOCAL_TIME, half_deg),
            _at_most(codes.OWN_LOCAL_TIME, own_half_deg),
            _at_most(codes.LOOK_SIDE, wanted("look_side", "left")),
            _at_least(codes.LOOK_SIDE, wanted("look_side", "right")),
            _at_most(codes.HEADING, wanted("orbit_direction", "ascending")),
            _at_least(codes.HEADING, wanted("orbit_direction", "descending")),
        ]
        return cls(
            nadir=sensor.nadir,
            widest_off_nadir_deg=float(widest.max(initial=0.0)),
            lowest_elevation_deg=float(elevation.min(initial=90.0)),
            meridians=np.stack([meridian, own_meridian], axis=1),
            **_table(rows),
        )

    @classmethod
    def of_stations(cls, stations: Sequence[GroundStation]) -> Limits:
        """Return the limits of contacts."""
        lowest_deg = [
            max(s.min_elevation_deg, min((knot[1] for knot in s.elevation_mask), default=0.0))
            for s in stations
        ]
        return cls._above(
            np.array(lowest_deg, dtype=np.float64), tuple(s.elevation_mask for s in stations)
        )

    @classmethod
    def above_horizon(cls, num_sites: int) -> Limits:
        """Return the limits of bare visibility: above the horizon."""
        return cls._above(np.zeros(num_sites), ())

    @classmethod
    def _above(cls, elevation_deg: Floats, masks: tuple[Mask, ...]) -> Limits:
        elevation_deg = np.maximum(elevation_deg, 0.0)
        return cls(
            nadir="geocentric",
            widest_off_nadir_deg=90.0,
            lowest_elevation_deg=float(elevation_deg.min(initial=90.0)),
            meridians=np.zeros((len(elevation_deg), 2, 3)),
            masks=masks,
            **_table([_at_most(codes.ELEVATION, 90.0 - elevation_deg)]),
        )


def _number(value: float | None) -> float:
    return np.nan if value is None else value


def _at_most(code: int, bound_deg: Floats) -> Row:
    return code, 1.0, bound_deg


def _at_least(code: int, bound_deg: Floats) -> Row:
    return code, -1.0, bound_deg


def _local_time(from_h: Floats, to_h: Floats, lon_deg: Floats) -> tuple[Floats, Floats]:
    """Return half the width, in degrees, of the arc of allowed sun meridians, and its middle.

    Local time is 12 h when the sun is over the target's meridian and changes with the sun's
    longitude, so the allowed hours are an arc of sun longitudes.
    """
    span_h = (to_h - from_h) % 24.0
    half_deg = np.where(span_h > 0.0, span_h * _DEG_PER_HOUR / 2.0, np.nan)
    middle_h = np.nan_to_num(from_h + span_h / 2.0)
    sun = np.radians(lon_deg - (middle_h - 12.0) * _DEG_PER_HOUR)
    return half_deg, np.stack([np.cos(sun), np.sin(sun), np.zeros_like(sun)], axis=1)


class _Table(TypedDict):
    codes: Ints
    signs: Floats
    thresholds: Floats


def _table(rows: Sequence[Row]) -> _Table:
    """Return the limits that bind at least one site; NaN means no limit."""
    used = [row for row in rows if not np.isnan(row[2]).all()]
    cosines = [sign * np.cos(np.radians(bound)) for _, sign, bound in used]
    num_sites = len(rows[0][2])
    thresholds = np.stack(cosines, axis=1) if used else np.empty((num_sites, 0))
    return {
        "codes": np.array([code for code, _, _ in used], dtype=np.int32),
        "signs": np.array([sign for _, sign, _ in used], dtype=np.float64),
        "thresholds": np.ascontiguousarray(np.nan_to_num(thresholds, nan=_NO_LIMIT)),
    }
