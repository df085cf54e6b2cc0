"""Passes over ground stations: their downlink rates, and the parts of them offered as contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.access.opportunities import Placed, place_contacts
from planner_core.access.windows import Accesses
from planner_core.domain import GroundStation, Resources, Satellite, Scenario
from planner_core.orbits.ephemeris import Ephemeris, propagate
from planner_core.orbits.sites import Sites, elevations_deg
from planner_core.problem import (
    CONTACT,
    Downlinks,
    Opportunities,
    PassRate,
    PassRates,
    StationLinks,
)

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Longs = npt.NDArray[np.int64]

_STEP_S: Final = 4.0
"""Between samples of a rate: its integral is off by at most a thousandth, in an overhead pass."""
_PARTS: Final = (0.3, 0.6)
_APART_S: Final = 2.0
"""Between the starts of contacts, so that a start in whole seconds identifies one."""
_MS_PER_S: Final = 1000
_CHUNK: Final = 16_384  # instants whose intermediate results fit the processor's cache


class Passes(NamedTuple):
    """The passes of one satellite.

    Attributes
    ----------
    rates
        Downlink rate during each, the station's gain included.
    culmination_s
        When the satellite is highest, to a few seconds. Shape ``(num_passes,)``.
    """

    rates: PassRates
    culmination_s: Floats


def passes_of(
    resources: Resources,
    stations: Sequence[GroundStation],
    path: Ephemeris,
    sites: Sites,
    accesses: Accesses,
) -> Passes:
    """Return the passes of one satellite, one for each of its accesses to ``stations``."""
    length_s = accesses.end_s - accesses.start_s
    num_steps = np.maximum(np.ceil(length_s / _STEP_S), 1.0).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(num_steps + 1)])
    of = np.repeat(np.arange(len(accesses)), num_steps + 1)
    step_s = length_s / num_steps
    time_s = (np.arange(len(of)) - first[of]) * step_s[of] + accesses.start_s[of]
    time_s[first[1:] - 1] = accesses.end_s
    elevation_deg = np.empty(len(of))
    for begin in range(0, len(of), _CHUNK):
        part = slice(begin, begin + _CHUNK)
        here = sites.at(accesses.site[of[part]])
        elevation_deg[part] = elevations_deg(path, here, time_s[part])
    gain = np.array([station.downlink_gain for station in stations], dtype=np.float64)
    per_s = gain[accesses.site[of]] * resources.downlink_at(elevation_deg)
    highest_deg = np.maximum.reduceat(elevation_deg, first[:-1]) if len(of) else elevation_deg
    at_top = np.flatnonzero(elevation_deg == highest_deg[of])
    _, top = np.unique(of[at_top], return_index=True)
    return Passes(PassRates.of(time_s, per_s, first), time_s[at_top[top]])


class PlacedContacts(NamedTuple):
    """The contacts of one satellite, including halves of passes that may not be needed.

    Attributes
    ----------
    placed
        Row of the pass, start and end in milliseconds. Shape ``(n,)`` each.
    is_half
        Which contacts are halves. Shape ``(n,)``.
    rates
        Downlink rate during each pass; None if it was not needed.
    """

    passes: Accesses
    placed: Placed
    is_half: Bools
    rates: PassRates | None


def _place_parts(
    accesses: Accesses,
    stations: Sequence[GroundStation],
    passes: Passes,
    *,
    has_parts: bool,
    has_halves: bool,
) -> PlacedContacts:
    """Return the contacts that passes offer: each as a whole, and parts of it.

    A part around the culmination downlinks 30 or 60 % of the data: the same share of what comes
    before the culmination as of what comes after it. The two halves downlink equal amounts. Each
    part begins with the station's setup.
    """
    row, start_ms, end_ms = place_contacts(accesses, stations)
    rows, starts_ms, ends_ms = [row], [start_ms], [end_ms]
    is_half = [np.zeros(len(row), dtype=np.bool_)]
    setup_s = np.array([s.setup_s for s in stations], dtype=np.float64)[accesses.site[row]]
    shortest_s = np.array([s.min_contact_s for s in stations], dtype=np.float64)
    shortest_ms = np.maximum(shortest_s[accesses.site[row]] * _MS_PER_S - 1e-3, 1.0)
    parts = [_part_s(passes, row, setup_s, share) for share in _PARTS * has_parts]
    halves = _halves_s(passes, row, setup_s) if has_halves else []
    for number, (start_s, end_s) in enumerate((*parts, *halves)):
        # Rounded inward to the millisecond.
        start_ms = np.ceil(start_s * _MS_PER_S).astype(np.int64)
        end_ms = np.floor(end_s * _MS_PER_S).astype(np.int64)
        fits = end_ms - start_ms >= shortest_ms
        rows.append(row[fits])
        starts_ms.append(start_ms[fits])
        ends_ms.append(end_ms[fits])
        is_half.append(np.full(np.count_nonzero(fits), number >= len(parts)))
    placed = np.concatenate(rows), np.concatenate(starts_ms), np.concatenate(ends_ms)
    return PlacedContacts(accesses, placed, np.concatenate(is_half), passes.rates)


def _part_s(passes: Passes, row: Longs, setup_s: Floats, share: float) -> tuple[Floats, Floats]:
    """Return start and end of a part of each of these passes, its setup included."""
    rates = passes.rates
    begin_s, end_s = rates.time_s[rates.first[row]], rates.time_s[rates.first[row + 1] - 1]
    ready_s = begin_s + setup_s
    first, last = rates.until(row, ready_s), rates.until(row, end_s)
    top = rates.until(row, np.maximum(ready_s, passes.culmination_s[row]))
    from_s = rates.when(row, top - share * (top - first))
    to_s = rates.when(row, top + share * (last - top))
    return np.maximum(from_s - setup_s, begin_s), to_s


def _halves_s(passes: Passes, row: Longs, setup_s: Floats) -> list[tuple[Floats, Floats]]:
    """Return starts and ends of the halves of each of these passes, setup included.

    The first begins a little after the pass, as bookings identify a contact by its start. A pass so
    short that the second would begin with the first has no halves: they get zero length.
    """
    rates = passes.rates
    begin_s = rates.time_s[rates.first[row]] + _APART_S
    end_s = rates.time_s[rates.first[row + 1] - 1]
    first, last = rates.until(row, begin_s + setup_s), rates.until(row, end_s)
    middle_s = rates.when(row, 0.5 * (first + last))
    later_s = middle_s - setup_s
    has_halves = later_s >= begin_s + _APART_S
    return [
        (begin_s, np.where(has_halves, middle_s, begin_s)),
        (later_s, np.where(has_halves, end_s, later_s)),
    ]


def with_halves_to_share(
    contacts: Sequence[PlacedContacts], stations: Sequence[GroundStation]
) -> list[Placed]:
    """Return the contacts of all satellites, with halves only of passes that may be shared.

    Those are the ones during which a station sees more satellites at once than it has antennas.
    """
    wanted = [np.zeros(len(own.passes), dtype=np.bool_) for own in contacts]
    for site, station in enumerate(stations):
        passes = sorted(
            (float(own.passes.start_s[row]), float(own.passes.end_s[row]), index, row)
            for index, own in enumerate(contacts)
            for row in np.flatnonzero(own.passes.site == site).tolist()
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
    scenario: Scenario, satellite: Satellite, path: Ephemeris, sites: Sites, found: Accesses
) -> PlacedContacts:
    """Return the contacts of one satellite, with parts of passes if a part may be worth more.

    That is so if the rate depends on the elevation, and also at stations with a setup time, as a
    shortened pass spreads its setup over less data. Halves let satellites that pass a station at
    the same time share its antenna.
    """
    stations, resources = scenario.ground_stations, satellite.resources
    varies = bool(resources.downlink_by_elevation)
    has_parts = varies or any(station.setup_s > 0.0 for station in stations)
    # Shared passes are known only once all satellites are, and their paths are not kept until then.
    has_halves = len(scenario.satellites) > 1
    if not has_parts and not has_halves:
        placed = place_contacts(found, stations)
        return PlacedContacts(found, placed, np.zeros(len(placed[0]), dtype=np.bool_), None)
    passes = passes_of(resources, stations, path, sites, found)
    return _place_parts(found, stations, passes, has_parts=has_parts, has_halves=has_halves)


def downlinks_of(
    scenario: Scenario, table: Opportunities, known: Sequence[PlacedContacts] = ()
) -> Downlinks:
    """Return the downlink rates of the table's contacts.

    Parameters
    ----------
    known
        The contacts of each satellite from which the table was made, if at hand. The rates that
        were computed to place them are reused.
    """
    stations = scenario.ground_stations
    sites = Sites.of(stations)
    rates: dict[int, PassRate] = {}
    for index, satellite in enumerate(scenario.satellites):
        if not scenario.use_resources or not satellite.resources.downlink_by_elevation:
            continue
        own = np.flatnonzero((table.satellite == index) & (table.kind == CONTACT))
        number, first = np.unique(table.access[own], return_index=True)
        row = own[first]
        placed = known[index] if known else None
        if placed is not None and placed.rates is not None:
            each = _rates_by_pass(placed.passes, placed.rates)
            begun = zip(table.site[row].tolist(), table.access_start_s[row].tolist(), strict=True)
            rates |= zip(number.tolist(), map(each.__getitem__, begun), strict=True)
            continue
        accesses = Accesses(
            site=table.site[row],
            start_s=table.access_start_s[row],
            end_s=table.access_end_s[row],
            starts_cut=np.zeros(len(row), dtype=np.bool_),
            ends_cut=np.zeros(len(row), dtype=np.bool_),
        )
        path = propagate(satellite, scenario.horizon)
        found = passes_of(satellite.resources, stations, path, sites, accesses)
        rates |= zip(number.tolist(), found.rates.each(), strict=True)
    links = StationLinks(
        gain=np.array([s.downlink_gain for s in stations], dtype=np.float64),
        setup_s=np.array([s.setup_s for s in stations], dtype=np.float64),
    )
    return Downlinks(stations=links, passes=rates)


def _rates_by_pass(passes: Accesses, rates: PassRates) -> dict[tuple[int, float], PassRate]:
    """Return the rate of each pass by its station and start."""
    begun = zip(passes.site.tolist(), passes.start_s.tolist(), strict=True)
    return dict(zip(begun, rates.each(), strict=True))
