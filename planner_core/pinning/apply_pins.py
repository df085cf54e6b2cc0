"""Pins compiled into a problem, so that every solver honours them.

What is ruled out leaves the table, and so does what could not stand beside a kept action:
tasks of its satellite too close to turn, contacts of its antenna, other images of its target.
What is left fits around all kept actions, and solvers need only take those (see
``Track.next_kept`` and the programs' lower bounds).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import groupby

import numpy as np

from planner_core.errors import InvalidScenario
from planner_core.pinning.limits import check_limits
from planner_core.precedence.relation import excluded_by
from planner_core.problem import (
    ACCESS_FOUND,
    COLLECT,
    CONTACT,
    RULED_OUT,
    Blocked,
    Bools,
    Kept,
    Longs,
    Pinned,
    Problem,
    Struck,
)
from planner_core.problem.first_turns import too_soon
from planner_core.problem.on_board import imaged_before
from planner_core.problem.restrict import restricted
from planner_core.problem.slew import TIME_TOLERANCE_S


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
    in_outage, is_too_soon = rows_in_outages(problem, pinned), too_soon(problem)
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
    is_out: Bools = rows_in_outages(problem, pinned) | too_soon(problem)
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


def rows_in_outages(problem: Problem, pinned: Pinned) -> Bools:
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
