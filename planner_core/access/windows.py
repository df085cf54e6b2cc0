"""Accesses: when geometry lets one satellite see each of many sites.

The search goes through the satellite's cubics minute by minute. A cap on the ground, rigorously
large enough, selects the few sites that may be seen in that minute. For those, every limit is a
smooth function whose sign changes are found from its value and rate at both ends
(``orbits.crossings``) and swept together (``orbits.search``). Windows are rounded inward to the
millisecond here and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planner_core.access.limits import Limits
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.frames import EARTH_POLAR_RADIUS_M
from planner_core.orbits.mask import Mask, windows_above_mask
from planner_core.orbits.search import GROUP, find_windows
from planner_core.orbits.sites import Sites

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
class Accesses:
    """Windows of one satellite, ordered by site, then start. Shape ``(n,)`` each.

    Attributes
    ----------
    site
        Index of the site.
    start_s, end_s
        Seconds from the start of the horizon, rounded inward to the millisecond.
    starts_cut, ends_cut
        Whether the horizon's start or end cuts the window.
    """

    site: Ints
    start_s: Floats
    end_s: Floats
    starts_cut: Bools
    ends_cut: Bools

    def __len__(self) -> int:
        return len(self.site)


def find_accesses(
    ephemeris: Ephemeris, sites: Sites, limits: Limits, stop: Bytes | None = None
) -> Accesses:
    """Return all accesses of a satellite to each site over the horizon.

    Complete for windows and gaps that a resolution of a millisecond shows. When ``stop[0]``
    becomes non-zero, the search ends early with the accesses found so far.
    """
    coarse, fine = _caps(ephemeris, limits)
    site, windows = find_windows(
        ephemeris.track(limits.nadir),
        ephemeris.step_s,
        coarse,
        fine,
        _site_vectors(sites, limits),
        limits.codes,
        limits.signs,
        limits.thresholds,
        np.zeros(1, dtype=np.uint8) if stop is None else stop,
    )
    windows = np.clip(windows, 0.0, ephemeris.duration_s)
    if any(limits.masks):
        site, windows = _cut_by_masks(ephemeris, sites, limits.masks, site, windows)
    return _rounded_inward(site, windows, ephemeris.duration_s)


def _site_vectors(sites: Sites, limits: Limits) -> Floats:
    own = np.stack([sites.position_m, sites.up], axis=1)
    return np.ascontiguousarray(np.concatenate([own, limits.meridians], axis=1))


def _rounded_inward(site: Ints, windows: Floats, duration_s: float) -> Accesses:
    start_ms = np.ceil(windows[:, 0] * 1000.0 - _ROUNDING_MS)
    end_ms = np.floor(windows[:, 1] * 1000.0 + _ROUNDING_MS)
    kept = end_ms > start_ms
    return Accesses(
        site=site[kept],
        start_s=start_ms[kept] / 1000.0,
        end_s=end_ms[kept] / 1000.0,
        starts_cut=windows[kept, 0] <= 0.0,
        ends_cut=windows[kept, 1] >= duration_s,
    )


def _cut_by_masks(
    ephemeris: Ephemeris,
    sites: Sites,
    masks: tuple[Mask, ...],
    site: Ints,
    windows: Floats,
) -> tuple[Ints, Floats]:
    parts = []
    for index, mask in enumerate(masks):
        own = windows[site == index]
        if mask:
            own = windows_above_mask(ephemeris, sites.at(np.array([index])), mask, own)
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
    # The satellite gets no farther from the middle than it can turn in half the run.
    radius = reach_rad[nodes].max(axis=1) + turn_rad_s[nodes].max(axis=1) * half_s
    radius += _CAP_MARGIN_RAD
    centre = middle / np.linalg.norm(middle, axis=1)[:, None]
    return np.column_stack([centre, np.where(radius < np.pi, np.cos(radius), -2.0)])


def _reach_rad(radius_m: Floats, limits: Limits) -> Floats:
    """Return the Earth-central angle beyond which no site meets the limits. Shape ``(n,)``."""
    ratio = np.maximum(radius_m / _LOWEST_GROUND_M, 1.0)
    lowest = np.radians(limits.lowest_elevation_deg - _DEFLECTION_DEG)
    reach = np.arccos(np.cos(lowest) / ratio) - lowest
    tilt_deg = _DEFLECTION_DEG if limits.nadir == "geodetic" else 0.0
    widest = np.radians(min(limits.widest_off_nadir_deg + tilt_deg, 90.0))
    sine = ratio * np.sin(widest)
    with_off_nadir = np.where(sine < 1.0, np.arcsin(np.minimum(sine, 1.0)) - widest, np.inf)
    return np.asarray(np.minimum(reach, with_off_nadir))
