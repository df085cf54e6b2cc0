"""Opportunities from accesses: collects placed inside them, contacts as whole accesses.

Times are counted in whole milliseconds, so that no placement depends on rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from planner_core.access.windows import Accesses
from planner_core.domain import (
    CollectAlignment,
    GroundStation,
    Nadir,
    Target,
)
from planner_core.errors import InvalidScenario
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.sites import (
    Sites,
    View,
    line_of_sight_teme,
    los_rate_deg_s,
    view,
)
from planner_core.problem import COLLECT, Opportunities

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]

Placed = tuple[Longs, Longs, Longs]
Columns = dict[str, npt.NDArray[Any]]

MOST_OPPORTUNITIES: Final = 10_000_000
"""In one scenario: their table takes two gigabytes while it is made."""
_MS_PER_S: Final = 1000
_CHUNK: Final = 16_384  # rows whose intermediate results fit the processor's cache
_SEEN: Final = (
    "los_start",
    "los_end",
    "los_rate_start",
    "los_rate_end",
    "off_nadir_deg",
    "elevation_deg",
    "azimuth_deg",
    "range_m",
    "sun_elevation_deg",
)


def check_number(num_opportunities: int) -> None:
    """Refuse more opportunities than fit in a machine's memory.

    Raises
    ------
    InvalidScenario
        ``too_many_opportunities``.
    """
    if num_opportunities > MOST_OPPORTUNITIES:
        raise InvalidScenario(
            "too_many_opportunities",
            f"The scenario offers more than {MOST_OPPORTUNITIES} opportunities: plan fewer "
            "satellites, targets or days, or give a longer collect_spacing_s.",
        )


def place_collects(
    accesses: Accesses,
    targets: Sequence[Target],
    spacing_s: float | None,
    alignment: CollectAlignment = "access",
) -> Placed:
    """Return the collects that accesses offer.

    Without a spacing: one in the middle of each access. With one: starts ``spacing_s`` apart, from
    the access's start on, and the last start that still fits; or, if aligned to the horizon, starts
    at multiples of the spacing from the horizon's start.

    Returns
    -------
    Row of the access, start and end in milliseconds. Shape ``(n,)`` each.
    """
    length_ms, room_ms = _room_ms(accesses, targets)
    start_ms = _ms(accesses.start_s)
    row = np.flatnonzero(room_ms >= 0)
    if spacing_s is None:
        begin = start_ms[row] + room_ms[row] // 2
    else:
        spaced = _spaced if alignment == "access" else _on_grid
        row, begin = spaced(row, start_ms[row], room_ms[row], max(spacing_s * _MS_PER_S, 1.0))
    return row, begin, begin + length_ms[row]


def have_room(accesses: Accesses, targets: Sequence[Target]) -> npt.NDArray[np.bool_]:
    """Return which accesses last at least as long as their target's collect. Shape ``(n,)``."""
    return np.asarray(_room_ms(accesses, targets)[1] >= 0)


def _room_ms(accesses: Accesses, targets: Sequence[Target]) -> tuple[Longs, Longs]:
    """Return how long each access's collect is, and how far it can be moved, in milliseconds."""
    length_s = np.array([target.collect_s for target in targets], dtype=np.float64)
    length_ms = np.ceil(length_s * _MS_PER_S - 1e-6).astype(np.int64)[accesses.site]
    return length_ms, _ms(accesses.end_s) - _ms(accesses.start_s) - length_ms


def _spaced(row: Longs, start_ms: Longs, room_ms: Longs, step_ms: float) -> tuple[Longs, Longs]:
    # Each step is rounded to the millisecond by itself, so half a millisecond may stick out.
    regular = ((room_ms + 0.5) / step_ms).astype(np.int64)
    last_ms = np.minimum(np.rint(regular * step_ms).astype(np.int64), room_ms)
    extra = (room_ms - last_ms > 1).astype(np.int64)
    counts = regular + 1 + extra
    check_number(int(counts.sum()))
    of = np.repeat(np.arange(len(row)), counts)
    k = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    into_ms = np.minimum(np.rint(k * step_ms).astype(np.int64), room_ms[of])
    return row[of], start_ms[of] + into_ms


def _on_grid(row: Longs, start_ms: Longs, room_ms: Longs, step_ms: float) -> tuple[Longs, Longs]:
    # Each multiple is rounded to the millisecond by itself, so half of one may lie outside.
    first = np.ceil((start_ms - 0.5) / step_ms).astype(np.int64)
    last = np.floor((start_ms + room_ms + 0.5) / step_ms).astype(np.int64)
    counts = np.maximum(last - first + 1, 0)
    check_number(int(counts.sum()))
    of = np.repeat(np.arange(len(row)), counts)
    k = first[of] + np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    begin = np.rint(k * step_ms).astype(np.int64)
    fits = (begin >= start_ms[of]) & (begin <= start_ms[of] + room_ms[of])
    return row[of[fits]], begin[fits]


def place_contacts(accesses: Accesses, stations: Sequence[GroundStation]) -> Placed:
    """Return the contacts: whole accesses of at least the station's ``min_contact_s``.

    An access no longer than the station's setup is not offered: nothing would be downlinked.
    """
    shortest_ms = np.array(
        [
            max(
                math.ceil(station.min_contact_s * _MS_PER_S - 1e-6),
                math.floor(station.setup_s * _MS_PER_S) + 1,
            )
            for station in stations
        ],
        dtype=np.int64,
    )[accesses.site]
    start_ms, end_ms = _ms(accesses.start_s), _ms(accesses.end_s)
    row = np.flatnonzero(end_ms - start_ms >= shortest_ms)
    return row, start_ms[row], end_ms[row]


def _ms(instant_s: Floats) -> Longs:
    return np.rint(instant_s * _MS_PER_S).astype(np.int64)


def rows_of(
    satellite: int, kind: int, accesses: Accesses, first_access: int, placed: Placed
) -> Columns:
    """Return one satellite's placed tasks as rows of the opportunity table, without geometry yet.

    Parameters
    ----------
    satellite, kind
        Index of the satellite; ``COLLECT`` or ``CONTACT``.
    first_access
        Number of the first access; the others follow.
    """
    row, start_ms, end_ms = placed
    return {
        "satellite": np.full(len(row), satellite, dtype=np.int32),
        "kind": np.full(len(row), kind, dtype=np.int8),
        "site": accesses.site[row],
        "access": (first_access + row).astype(np.int32),
        "start_s": start_ms / _MS_PER_S,
        "end_s": end_ms / _MS_PER_S,
        "access_start_s": accesses.start_s[row],
        "access_end_s": accesses.end_s[row],
    }


def in_order(
    parts: Sequence[Columns], target_ids: Sequence[str], station_ids: Sequence[str]
) -> Columns:
    """Return all rows sorted by (start, end, satellite, kind, site's id as text).

    Accesses are renumbered in order of first appearance, so that a number depends neither on
    accesses that offer nothing nor on what was searched together. Empties ``parts`` on the way, to
    save memory: a week of a constellation is large.
    """
    whole = {name: np.concatenate([part.pop(name) for part in parts]) for name in list(parts[0])}
    is_collect = whole["kind"] == COLLECT
    rank = np.where(
        is_collect,
        _rank_of(target_ids, whole["site"], is_collect),
        _rank_of(station_ids, whole["site"], ~is_collect),
    )
    order = np.lexsort((rank, whole["kind"], whole["satellite"], whole["end_s"], whole["start_s"]))
    whole["access"] = _numbered(whole["access"][order])
    return {
        name: whole.pop(name) if name == "access" else whole.pop(name)[order]
        for name in list(whole)
    }


def _numbered(access: Ints) -> Ints:
    """Return these numbers replaced by 0, 1, … in order of first appearance."""
    _, first, own = np.unique(access, return_index=True, return_inverse=True)
    number = np.empty(len(first), dtype=np.int32)
    number[np.argsort(first)] = np.arange(len(first))
    return number[own].astype(np.int32)


def _rank_of(ids: Sequence[str], site: Ints, wanted: npt.NDArray[np.bool_]) -> Longs:
    rank = np.zeros(max(len(ids), 1), dtype=np.int64)
    rank[sorted(range(len(ids)), key=ids.__getitem__)] = np.arange(len(ids))
    return np.where(wanted, rank[np.where(wanted, site, 0)], 0)


class Described:
    """The opportunity table while its geometry is filled in, satellite by satellite.

    The geometry is two thirds of the table. Filling it in place keeps a single copy, which
    matters as a week of a constellation has millions of rows.
    """

    def __init__(self, rows: Columns):
        count = len(rows["start_s"])
        self._rows = rows
        self._seen: Columns = {
            name: np.empty((count, 3)) if name.startswith("los") else np.empty(count, np.float32)
            for name in _SEEN
            if not name.startswith("los_rate")
        }
        for name in ("los_rate_start", "los_rate_end"):
            self._seen[name] = np.zeros((count, 3), dtype=np.float32)
        self._seen["in_eclipse"] = np.zeros(count, dtype=np.bool_)

    def fill(
        self,
        satellite: int,
        kind: int,
        ephemeris: Ephemeris,
        sites: Sites,
        nadir: Nadir,
        *,
        with_rates: bool = False,
    ) -> None:
        """Fill in the rows of one satellite and kind, and rates of lines of sight if asked for."""
        all_rows = np.flatnonzero(
            (self._rows["satellite"] == satellite) & (self._rows["kind"] == kind)
        )
        for first in range(0, len(all_rows), _CHUNK):
            rows = all_rows[first : first + _CHUNK]
            there = sites.at(self._rows["site"][rows])
            start_s, end_s = self._rows["start_s"][rows], self._rows["end_s"][rows]
            self._seen["los_start"][rows] = line_of_sight_teme(ephemeris, there, start_s)
            self._seen["los_end"][rows] = line_of_sight_teme(ephemeris, there, end_s)
            if with_rates:
                for name, at_s in (("los_rate_start", start_s), ("los_rate_end", end_s)):
                    self._seen[name][rows] = los_rate_deg_s(ephemeris, there, at_s)
            seen = view(ephemeris, there, 0.5 * (start_s + end_s), nadir)
            for field in fields(View):
                self._seen[field.name][rows] = getattr(seen, field.name)

    def table(self) -> Opportunities:
        """Return the finished table."""
        return Opportunities(**self._rows, **self._seen)
