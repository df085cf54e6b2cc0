"""Which opportunities the names in pins and plans mean."""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from datetime import datetime
from typing import NamedTuple

import numpy as np

from planner_core.domain import Replan, Scenario
from planner_core.errors import InvalidScenario
from planner_core.pins import PinnedAction
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Ints,
    Longs,
    Opportunities,
)
from planner_core.problem.slew import TIME_TOLERANCE_S

_NEARLY_S = 1.0  # bookings are made in whole seconds
KINDS = {"collect": COLLECT, "contact": CONTACT}


def rows_of_base(scenario: Scenario, table: Opportunities, replan: Replan) -> dict[int, int]:
    """Return the opportunity of each action of the previous plan, by the action's number.

    Actions that are no longer offered are left out.
    """
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    stations = {station.id: i for i, station in enumerate(scenario.ground_stations)}
    num_sites = 1 + max(len(targets), len(stations))
    keys = (table.satellite.astype(np.int64) * 2 + table.kind) * num_sites + table.site
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    wanted, offsets_s = {}, {}
    for i, action in enumerate(replan.base):
        assert action.satellite_id is not None
        assert action.start is not None
        if action.start < scenario.horizon.start:
            continue
        kind, site = (
            (COLLECT, targets[action.target_id])
            if action.target_id is not None
            else (CONTACT, stations[action.station_id or ""])
        )
        wanted[i] = (satellites[action.satellite_id] * 2 + kind) * num_sites + site
        offsets_s[i] = scenario.horizon.offset_s(action.start)
    asked = np.array(list(wanted.values()), dtype=np.int64)
    spans = zip(
        wanted, keys.searchsorted(asked).tolist(), keys.searchsorted(asked, "right").tolist(),
        strict=True,
    )  # fmt: skip
    # The opportunities of one satellite and site are in order of start.
    start_s = table.start_s[order].tolist()
    found: dict[int, int] = {}
    for i, low, high in spans:
        after = bisect_left(start_s, offsets_s[i], low, high)
        away_s = [
            (abs(start_s[at] - offsets_s[i]), at) for at in (after - 1, after) if low <= at < high
        ]
        nearest_s, at = min(away_s, default=(math.inf, -1))
        if nearest_s <= replan.near_s:
            found[i] = int(order[at])
    return found


class Named(NamedTuple):
    """Opportunities with what operators name them by.

    Attributes
    ----------
    origin
        The number of each, if that is not its row.
    """

    scenario: Scenario
    table: Opportunities
    origin: Ints | None = None


def rows_skipped(named: Named, pin: PinnedAction, pointer: str) -> list[int]:
    """Return the opportunities that a skip means: for a span, all that overlap it.

    A span that is an opportunity's own, to within a second, means that one alone; if that is part
    of a pass, every part.
    """
    scenario, table = named.scenario, named.table
    nearest = row_of(named, pin, pointer)
    if pin.start is None or pin.end is None:
        return _meant_by(table, nearest, pin)
    start_s, end_s = (scenario.horizon.offset_s(instant) for instant in (pin.start, pin.end))
    is_its_own = (
        abs(table.start_s[nearest] - start_s) <= _NEARLY_S
        and abs(table.end_s[nearest] - end_s) <= _NEARLY_S
    )
    if is_its_own:
        return _meant_by(table, nearest, pin)
    overlaps = (table.start_s < end_s - TIME_TOLERANCE_S) & (
        table.end_s > start_s + TIME_TOLERANCE_S
    )
    rows: list[int] = np.flatnonzero(_named_by(named, pin) & overlaps).tolist()
    return rows or _meant_by(table, nearest, pin)


def _named_by(named: Named, pin: PinnedAction) -> Bools:
    """Return the opportunities of the satellite, target or station that a pin names."""
    scenario, table = named.scenario, named.table
    fits = np.ones(len(table), dtype=np.bool_)
    if pin.satellite_id is not None:
        ids = [satellite.id for satellite in scenario.satellites]
        fits &= table.satellite == ids.index(pin.satellite_id)
    if pin.target_id is not None:
        ids = [target.id for target in scenario.targets]
        fits &= (table.kind == COLLECT) & (table.site == ids.index(pin.target_id))
    if pin.station_id is not None:
        ids = [station.id for station in scenario.ground_stations]
        fits &= (table.kind == CONTACT) & (table.site == ids.index(pin.station_id))
    if pin.opportunity_id is not None:
        numbers = np.arange(len(table)) if named.origin is None else named.origin
        fits &= numbers == _number_of(pin.opportunity_id)
    return fits


def row_of(named: Named, pin: PinnedAction, pointer: str) -> int:
    """Return the opportunity that a pin means."""
    scenario, table = named.scenario, named.table
    fits = _named_by(named, pin)
    like_it = np.flatnonzero(fits)
    start_s = 0.0
    if pin.start is not None:
        start_s = scenario.horizon.offset_s(pin.start)
        end_s = start_s if pin.end is None else scenario.horizon.offset_s(pin.end)
        fits &= (table.start_s <= end_s + _NEARLY_S) & (table.end_s >= start_s - _NEARLY_S)
    rows = np.flatnonzero(fits)
    if len(rows) == 0:
        raise InvalidScenario(
            "pin_without_opportunity", _why_none(scenario, table, like_it, pin), pointer=pointer
        )
    if pin.start is None and len(rows) > 1 and _are_parts(table, rows):
        return int(rows[np.argmax(table.end_s[rows] - table.start_s[rows])])
    if pin.start is None and len(rows) > 1:
        raise InvalidScenario(
            "pin_ambiguous",
            f"It matches {len(rows)} opportunities; give a start to say which one.",
            pointer=pointer,
        )
    return int(rows[np.argmin(np.abs(table.start_s[rows] - start_s))])


def _are_parts(table: Opportunities, rows: Longs) -> bool:
    """Return whether these are parts of the same pass."""
    is_contact = bool((table.kind[rows] == CONTACT).all())
    return is_contact and len(np.unique(table.access[rows])) == 1


def _meant_by(table: Opportunities, row: int, pin: PinnedAction) -> list[int]:
    """Return all rows that are skipped with one: for a contact, every part of its pass."""
    if table.kind[row] != CONTACT or pin.opportunity_id is not None:
        return [row]
    rows: list[int] = np.flatnonzero(table.access == table.access[row]).tolist()
    return rows


def _number_of(opportunity_id: str) -> int:
    found = re.fullmatch(r"o(\d{1,9})", opportunity_id, re.ASCII)
    return int(found[1]) if found else -1


def _why_none(scenario: Scenario, table: Opportunities, named: Longs, pin: PinnedAction) -> str:
    if len(named) == 0 or pin.start is None:
        return "The scenario has no such opportunity."
    away_s = np.abs(table.start_s[named] - scenario.horizon.offset_s(pin.start))
    nearest: datetime = scenario.horizon.instant(float(table.start_s[named[np.argmin(away_s)]]))
    return (
        "There is no opportunity at that time; the nearest one starts at "
        f"{nearest:%Y-%m-%dT%H:%M:%SZ}."
    )
