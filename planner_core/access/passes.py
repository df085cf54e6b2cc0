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

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

_STEP_S: Final = 4.0
"""Between instants of a rate: its integral is off by a thousandth at most, right overhead."""
_PARTS: Final = (0.3, 0.6)
_APART_S: Final = 2.0
"""Between the starts of contacts, so that one in whole seconds tells which is meant."""
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


class PlacedContacts(NamedTuple):
    """The contacts of one satellite, with halves of passes that may not need any.

    Attributes
    ----------
    placed
        Row of the pass, start and end in milliseconds. Shape ``(n,)`` each.
    is_half
        Which contacts are. Shape ``(n,)``.
    """

    passes: Accesses
    placed: Placed
    is_half: Bools


def _place_parts(
    accesses: Accesses,
    stations: Sequence[GroundStation],
    passes: Sequence[Pass],
    *,
    has_parts: bool,
    has_halves: bool,
) -> PlacedContacts:
    """Return the contacts that passes offer: each as a whole, and parts of it.

    A part about the culmination takes down 30 or 60 % of the data, as much of what comes
    before the culmination as of what comes after it. Halves take down as much each. The station's
    setup goes before a part.
    """
    row, start_ms, end_ms = place_contacts(accesses, stations)
    rows, starts_ms, ends_ms = [row], [start_ms], [end_ms]
    is_half = [np.zeros(len(row), dtype=np.bool_)]
    for one in row.tolist():
        station = stations[int(accesses.place[one])]
        parts = [_part_ms(passes[one], station, share) for share in _PARTS * has_parts]
        halves = _halves_ms(passes[one], station) * has_halves
        shortest_ms = max(1.0, station.min_contact_s * _MS_PER_S - 1e-3)
        for offered, are_halves in ((parts, False), (halves, True)):
            fits = [p for p in offered if p[1] - p[0] >= shortest_ms]
            rows.append(np.full(len(fits), one))
            starts_ms.append(np.array([start for start, _ in fits], dtype=np.int64))
            ends_ms.append(np.array([end for _, end in fits], dtype=np.int64))
            is_half.append(np.full(len(fits), are_halves))
    placed = np.concatenate(rows), np.concatenate(starts_ms), np.concatenate(ends_ms)
    return PlacedContacts(accesses, placed, np.concatenate(is_half))


def _part_ms(one: Pass, station: GroundStation, share: float) -> tuple[int, int]:
    """Return a part of a pass, its setup included, rounded inward to the millisecond."""
    rate = one.rate
    first_s = float(rate.time_s[0]) + station.setup_s
    edges = rate.until(np.array([first_s, max(first_s, one.culmination_s), rate.time_s[-1]]))
    first, top, last = edges.tolist()
    cut_s = rate.when(np.array([top - share * (top - first), top + share * (last - top)]))
    start_s = max(float(cut_s[0]) - station.setup_s, float(rate.time_s[0]))
    return math.ceil(start_s * _MS_PER_S), math.floor(float(cut_s[1]) * _MS_PER_S)


def _halves_ms(one: Pass, station: GroundStation) -> list[tuple[int, int]]:
    """Return the halves of a pass by its data, the station's setup before each.

    The first begins a little after the pass: bookings name a contact by its start. A pass so short
    that the second would begin with the first has none.
    """
    rate = one.rate
    begin_s, end_s = float(rate.time_s[0]) + _APART_S, float(rate.time_s[-1])
    first, last = rate.until(np.array([begin_s + station.setup_s, end_s])).tolist()
    middle_s = float(rate.when(np.array([0.5 * (first + last)]))[0])
    later_s = middle_s - station.setup_s
    if later_s < begin_s + _APART_S:
        return []
    return [
        (math.ceil(from_s * _MS_PER_S), math.floor(to_s * _MS_PER_S))
        for from_s, to_s in ((begin_s, middle_s), (later_s, end_s))
    ]


def with_halves_to_share(
    contacts: Sequence[PlacedContacts], stations: Sequence[GroundStation]
) -> list[Placed]:
    """Return the contacts of all satellites, with halves where several want a pass.

    That is where more satellites pass a station at an instant than it has antennas.
    """
    wanted = [np.zeros(len(own.passes), dtype=np.bool_) for own in contacts]
    for place, station in enumerate(stations):
        passes = sorted(
            (float(own.passes.start_s[row]), float(own.passes.end_s[row]), index, row)
            for index, own in enumerate(contacts)
            for row in np.flatnonzero(own.passes.place == place).tolist()
        )
        running: list[tuple[float, float, int, int]] = []
        for one in passes:
            running = [*(other for other in running if other[1] > one[0]), one]
            if len({index for _, _, index, _ in running}) > station.antennas:
                for _, _, index, row in running:
                    wanted[index][row] = True
    offered = []
    for own, is_wanted in zip(contacts, wanted, strict=True):
        of_pass, start_ms, end_ms = own.placed
        is_offered = ~own.is_half | is_wanted[of_pass]
        offered.append((of_pass[is_offered], start_ms[is_offered], end_ms[is_offered]))
    return offered


def contacts_of(
    scenario: Scenario, satellite: Satellite, path: Ephemeris, places: Places, found: Accesses
) -> PlacedContacts:
    """Return the contacts of one satellite: in parts too, where part of a pass is worth more.

    That is where the rate follows the elevation; at stations with a setup time too, as a pass
    that is cut short shares its setup among less data. Satellites that pass a station at the same
    time can share its antenna in halves.
    """
    stations, resources = scenario.ground_stations, satellite.resources
    varies = bool(resources.downlink_by_elevation)
    has_parts = varies or any(station.setup_s > 0.0 for station in stations)
    # Which passes are shared is known once all satellites are, and their paths are not kept.
    has_halves = len(scenario.satellites) > 1
    if not has_parts and not has_halves:
        placed = place_contacts(found, stations)
        return PlacedContacts(found, placed, np.zeros(len(placed[0]), dtype=np.bool_))
    passes = passes_of(resources, stations, path, places, found)
    return _place_parts(found, stations, passes, has_parts=has_parts, has_halves=has_halves)


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
