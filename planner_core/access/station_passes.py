"""Passes as operators know them: AOS, LOS and the highest point between, for every station."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from planner_core.access.limits import Limits
from planner_core.access.windows import Accesses, find_accesses
from planner_core.domain import GroundStation, Horizon, Satellite
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.sites import Sites, elevations_deg

Floats = npt.NDArray[np.float64]

_STEP_S: Final = 20.0
"""Between the samples that find the highest peak of a window; an orbit takes 5,000 s or more."""
_WITHIN_S: Final = 1e-4
_GOLDEN: Final = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StationPass:
    """A satellite over a station, from the first moment above its mask to the last.

    Attributes
    ----------
    satellite, station
        Indices.
    aos_s, tca_s, los_s
        Seconds from the start of the horizon: acquisition of signal, highest elevation, loss of
        signal.
    max_elevation_deg
        At ``tca_s``.
    aos_cut, los_cut
        Whether the horizon's start or end cuts the pass.
    """

    satellite: int
    station: int
    aos_s: float
    tca_s: float
    los_s: float
    max_elevation_deg: float
    aos_cut: bool
    los_cut: bool


def station_passes(
    satellites: Sequence[Satellite], stations: Sequence[GroundStation], horizon: Horizon
) -> list[StationPass]:
    """Return every pass of the horizon, by AOS.

    AOS and LOS are those of the accesses that contacts are planned in, to the millisecond.

    Raises
    ------
    PropagationFailed
        SGP4 stops before the end of the horizon.
    """
    sites = Sites.of(stations)
    limits = Limits.of_stations(stations)
    found: list[StationPass] = []
    for index, satellite in enumerate(satellites):
        path = propagate(satellite, horizon)
        accesses = find_accesses(path, sites, limits)
        found += _with_culminations(index, path, sites, accesses)
    return sorted(found, key=lambda one: (one.aos_s, one.los_s, one.satellite, one.station))


def overlapping(passes: Sequence[StationPass]) -> list[list[int]]:
    """Return for each pass the indices of others that its station sees at the same time.

    Passes that only touch do not overlap.
    """
    others: list[list[int]] = [[] for _ in passes]
    by_station = sorted(range(len(passes)), key=lambda i: (passes[i].station, passes[i].aos_s))
    for _, group in itertools.groupby(by_station, key=lambda i: passes[i].station):
        open_now: list[int] = []
        for here in group:
            open_now = [i for i in open_now if passes[i].los_s > passes[here].aos_s]
            for other in open_now:
                others[here].append(other)
                others[other].append(here)
            open_now.append(here)
    return [sorted(each) for each in others]


def _with_culminations(
    index: int, path: Ephemeris, sites: Sites, accesses: Accesses
) -> Iterator[StationPass]:
    if not len(accesses):
        return
    tca_s = _culmination_s(path, sites.at(accesses.site), accesses.start_s, accesses.end_s)
    highest_deg = elevations_deg(path, sites.at(accesses.site), tca_s)
    for row in range(len(accesses)):
        yield StationPass(
            satellite=index,
            station=int(accesses.site[row]),
            aos_s=float(accesses.start_s[row]),
            tca_s=float(tca_s[row]),
            los_s=float(accesses.end_s[row]),
            max_elevation_deg=float(highest_deg[row]),
            aos_cut=bool(accesses.starts_cut[row]),
            los_cut=bool(accesses.ends_cut[row]),
        )


def _culmination_s(path: Ephemeris, here: Sites, start_s: Floats, end_s: Floats) -> Floats:
    """Return when the satellite is highest in each window: samples, then a golden section.

    Shape ``(n,)`` each. A window may have several peaks (a high orbit stays in sight for long), so
    samples choose the peak, and the golden section refines it.
    """
    near_s = np.array(
        [
            _highest_sample_s(
                path, here.at(np.array([row])), float(start_s[row]), float(end_s[row])
            )
            for row in range(len(start_s))
        ]
    )
    low_s, high_s = np.maximum(near_s - _STEP_S, start_s), np.minimum(near_s + _STEP_S, end_s)

    def height(t_s: Floats) -> Floats:
        return elevations_deg(path, here, t_s)

    for _ in range(math.ceil(math.log(_WITHIN_S / (2.0 * _STEP_S)) / math.log(_GOLDEN))):
        reach_s = _GOLDEN * (high_s - low_s)
        rises = height(high_s - reach_s) < height(low_s + reach_s)
        low_s, high_s = (
            np.where(rises, high_s - reach_s, low_s),
            np.where(rises, high_s, low_s + reach_s),
        )
    top_s = 0.5 * (low_s + high_s)
    # A mask may cut the peak off: then the highest point is an end of the window.
    candidates = np.stack([start_s, top_s, end_s])
    best = np.argmax(np.stack([height(each) for each in candidates]), axis=0)
    return np.asarray(candidates[best, np.arange(len(top_s))])


def _highest_sample_s(path: Ephemeris, here: Sites, start_s: float, end_s: float) -> float:
    t_s = np.linspace(start_s, end_s, max(2, math.ceil((end_s - start_s) / _STEP_S) + 1))
    elevation_deg = elevations_deg(path, here.at(np.zeros(len(t_s), dtype=np.int32)), t_s)
    return float(t_s[np.argmax(elevation_deg)])
