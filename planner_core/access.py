"""Accesses: when geometry lets one satellite see each of many places.

The search takes the satellite's cubics minute by minute. A cap on the ground, rigorously
large enough, leaves the few places that a minute can matter for; for those, every limit is a
smooth function whose sign changes are found by value and rate at both ends (``orbits.crossings``)
and swept together (``orbits.search``). Windows are rounded inward to the millisecond here,
once, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planner_core.domain import GroundStation, LookSide, Nadir, Sensor, Target
from planner_core.orbits import crossings as codes
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.frames import EARTH_POLAR_RADIUS_M
from planner_core.orbits.mask import Mask, windows_above_mask
from planner_core.orbits.places import Places
from planner_core.orbits.search import GROUP, find_windows

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]

_LOWEST_GROUND_M = EARTH_POLAR_RADIUS_M - 500.0  # the lowest target that the domain allows
_DEFLECTION_DEG = 0.2  # between the geodetic and the geocentric vertical, at most 0.193
_CAP_MARGIN_RAD = 1e-4
_TURN_MARGIN = 1.05  # the satellite may turn a little faster between nodes than at them
_ROUNDING_MS = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """What a place must meet to be seen, one row per place; ``nadir`` and side for all.

    Attributes
    ----------
    off_nadir_min_deg, off_nadir_max_deg
        Bounds of the angle at the satellite. Shape ``(n,)``.
    min_elevation_deg
        Bound at the ground, 0 or more. Shape ``(n,)``.
    masks
        Azimuth-elevation masks, one per place (empty for none), or no masks at all.
    """

    nadir: Nadir
    look_side: LookSide
    off_nadir_min_deg: Floats
    off_nadir_max_deg: Floats
    min_elevation_deg: Floats
    masks: tuple[Mask, ...] = ()

    @classmethod
    def of_targets(cls, sensor: Sensor, targets: Sequence[Target]) -> Limits:
        """Return a sensor's limits, narrowed by each target's own."""
        lowest, highest = sensor.off_nadir_min_deg, sensor.off_nadir_max_deg
        return cls(
            nadir=sensor.nadir,
            look_side=sensor.look_side,
            off_nadir_min_deg=np.array(
                [max(lowest, t.off_nadir_min_deg or 0.0) for t in targets], dtype=np.float64
            ),
            off_nadir_max_deg=np.array(
                [
                    highest if t.off_nadir_max_deg is None else min(highest, t.off_nadir_max_deg)
                    for t in targets
                ],
                dtype=np.float64,
            ),
            min_elevation_deg=np.full(len(targets), max(0.0, sensor.min_elevation_deg)),
        )

    @classmethod
    def of_stations(cls, stations: Sequence[GroundStation]) -> Limits:
        """Return the limits of contacts."""
        lowest_deg = [
            max(0.0, s.min_elevation_deg, min((e for _, e in s.elevation_mask), default=0.0))
            for s in stations
        ]
        return cls(
            nadir="geocentric",
            look_side="any",
            off_nadir_min_deg=np.zeros(len(stations)),
            off_nadir_max_deg=np.full(len(stations), 90.0),
            min_elevation_deg=np.array(lowest_deg, dtype=np.float64),
            masks=tuple(s.elevation_mask for s in stations),
        )

    @classmethod
    def above_horizon(cls, num_places: int) -> Limits:
        """Return the limits of bare visibility."""
        return cls(
            nadir="geocentric",
            look_side="any",
            off_nadir_min_deg=np.zeros(num_places),
            off_nadir_max_deg=np.full(num_places, 90.0),
            min_elevation_deg=np.zeros(num_places),
        )

    def table(self) -> tuple[Ints, Floats, Floats]:
        """Return codes ``(m,)``, signs ``(m,)`` and thresholds ``(n, m)`` of those in force."""
        rows = [(codes.ELEVATION, 1.0, 90.0 - self.min_elevation_deg)]
        if np.any(self.off_nadir_max_deg < 90.0):
            rows.append((codes.OFF_NADIR, 1.0, self.off_nadir_max_deg))
        if np.any(self.off_nadir_min_deg > 0.0):
            rows.append((codes.OFF_NADIR, -1.0, self.off_nadir_min_deg))
        if self.look_side != "any":
            side = 1.0 if self.look_side == "left" else -1.0
            rows.append((codes.LOOK_SIDE, side, np.full(len(self.min_elevation_deg), 90.0)))
        return (
            np.array([code for code, _, _ in rows], dtype=np.int32),
            np.array([sign for _, sign, _ in rows]),
            np.stack([sign * np.cos(np.radians(bound)) for _, sign, bound in rows], axis=1),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Accesses:
    """Windows of one satellite, ordered by place, then start. Shape ``(n,)`` each.

    Attributes
    ----------
    place
        Index of the place.
    start_s, end_s
        Seconds from the start of the horizon, rounded inward to the millisecond.
    starts_cut, ends_cut
        Whether the horizon's start or end cuts the window.
    """

    place: Ints
    start_s: Floats
    end_s: Floats
    starts_cut: Bools
    ends_cut: Bools

    def __len__(self) -> int:
        return len(self.place)


def find_accesses(
    ephemeris: Ephemeris, places: Places, limits: Limits, stop: Bytes | None = None
) -> Accesses:
    """Return all accesses of a satellite to each place over the horizon.

    Complete for windows and gaps that a millisecond can show. When ``stop[0]`` becomes
    non-zero the search ends early with the accesses found so far.
    """
    code, sign, threshold = limits.table()
    coarse, fine = _caps(ephemeris, limits)
    place, windows = find_windows(
        ephemeris.track(limits.nadir),
        ephemeris.step_s,
        coarse,
        fine,
        _place_vectors(places),
        code,
        sign,
        threshold,
        np.zeros(1, dtype=np.uint8) if stop is None else stop,
    )
    windows = np.clip(windows, 0.0, ephemeris.duration_s)
    if any(limits.masks):
        place, windows = _cut_by_masks(ephemeris, places, limits.masks, place, windows)
    return _rounded_inward(place, windows, ephemeris.duration_s)


def _place_vectors(places: Places) -> Floats:
    return np.ascontiguousarray(np.stack([places.position_m, places.up, places.east], axis=1))


def _rounded_inward(place: Ints, windows: Floats, duration_s: float) -> Accesses:
    start_ms = np.ceil(windows[:, 0] * 1000.0 - _ROUNDING_MS)
    end_ms = np.floor(windows[:, 1] * 1000.0 + _ROUNDING_MS)
    kept = end_ms > start_ms
    return Accesses(
        place=place[kept],
        start_s=start_ms[kept] / 1000.0,
        end_s=end_ms[kept] / 1000.0,
        starts_cut=windows[kept, 0] <= 0.0,
        ends_cut=windows[kept, 1] >= duration_s,
    )


def _cut_by_masks(
    ephemeris: Ephemeris,
    places: Places,
    masks: tuple[Mask, ...],
    place: Ints,
    windows: Floats,
) -> tuple[Ints, Floats]:
    parts = []
    for index, mask in enumerate(masks):
        own = windows[place == index]
        if mask:
            own = windows_above_mask(ephemeris, places.at(np.array([index])), mask, own)
        parts.append(own)
    counts = [len(part) for part in parts]
    return np.repeat(np.arange(len(masks), dtype=np.int32), counts), np.concatenate(parts)


def _caps(ephemeris: Ephemeris, limits: Limits) -> tuple[Floats, Floats]:
    """Return the coarse and fine caps of ``find_windows`` for the loosest of the limits."""
    radius_m = np.linalg.norm(ephemeris.position_itrf_m, axis=1)
    unit = ephemeris.position_itrf_m / radius_m[:, None]
    climb = np.einsum("ij,ij->i", unit, ephemeris.velocity_itrf_m_s)
    across = ephemeris.velocity_itrf_m_s - climb[:, None] * unit
    turn_rad_s = _TURN_MARGIN * np.linalg.norm(across, axis=1) / radius_m
    # An apogee between two nodes is no higher than half an interval's climb above them.
    highest_m = radius_m + np.abs(climb) * ephemeris.step_s / 2.0
    reach_rad = _reach_rad(highest_m, limits)
    return (
        _cap(ephemeris, reach_rad, turn_rad_s, GROUP),
        _cap(ephemeris, reach_rad, turn_rad_s, 1),
    )


def _cap(ephemeris: Ephemeris, reach_rad: Floats, turn_rad_s: Floats, size: int) -> Floats:
    """Return caps over runs of ``size`` intervals. Shape ``(ceil(num_intervals / size), 4)``."""
    num_intervals = len(reach_rad) - 1
    first = np.arange(0, num_intervals, size, dtype=np.int64)
    last = np.minimum(first + size, num_intervals)
    nodes = np.minimum(first[:, None] + np.arange(size + 1), last[:, None])
    middle_s = np.asarray((first + last) * (0.5 * ephemeris.step_s), dtype=np.float64)
    middle, _ = ephemeris.state_itrf(middle_s)
    half_s = (last - first) * (0.5 * ephemeris.step_s)
    # Along its path the satellite gets no farther from the middle than it can turn in half.
    radius = reach_rad[nodes].max(axis=1) + turn_rad_s[nodes].max(axis=1) * half_s
    radius += _CAP_MARGIN_RAD
    centre = middle / np.linalg.norm(middle, axis=1)[:, None]
    return np.column_stack([centre, np.where(radius < np.pi, np.cos(radius), -2.0)])


def _reach_rad(radius_m: Floats, limits: Limits) -> Floats:
    """Return the Earth-central angle beyond which no place meets the limits. Shape ``(n,)``."""
    if len(limits.min_elevation_deg) == 0:
        return np.zeros_like(radius_m)
    ratio = np.maximum(radius_m / _LOWEST_GROUND_M, 1.0)
    lowest = np.radians(limits.min_elevation_deg.min() - _DEFLECTION_DEG)
    reach = np.arccos(np.cos(lowest) / ratio) - lowest
    tilt_deg = _DEFLECTION_DEG if limits.nadir == "geodetic" else 0.0
    widest = np.radians(min(limits.off_nadir_max_deg.max() + tilt_deg, 90.0))
    sine = ratio * np.sin(widest)
    with_off_nadir = np.where(sine < 1.0, np.arcsin(np.minimum(sine, 1.0)) - widest, np.inf)
    return np.asarray(np.minimum(reach, with_off_nadir))
