"""Pins compiled into a problem, so that every solver honours them.

What is ruled out leaves the table, and so does what could not stand beside a kept action:
tasks of its satellite too close to turn, contacts of its antenna, other images of its target.
What is left fits around all kept actions, and solvers need only take those (see
``Track.next_kept`` and the programs' lower bounds).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from itertools import groupby
from typing import NamedTuple

import numpy as np

from planner_core.domain import Replan, Scenario
from planner_core.errors import InvalidScenario
from planner_core.pinning.limits import check_limits
from planner_core.pinning.pinned_starts import (
    open_when_turned_to,
    whole_accesses,
    with_pinned_starts,
)
from planner_core.pins import PinnedAction
from planner_core.precedence.relation import excluded_by
from planner_core.problem import (
    ACCESS_FOUND,
    COLLECT,
    CONTACT,
    RULED_OUT,
    Blocked,
    Bools,
    Ints,
    Kept,
    Longs,
    Opportunities,
    Pinned,
    Problem,
    Struck,
)
from planner_core.problem.delivery import least_age_s
from planner_core.problem.first_turns import too_soon
from planner_core.problem.on_board import imaged_before
from planner_core.problem.restrict import restricted
from planner_core.problem.slew import TIME_TOLERANCE_S

_NEARLY_S = 1.0  # bookings are made in whole seconds
_KINDS = {"collect": COLLECT, "contact": CONTACT}


def pinned_problem(scenario: Scenario, problem: Problem) -> Problem:
    """Return the problem of a scenario with its pins, and first turns, compiled in.

    Raises
    ------
    InvalidScenario
        ``pin_without_opportunity``, ``pin_ambiguous``, ``pins_conflict`` or
        ``pin_breaks_limits``, with a pointer into ``/pins``.
    """
    has_heading = any(satellite.heading is not None for satellite in problem.satellites)
    asked = scenario.pins or scenario.outages or scenario.replan
    if not (asked or has_heading or problem.on_board):
        return problem
    pins, table = scenario.pins, problem.opportunities
    whole = table if problem.pointing is None else whole_accesses(problem)
    named = Named(scenario, whole, problem.origin)
    kept = [row_of(named, pin, f"/pins/keep/{i}") for i, pin in enumerate(pins.keep)]
    skipped = [rows_skipped(named, pin, f"/pins/skip/{i}") for i, pin in enumerate(pins.skip)]
    if problem.pointing is not None:
        accesses = [table.access[rows] for rows in skipped]
        problem, kept = with_pinned_starts(scenario, problem, kept)
        problem, kept = open_when_turned_to(problem, kept)
        skipped = [
            np.flatnonzero(np.isin(problem.opportunities.access, own)).tolist() for own in accesses
        ]
    pinned = resolve(scenario, kept, skipped)
    if scenario.replan is not None:
        pinned = with_frozen(scenario, problem, pinned, scenario.replan)
    return apply_pins(problem, pinned)


def with_frozen(scenario: Scenario, problem: Problem, pinned: Pinned, replan: Replan) -> Pinned:
    """Return the pins with what starts before the freeze, and promises with a date.

    An action of the base that an outage takes, or that is no longer offered, is not kept.
    """
    table = problem.opportunities
    frozen_until_s = scenario.horizon.offset_s(replan.freeze_until)
    in_outage = _in_outages(problem, pinned)
    rows = rows_of_base(scenario, table, replan)
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    offset_s, down_s = scenario.horizon.offset_s, None
    late: dict[int, str] = {}
    for i, promise in enumerate(replan.promises):
        own = problem.collects_of(targets[promise.target_id])
        is_late = np.zeros(len(own), dtype=np.bool_)
        if promise.image_by is not None:
            is_late |= table.end_s[own] > offset_s(promise.image_by) + TIME_TOLERANCE_S
        if promise.deliver_by is not None:
            # At the earliest, whatever else is done.
            down_s = table.end_s + least_age_s(problem) if down_s is None else down_s
            is_late |= down_s[own] > offset_s(promise.deliver_by) + TIME_TOLERANCE_S
        late |= {int(row): f"/replan/promises/{i}" for row in own[is_late]}
    pinned = replace(pinned, frozen_until_s=frozen_until_s, skipped={**late, **pinned.skipped})
    return replace(
        pinned,
        kept=(
            *pinned.kept,
            *(
                Kept(row=row, pointer=f"/replan/base/{i}")
                for i, row in rows.items()
                if pinned.is_frozen(_start_s(scenario, replan, i)) and not in_outage[row]
            ),
        ),
    )


def rows_of_base(scenario: Scenario, table: Opportunities, replan: Replan) -> dict[int, int]:
    """Return the opportunities that the actions of the plan before are, by their number.

    What is no longer offered is left out.
    """
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    stations = {station.id: i for i, station in enumerate(scenario.ground_stations)}
    num_places = 1 + max(len(targets), len(stations))
    keys = (table.satellite.astype(np.int64) * 2 + table.kind) * num_places + table.place
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    found: dict[int, int] = {}
    for i, action in enumerate(replan.base):
        assert action.satellite_id is not None
        assert action.start is not None
        if action.start < scenario.horizon.start:
            continue
        kind, place = (
            (COLLECT, targets[action.target_id])
            if action.target_id is not None
            else (CONTACT, stations[action.station_id or ""])
        )
        start_s = scenario.horizon.offset_s(action.start)
        key = (satellites[action.satellite_id] * 2 + kind) * num_places + place
        rows = order[keys.searchsorted(key) : keys.searchsorted(key, "right")].tolist()
        nearest = min(rows, key=lambda row: abs(table.start_s[row] - start_s), default=None)
        if nearest is not None and abs(table.start_s[nearest] - start_s) <= replan.near_s:
            found[i] = nearest
    return found


def _start_s(scenario: Scenario, replan: Replan, number: int) -> float:
    start = replan.base[number].start
    assert start is not None
    return scenario.horizon.offset_s(start)


def resolve(scenario: Scenario, kept: Sequence[int], skipped: Sequence[Sequence[int]]) -> Pinned:
    """Return the scenario's pins in terms of its problem, where these rows are meant."""
    pins = scenario.pins
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    offset_s = scenario.horizon.offset_s
    return Pinned(
        kept=tuple(Kept(row=row, pointer=f"/pins/keep/{i}") for i, row in enumerate(kept)),
        skipped={row: f"/pins/skip/{i}" for i, rows in enumerate(skipped) for row in rows},
        blocked=(
            *(
                Blocked(
                    satellite=satellites[pin.satellite_id],
                    start_s=offset_s(pin.start),
                    end_s=offset_s(pin.end),
                    kinds=frozenset(_KINDS[mode] for mode in pin.modes),
                    pointer=f"/pins/block/{i}",
                )
                for i, pin in enumerate(pins.block)
            ),
            *_outages(scenario),
        ),
        forbidden=frozenset(targets[target_id] for target_id in pins.forbid),
    )


def _outages(scenario: Scenario) -> Iterator[Blocked]:
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    stations = {station.id: i for i, station in enumerate(scenario.ground_stations)}
    for i, outage in enumerate(scenario.outages):
        is_station = outage.station_id is not None
        yield Blocked(
            satellite=None if outage.satellite_id is None else satellites[outage.satellite_id],
            station=None if outage.station_id is None else stations[outage.station_id],
            start_s=scenario.horizon.offset_s(outage.start),
            end_s=scenario.horizon.offset_s(outage.end),
            kinds=frozenset({CONTACT} if is_station else (_KINDS[mode] for mode in outage.modes)),
            pointer=f"/outages/{i}",
        )


class Named(NamedTuple):
    """Opportunities by the names that operators give them.

    Attributes
    ----------
    origin
        The number of each, where that is not its row.
    """

    scenario: Scenario
    table: Opportunities
    origin: Ints | None = None


def rows_skipped(named: Named, pin: PinnedAction, pointer: str) -> list[int]:
    """Return the opportunities that a skip means: of a span all that overlap it.

    A span that is some opportunity's own, give or take a second, means that one alone; of a pass
    it means every part.
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
    """Return the opportunities that are of the satellite, target or station that a pin names."""
    scenario, table = named.scenario, named.table
    fits = np.ones(len(table), dtype=np.bool_)
    if pin.satellite_id is not None:
        ids = [satellite.id for satellite in scenario.satellites]
        fits &= table.satellite == ids.index(pin.satellite_id)
    if pin.target_id is not None:
        ids = [target.id for target in scenario.targets]
        fits &= (table.kind == COLLECT) & (table.place == ids.index(pin.target_id))
    if pin.station_id is not None:
        ids = [station.id for station in scenario.ground_stations]
        fits &= (table.kind == CONTACT) & (table.place == ids.index(pin.station_id))
    if pin.opportunity_id is not None:
        numbers = np.arange(len(table)) if named.origin is None else named.origin
        fits &= numbers == _number_of(pin.opportunity_id)
    return fits


def row_of(named: Named, pin: PinnedAction, pointer: str) -> int:
    """Return the opportunity that an operator's words mean."""
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
            f"It names {len(rows)} opportunities; a start would tell which one is meant.",
            pointer=pointer,
        )
    return int(rows[np.argmin(np.abs(table.start_s[rows] - start_s))])


def _are_parts(table: Opportunities, rows: Longs) -> bool:
    """Return whether these are parts of one and the same pass."""
    is_contact = bool((table.kind[rows] == CONTACT).all())
    return is_contact and len(np.unique(table.access[rows])) == 1


def _meant_by(table: Opportunities, row: int, pin: PinnedAction) -> list[int]:
    """Return all rows that skipping one of them means: of a pass every part."""
    if table.kind[row] != CONTACT or pin.opportunity_id is not None:
        return [row]
    rows: list[int] = np.flatnonzero(table.access == table.access[row]).tolist()
    return rows


def _number_of(opportunity_id: str) -> int:
    found = re.fullmatch(r"o(\d{1,9})", opportunity_id, re.ASCII)
    return int(found[1]) if found else -1


def _why_none(scenario: Scenario, table: Opportunities, named: Longs, pin: PinnedAction) -> str:
    if len(named) == 0 or pin.start is None:
        return "The scenario has no opportunity like this."
    away_s = np.abs(table.start_s[named] - scenario.horizon.offset_s(pin.start))
    nearest: datetime = scenario.horizon.instant(float(table.start_s[named[np.argmin(away_s)]]))
    return f"No opportunity then; the nearest one starts at {nearest:%Y-%m-%dT%H:%M:%SZ}."


def apply_pins(problem: Problem, pinned: Pinned) -> Problem:
    """Return the problem without what the pins rule out, and what nobody can turn to in time.

    Raises
    ------
    InvalidScenario
        ``pins_conflict`` where two pins exclude each other, ``pin_breaks_limits`` where battery
        or recorder cannot bear one.
    """
    pinned = replace(pinned, kept=_without_repeats(pinned.kept))
    _check_conflicts(problem, pinned)
    in_outage, is_too_soon = _in_outages(problem, pinned), too_soon(problem)
    n = len(problem.opportunities)
    beside = _kept_that_exclude(problem, pinned)
    is_struck = _ruled_out(problem, pinned)
    for _, excluded in beside:
        is_struck[excluded] = True
    whole = replace(problem, pinned=pinned)
    left = np.flatnonzero(~is_struck).astype(np.int32)
    part = restricted(whole, left)
    place = np.full(n, -1)
    place[left] = np.arange(len(left))
    keepers = [(int(place[kept.row]), excluded) for kept, excluded in beside]
    part = replace(
        part,
        pinned=replace(
            part.pinned,
            skipped={},
            struck=_struck(problem, is_struck, keepers, in_outage, is_too_soon),
        ),
        target_access=_access_left(problem, part),
    )
    facts, frozen, asked = in_outage | is_too_soon, [], []
    for kept, excluded in beside:
        if pinned.is_frozen(float(problem.opportunities.start_s[kept.row])):
            facts[excluded] = True
            frozen.append(kept)
        else:
            asked.append((kept, excluded))
    check_limits(problem, list(_pins_that_rule_out(problem, pinned)), asked, frozen, facts)
    return part


def _without_repeats(kept: Iterable[Kept]) -> tuple[Kept, ...]:
    first: dict[int, Kept] = {}
    for one in kept:
        first.setdefault(one.row, one)
    return tuple(first.values())


def _check_conflicts(problem: Problem, pinned: Pinned) -> None:
    """Raise where a kept action is ruled out, or excludes another one."""
    table = problem.opportunities
    ruled_out, is_too_soon = _ruled_out(problem, pinned), too_soon(problem)
    ordered = sorted(pinned.kept, key=lambda kept: kept.row)
    promised: dict[int, Kept] = {}
    last: dict[int, Kept] = {}
    for kept in ordered:
        if is_too_soon[kept.row]:
            raise _conflict(
                kept, "the satellite cannot turn to it in time from where it looked at the start"
            )
        if ruled_out[kept.row]:
            raise _conflict(kept, "another pin or an outage rules it out")
        satellite = int(table.satellite[kept.row])
        before = last.get(satellite)
        local = problem.local_row
        transitions = problem.satellites[satellite].transitions
        if before is not None and not transitions.allows(local[before.row], local[kept.row]):
            raise _conflict(
                kept,
                f"the satellite cannot turn to it in time from the action that {before.pointer} "
                "keeps",
            )
        last[satellite] = kept
        if table.kind[kept.row] == COLLECT:
            other = promised.setdefault(int(table.place[kept.row]), kept)
            if other is not kept:
                raise _conflict(kept, f"{other.pointer} keeps another image of the same target")
    contacts = [kept for kept in ordered if table.kind[kept.row] == CONTACT]
    for kept in contacts:
        earlier = [
            other
            for other in contacts
            if other is not kept
            and table.place[other.row] == table.place[kept.row]
            and table.start_s[other.row] <= table.start_s[kept.row]
            and table.end_s[other.row] > table.start_s[kept.row] + TIME_TOLERANCE_S
        ]
        if len(earlier) >= problem.station_antennas[table.place[kept.row]]:
            raise _conflict(kept, f"the station then serves what {earlier[0].pointer} keeps")


def _conflict(kept: Kept, why: str) -> InvalidScenario:
    detail = f"It cannot be kept: {why}."
    return InvalidScenario("pins_conflict", detail, pointer=kept.pointer)


def _ruled_out(problem: Problem, pinned: Pinned) -> Bools:
    """Return the opportunities that are forbidden, skipped, blocked, out, too soon or no use."""
    table = problem.opportunities
    is_out: Bools = _in_outages(problem, pinned) | too_soon(problem)
    if pinned.frozen_until_s is not None:
        is_frozen = table.start_s < pinned.frozen_until_s - TIME_TOLERANCE_S
        is_frozen[[kept.row for kept in pinned.kept]] = False
        is_out |= is_frozen
    is_done = imaged_before(problem)
    is_done[[kept.row for kept in pinned.kept]] = False
    is_out |= is_done
    is_out |= (table.kind == COLLECT) & np.isin(table.place, sorted(pinned.forbidden))
    for _, rows in _pins_that_rule_out(problem, pinned):
        is_out[rows] = True
    return is_out


def _pins_that_rule_out(problem: Problem, pinned: Pinned) -> Iterator[tuple[str, Longs]]:
    """Yield pins that skip or block, and the opportunities that each is about."""
    for pointer, skipped in groupby(pinned.skipped, key=lambda row: pinned.skipped[row]):
        yield pointer, np.array(list(skipped))
    for blocked in pinned.blocked:
        if not blocked.is_outage:
            yield blocked.pointer, rows_in(problem, blocked)


def rows_in(problem: Problem, blocked: Blocked) -> Longs:
    """Return the opportunities that a blocked span takes."""
    table = problem.opportunities
    whose = (
        table.satellite == blocked.satellite
        if blocked.station is None
        else (table.kind == CONTACT) & (table.place == blocked.station)
    )
    return np.flatnonzero(
        whose
        & np.isin(table.kind, sorted(blocked.kinds))
        & (table.start_s < blocked.end_s - TIME_TOLERANCE_S)
        & (table.end_s > blocked.start_s + TIME_TOLERANCE_S)
    )


def _in_outages(problem: Problem, pinned: Pinned) -> Bools:
    """Return the opportunities that outages take."""
    is_out = np.zeros(len(problem.opportunities), dtype=np.bool_)
    for blocked in pinned.blocked:
        if blocked.is_outage:
            is_out[rows_in(problem, blocked)] = True
    return is_out


def _kept_that_exclude(problem: Problem, pinned: Pinned) -> list[tuple[Kept, Longs]]:
    """Return for each kept action the opportunities that cannot stand beside it, ascending."""
    table = problem.opportunities
    contacts = np.array(
        [kept.row for kept in pinned.kept if table.kind[kept.row] == CONTACT], dtype=np.int64
    )
    is_kept = np.zeros(len(table), dtype=np.bool_)
    is_kept[[kept.row for kept in pinned.kept]] = True
    found = []
    for kept in pinned.kept:
        satellite = problem.satellites[int(table.satellite[kept.row])]
        beside = satellite.rows[excluded_by(satellite, int(problem.local_row[kept.row]))]
        if table.kind[kept.row] == COLLECT:
            others = problem.collects_of(int(table.place[kept.row])).astype(np.int64)
        else:
            others = np.flatnonzero(_without_antenna(problem, kept.row, contacts))
        rows = np.union1d(beside.astype(np.int64), others)
        found.append((kept, rows[~is_kept[rows]]))
    return found


def _without_antenna(problem: Problem, row: int, kept: Longs) -> Bools:
    """Return the contacts that find no antenna where ``row`` and other ``kept`` ones run."""
    table = problem.opportunities
    station = table.place[row]
    there = kept[table.place[kept] == station]
    others = np.flatnonzero((table.kind == CONTACT) & (table.place == station))
    excluded = np.zeros(len(table), dtype=np.bool_)
    for other in others:
        from_s = max(table.start_s[other], table.start_s[row])
        to_s = min(table.end_s[other], table.end_s[row])
        if to_s <= from_s + TIME_TOLERANCE_S:
            continue
        is_running = (table.start_s[there] <= from_s) & (
            table.end_s[there] > from_s + TIME_TOLERANCE_S
        )
        excluded[other] = is_running.sum() >= problem.station_antennas[station]
    return excluded


def _struck(
    problem: Problem,
    is_struck: Bools,
    keepers: list[tuple[int, Longs]],
    in_outage: Bools,
    is_too_soon: Bools,
) -> dict[int, tuple[Struck, ...]]:
    """Return the collects that are ruled out, by target."""
    table = problem.opportunities
    beside: dict[int, list[int]] = {}
    for kept, excluded in keepers:
        for row in excluded.tolist():
            beside.setdefault(row, []).append(kept)
    found: dict[int, list[Struck]] = {}
    for row in np.flatnonzero(is_struck & (table.kind == COLLECT)).tolist():
        struck = Struck(
            row=problem.scenario_row(row),
            satellite=int(table.satellite[row]),
            start_s=float(table.start_s[row]),
            end_s=float(table.end_s[row]),
            kept=tuple(beside.get(row, ())),
            why="outage" if in_outage[row] else "heading" if is_too_soon[row] else "pin",
        )
        found.setdefault(int(table.place[row]), []).append(struck)
    return {target: tuple(struck) for target, struck in found.items()}


def _access_left(problem: Problem, part: Problem) -> np.ndarray:
    """Return why targets have no collect, pins included."""
    is_lost = (problem.target_access == ACCESS_FOUND) & (np.diff(part.target_opportunities[1]) == 0)
    return np.where(is_lost, RULED_OUT, problem.target_access).astype(np.int8)
