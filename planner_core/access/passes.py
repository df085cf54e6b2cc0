"""Passes over ground stations: how fast data comes down in them, and the parts of them to offer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.access.opportunities import Placed, place_contacts
from planner_core.access.windows import Accesses
from planner_core.domain import GroundStation, Resources, Satellite, Scenario
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.places import Places, azimuth_elevation_deg
from planner_core.problem import CONTACT, Downlinks, Opportunities, PassRate, StationLinks

Floats = npt.NDArray[np.float64]

_STEP_S: Final = 4.0
"""Between instants of a rate: its integral is off by a thousandth at most, right overhead."""
_PARTS: Final = (0.3, 0.6)
_MS_PER_S: Final = 1000


class Pass(NamedTuple):
    """One access to a station.

    Attributes
    ----------
    rate
        How fast data comes down, the station's gain included.
    culmination_s
        When the satellite is highest, to a few seconds.
    """

    rate: PassRate
    culmination_s: float


def passes_of(
    resources: Resources,
    stations: Sequence[GroundStation],
    path: Ephemeris,
    places: Places,
    accesses: Accesses,
) -> list[Pass]:
    """Return the passes of one satellite, one for each of its accesses to ``stations``."""
    found = []
    for row, station_row in enumerate(accesses.place.tolist()):
        start_s, end_s = float(accesses.start_s[row]), float(accesses.end_s[row])
        time_s = np.linspace(start_s, end_s, max(2, math.ceil((end_s - start_s) / _STEP_S) + 1))
        here = places.at(np.full(len(time_s), station_row))
        _, elevation_deg = azimuth_elevation_deg(path, here, time_s)
        per_s = stations[station_row].downlink_gain * resources.downlink_at(elevation_deg)
        highest_s = float(time_s[np.argmax(elevation_deg)])
        found.append(Pass(PassRate(time_s=time_s, per_s=per_s), highest_s))
    return found


def place_parts(
    accesses: Accesses, stations: Sequence[GroundStation], passes: Sequence[Pass]
) -> Placed:
    """Return the contacts that passes offer: each as a whole, and two parts of it.

    A part lies about the culmination and takes down 30 or 60 % of the data, as much of what comes
    before the culmination as of what comes after it. The station's setup goes before it.
    """
    row, start_ms, end_ms = place_contacts(accesses, stations)
    rows, starts_ms, ends_ms = [row], [start_ms], [end_ms]
    for one in row.tolist():
        station = stations[int(accesses.place[one])]
        parts = [_part_ms(passes[one], station, share) for share in _PARTS]
        fits = [p for p in parts if p[1] - p[0] >= station.min_contact_s * _MS_PER_S - 1e-3]
        rows.append(np.full(len(fits), one))
        starts_ms.append(np.array([start for start, _ in fits], dtype=np.int64))
        ends_ms.append(np.array([end for _, end in fits], dtype=np.int64))
    return np.concatenate(rows), np.concatenate(starts_ms), np.concatenate(ends_ms)


def _part_ms(one: Pass, station: GroundStation, share: float) -> tuple[int, int]:
    """Return a part of a pass, its setup included, rounded inward to the millisecond."""
    rate = one.rate
    first_s = float(rate.time_s[0]) + station.setup_s
    edges = rate.until(np.array([first_s, max(first_s, one.culmination_s), rate.time_s[-1]]))
    first, top, last = edges.tolist()
    cut_s = rate.when(np.array([top - share * (top - first), top + share * (last - top)]))
    start_s = max(float(cut_s[0]) - station.setup_s, float(rate.time_s[0]))
    return math.ceil(start_s * _MS_PER_S), math.floor(float(cut_s[1]) * _MS_PER_S)


def contacts_of(
    scenario: Scenario, satellite: Satellite, path: Ephemeris, places: Places, found: Accesses
) -> Placed:
    """Return the contacts of one satellite: in parts too, where part of a pass is worth more.

    That is where the rate follows the elevation; at stations with a setup time too, as a pass
    that is cut short shares its setup among less data.
    """
    stations, resources = scenario.ground_stations, satellite.resources
    varies = bool(resources.downlink_by_elevation)
    if not varies and not any(station.setup_s > 0.0 for station in stations):
        return place_contacts(found, stations)
    return place_parts(found, stations, passes_of(resources, stations, path, places, found))


def downlinks_of(scenario: Scenario, table: Opportunities) -> Downlinks:
    """Return how fast each contact of the table takes data down."""
    stations = scenario.ground_stations
    places = Places.of(stations)
    rates: dict[int, PassRate] = {}
    for index, satellite in enumerate(scenario.satellites):
        if not scenario.use_resources or not satellite.resources.downlink_by_elevation:
            continue
        own = np.flatnonzero((table.satellite == index) & (table.kind == CONTACT))
        number, first = np.unique(table.access[own], return_index=True)
        row = own[first]
        accesses = Accesses(
            place=table.place[row],
            start_s=table.access_start_s[row],
            end_s=table.access_end_s[row],
            starts_cut=np.zeros(len(row), dtype=np.bool_),
            ends_cut=np.zeros(len(row), dtype=np.bool_),
        )
        path = propagate(satellite, scenario.horizon)
        found = passes_of(satellite.resources, stations, path, places, accesses)
        rates |= {int(one): each.rate for one, each in zip(number, found, strict=True)}
    links = StationLinks(
        gain=np.array([s.downlink_gain for s in stations], dtype=np.float64),
        setup_s=np.array([s.setup_s for s in stations], dtype=np.float64),
    )
    return Downlinks(stations=links, passes=rates)
