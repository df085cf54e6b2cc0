"""Pins compiled into a problem, so that every solver honours them.

Opportunities that are ruled out leave the table, and so do those that conflict with a kept action:
tasks of its satellite too close to turn, contacts on its antenna, other images of its target.
All others fit around all kept actions, and solvers need only take those (see
``Track.next_kept`` and the lower bounds of the mixed-integer programs).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
import numpy.typing as npt

from planner_core.errors import InvalidScenario
from planner_core.pinning.beside import Beside, excluded_by_kept
from planner_core.pinning.limits import check_limits
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
    RuledOutCollects,
)
from planner_core.problem.first_turns import too_soon
from planner_core.problem.on_board import imaged_before
from planner_core.problem.restrict import restricted
from planner_core.problem.ruled_out import HEADING, OUTAGE, PIN
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.transitions import may_follow_each

Reasons = npt.NDArray[np.int8]


def apply_pins(problem: Problem, pinned: Pinned) -> Problem:
    """Return the problem without opportunities that pins rule out or no first turn can reach.

    Raises
    ------
    InvalidScenario
        ``pins_conflict`` if two pins exclude each other, ``pin_breaks_limits`` if battery or
        recorder cannot keep its limits with one.
    """
    pinned = replace(pinned, kept=_without_repeats(pinned.kept))
    in_outage, is_too_soon = rows_in_outages(problem, pinned), too_soon(problem)
    is_ruled_out = _ruled_out(problem, pinned, in_outage | is_too_soon)
    _check_conflicts(problem, pinned, is_ruled_out, is_too_soon)
    beside = excluded_by_kept(problem, pinned.kept)
    is_ruled_out[beside.row] = True
    left = np.flatnonzero(~is_ruled_out).astype(np.int32)
    part = restricted(replace(problem, pinned=pinned), left)
    why = np.where(in_outage, OUTAGE, np.where(is_too_soon, HEADING, PIN)).astype(np.int8)
    part = replace(
        part,
        pinned=replace(
            part.pinned,
            skipped={},
            ruled_out=_ruled_out_collects(problem, pinned, is_ruled_out, beside, why),
        ),
        target_access=_access_left(problem, part),
    )
    start_s = problem.opportunities.start_s
    is_frozen = np.array([pinned.is_frozen(start_s[kept.row]) for kept in pinned.kept], np.bool_)
    facts = in_outage | is_too_soon
    facts[beside.row[is_frozen[beside.position]]] = True
    asked = [(pinned.kept[i], beside.of(i)) for i in np.flatnonzero(~is_frozen).tolist()]
    frozen = [pinned.kept[i] for i in np.flatnonzero(is_frozen).tolist()]
    check_limits(problem, list(_pins_that_rule_out(problem, pinned)), asked, frozen, facts)
    return part


def _without_repeats(kept: Iterable[Kept]) -> tuple[Kept, ...]:
    first: dict[int, Kept] = {}
    for one in kept:
        first.setdefault(one.row, one)
    return tuple(first.values())


def _check_conflicts(
    problem: Problem, pinned: Pinned, is_ruled_out: Bools, is_too_soon: Bools
) -> None:
    """Raise if a kept action is ruled out or excludes another one."""
    table = problem.opportunities
    ordered = sorted(pinned.kept, key=lambda kept: kept.row)
    rows = np.array([kept.row for kept in ordered], dtype=np.int64)
    cannot_follow = _cannot_follow(problem, rows)
    promised: dict[int, Kept] = {}
    last: dict[int, Kept] = {}
    for position, kept in enumerate(ordered):
        if is_too_soon[kept.row]:
            raise _conflict(
                kept, "the satellite cannot turn to it in time from its initial attitude"
            )
        if is_ruled_out[kept.row]:
            raise _conflict(kept, "another pin or an outage rules it out")
        satellite = int(table.satellite[kept.row])
        if cannot_follow[position]:
            raise _conflict(
                kept,
                "the satellite cannot turn to it in time from the action that "
                f"{last[satellite].pointer} keeps",
            )
        last[satellite] = kept
        if table.kind[kept.row] == COLLECT:
            other = promised.setdefault(int(table.site[kept.row]), kept)
            if other is not kept:
                raise _conflict(kept, f"{other.pointer} keeps another image of the same target")
    _check_antennas(problem, [kept for kept in ordered if table.kind[kept.row] == CONTACT])


def _cannot_follow(problem: Problem, rows: Longs) -> Bools:
    """Return which of these ascending rows cannot follow the previous row of their satellite."""
    found = np.zeros(len(rows), dtype=np.bool_)
    for index, satellite in enumerate(problem.satellites):
        own = np.flatnonzero(problem.opportunities.satellite[rows] == index)
        local = problem.local_row[rows[own]].astype(np.int64)
        found[own[1:]] = ~may_follow_each(satellite.transitions, local[:-1], local[1:])
    return found


def _check_antennas(problem: Problem, contacts: Sequence[Kept]) -> None:
    """Raise if kept contacts need more antennas at once than a station has."""
    table = problem.opportunities
    rows = np.array([kept.row for kept in contacts], dtype=np.int64)
    site, start_s, end_s = table.site[rows], table.start_s[rows], table.end_s[rows]
    for position, kept in enumerate(contacts):
        is_earlier = (
            (site == site[position])
            & (start_s <= start_s[position])
            & (end_s > start_s[position] + TIME_TOLERANCE_S)
        )
        is_earlier[position] = False
        earlier = np.flatnonzero(is_earlier)
        if len(earlier) >= problem.station_antennas[site[position]]:
            why = (
                "the station then serves the contact that "
                f"{contacts[int(earlier[0])].pointer} keeps"
            )
            raise _conflict(kept, why)


def _conflict(kept: Kept, why: str) -> InvalidScenario:
    detail = f"It cannot be kept: {why}."
    return InvalidScenario("pins_conflict", detail, pointer=kept.pointer)


def _ruled_out(problem: Problem, pinned: Pinned, facts: Bools) -> Bools:
    """Return the opportunities that are ruled out: frozen, imaged before, forbidden, pinned out.

    Parameters
    ----------
    facts
        Those in outages or too soon after the start to turn to; ruled out as well. Shape ``(n,)``.
    """
    table = problem.opportunities
    is_out = facts.copy()
    if pinned.frozen_until_s is not None:
        is_frozen = table.start_s < pinned.frozen_until_s - TIME_TOLERANCE_S
        is_frozen[[kept.row for kept in pinned.kept]] = False
        is_out |= is_frozen
    is_done = imaged_before(problem)
    is_done[[kept.row for kept in pinned.kept]] = False
    is_out |= is_done
    is_out |= (table.kind == COLLECT) & np.isin(table.site, sorted(pinned.forbidden))
    for _, rows in _pins_that_rule_out(problem, pinned):
        is_out[rows] = True
    return is_out


def _pins_that_rule_out(problem: Problem, pinned: Pinned) -> Iterator[tuple[str, Longs]]:
    """Yield each pin that skips or blocks, and the opportunities that it rules out."""
    for pointer, skipped in groupby(pinned.skipped, key=lambda row: pinned.skipped[row]):
        yield pointer, np.array(list(skipped))
    for blocked in pinned.blocked:
        if not blocked.is_outage:
            yield blocked.pointer, rows_in(problem, blocked)


def rows_in(problem: Problem, blocked: Blocked) -> Longs:
    """Return the opportunities that a blocked span rules out."""
    table = problem.opportunities
    whose = (
        table.satellite == blocked.satellite
        if blocked.station is None
        else (table.kind == CONTACT) & (table.site == blocked.station)
    )
    return np.flatnonzero(
        whose
        & np.isin(table.kind, sorted(blocked.kinds))
        & (table.start_s < blocked.end_s - TIME_TOLERANCE_S)
        & (table.end_s > blocked.start_s + TIME_TOLERANCE_S)
    )


def rows_in_outages(problem: Problem, pinned: Pinned) -> Bools:
    """Return which opportunities outages rule out. Shape ``(n,)``."""
    is_out = np.zeros(len(problem.opportunities), dtype=np.bool_)
    for blocked in pinned.blocked:
        if blocked.is_outage:
            is_out[rows_in(problem, blocked)] = True
    return is_out


def _ruled_out_collects(
    problem: Problem, pinned: Pinned, is_ruled_out: Bools, beside: Beside, why: Reasons
) -> RuledOutCollects:
    """Return the collects that are ruled out."""
    table = problem.opportunities
    rows = np.flatnonzero(is_ruled_out & (table.kind == COLLECT))
    rows = rows[np.argsort(table.site[rows], kind="stable")]
    # An opportunity may conflict with several kept actions: find its pairs in ``beside``.
    order = np.argsort(beside.row, kind="stable")
    first = beside.row[order].searchsorted(rows)
    count = beside.row[order].searchsorted(rows, side="right") - first
    first_kept = np.concatenate([[0], np.cumsum(count)])
    at = np.arange(first_kept[-1]) - np.repeat(first_kept[:-1] - first, count)
    kept = np.array([one.row for one in pinned.kept], dtype=np.int64)
    row_after = np.cumsum(~is_ruled_out) - 1
    return RuledOutCollects(
        target=table.site[rows],
        row=(rows if problem.origin is None else problem.origin[rows]).astype(np.int32),
        satellite=table.satellite[rows],
        start_s=table.start_s[rows],
        end_s=table.end_s[rows],
        why=why[rows],
        kept=row_after[kept[beside.position[order[at]]]].astype(np.int32),
        first_kept=first_kept,
    )


def _access_left(problem: Problem, part: Problem) -> Reasons:
    """Return why each target has no collect, with pins as a further cause."""
    is_lost = (problem.target_access == ACCESS_FOUND) & (np.diff(part.target_opportunities[1]) == 0)
    return np.where(is_lost, RULED_OUT, problem.target_access).astype(np.int8)
