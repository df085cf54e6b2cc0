"""Accesses become opportunities: collects placed in them, contacts as a whole.

Times are counted in whole milliseconds, so that no placement depends on rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Final

import numpy as np
import numpy.typing as npt

from planner_core.access import Accesses
from planner_core.domain import GroundStation, Nadir, Target
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.places import Places, line_of_sight_teme, view
from planner_core.problem import COLLECT, CONTACT, Opportunities

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]

_MS_PER_S: Final = 1000


def place_collects(
    accesses: Accesses, targets: Sequence[Target], spacing_s: float | None
) -> tuple[Longs, Longs, Longs]:
    """Return the collects that accesses offer.

    Without a spacing, one in the middle of each access; with one, starts ``spacing_s`` apart
    from the access's start on, and the last start that still fits.

    Returns
    -------
    Row of the access, start and end in milliseconds. Shape ``(n,)`` each.
    """
    length_s = np.array([target.collect_s for target in targets], dtype=np.float64)
    length_ms = np.ceil(length_s * _MS_PER_S - 1e-6).astype(np.int64)[accesses.place]
    start_ms, end_ms = _ms(accesses.start_s), _ms(accesses.end_s)
    room_ms = end_ms - start_ms - length_ms
    row = np.flatnonzero(room_ms >= 0)
    if spacing_s is None:
        begin = start_ms[row] + room_ms[row] // 2
    else:
        row, begin = _spaced(row, start_ms[row], room_ms[row], max(spacing_s * _MS_PER_S, 1.0))
    return row, begin, begin + length_ms[row]


def _spaced(row: Longs, start_ms: Longs, room_ms: Longs, step_ms: float) -> tuple[Longs, Longs]:
    # Steps are rounded to the millisecond one by one, so half of one may stick out.
    regular = ((room_ms + 0.5) / step_ms).astype(np.int64)
    last_ms = np.minimum(np.rint(regular * step_ms).astype(np.int64), room_ms)
    extra = (room_ms - last_ms > 1).astype(np.int64)
    counts = regular + 1 + extra
    of = np.repeat(np.arange(len(row)), counts)
    k = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    into_ms = np.minimum(np.rint(k * step_ms).astype(np.int64), room_ms[of])
    return row[of], start_ms[of] + into_ms


def place_contacts(
    accesses: Accesses, stations: Sequence[GroundStation]
) -> tuple[Longs, Longs, Longs]:
    """Return the contacts: whole accesses of at least the station's ``min_contact_s``."""
    shortest_ms = np.array(
        [math.ceil(station.min_contact_s * _MS_PER_S - 1e-6) for station in stations],
        dtype=np.int64,
    )[accesses.place]
    start_ms, end_ms = _ms(accesses.start_s), _ms(accesses.end_s)
    row = np.flatnonzero(end_ms - start_ms >= np.maximum(shortest_ms, 1))
    return row, start_ms[row], end_ms[row]


def _ms(instant_s: Floats) -> Longs:
    return np.rint(instant_s * _MS_PER_S).astype(np.int64)


def describe(
    satellite: int,
    kind: int,
    ephemeris: Ephemeris,
    places: Places,
    nadir: Nadir,
    accesses: Accesses,
    first_access: int,
    placed: tuple[Longs, Longs, Longs],
) -> Opportunities:
    """Return the placed tasks of one satellite as rows of the opportunity table.

    Parameters
    ----------
    satellite, kind
        Index of the satellite; ``COLLECT`` or ``CONTACT``.
    first_access
        Number of the first access; the others follow.
    placed
        Row of the access, start and end in milliseconds.
    """
    row, begin_ms, finish_ms = placed
    start_s, end_s = begin_ms / _MS_PER_S, finish_ms / _MS_PER_S
    place = accesses.place[row]
    there = places.at(place)
    seen = view(ephemeris, there, 0.5 * (start_s + end_s), nadir)
    return Opportunities(
        satellite=np.full(len(row), satellite, dtype=np.int32),
        kind=np.full(len(row), kind, dtype=np.int8),
        place=place,
        access=(first_access + row).astype(np.int32),
        start_s=start_s,
        end_s=end_s,
        access_start_s=accesses.start_s[row],
        access_end_s=accesses.end_s[row],
        los_start=line_of_sight_teme(ephemeris, there, start_s),
        los_end=line_of_sight_teme(ephemeris, there, end_s),
        off_nadir_deg=seen.off_nadir_deg,
        elevation_deg=seen.elevation_deg,
        azimuth_deg=seen.azimuth_deg,
        range_m=seen.range_m,
        sun_elevation_deg=seen.sun_elevation_deg,
        in_eclipse=seen.in_eclipse,
    )


def merge(
    parts: Sequence[Opportunities], target_ids: Sequence[str], station_ids: Sequence[str]
) -> Opportunities:
    """Return all parts as one table in the order (start, end, satellite, kind, place's id)."""
    whole = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(Opportunities)
    }
    rank = np.where(
        whole["kind"] == COLLECT,
        _rank_of(target_ids, whole["place"], whole["kind"] == COLLECT),
        _rank_of(station_ids, whole["place"], whole["kind"] == CONTACT),
    )
    order = np.lexsort((rank, whole["kind"], whole["satellite"], whole["end_s"], whole["start_s"]))
    return Opportunities(**{name: values[order] for name, values in whole.items()})


def _rank_of(ids: Sequence[str], place: Ints, wanted: npt.NDArray[np.bool_]) -> Longs:
    rank = np.zeros(max(len(ids), 1), dtype=np.int64)
    rank[sorted(range(len(ids)), key=ids.__getitem__)] = np.arange(len(ids))
    return np.where(wanted, rank[np.where(wanted, place, 0)], 0)
