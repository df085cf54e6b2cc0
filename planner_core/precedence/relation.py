"""Which tasks of one satellite can be in one plan at all, directly or with tasks in between.

While a satellite turns faster than its lines of sight, "b may follow a" is transitive: tasks
that cannot follow directly cannot be in one plan. A slow satellite may still reach b from a
by way of a task that turns it. The transitive closure covers both cases: two tasks that it does
not relate exclude each other, whatever else is planned.

The table of pairs grows with the square of the number of targets in view. Longest paths do without
it (``planner_core.precedence.skyline``); cutting planes, integer programs and networks with levels
test each pair many times, so the table is built when they first need it.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from planner_core.jit import kernel
from planner_core.problem import (
    Bools,
    Bytes,
    Ints,
    Longs,
    Problem,
    SatelliteProblem,
    Transitions,
    may_follow,
)
from planner_core.problem.slew import TIME_TOLERANCE_S, angle_between_deg, slew_s
from planner_core.problem.transitions import may_follow_each, near_spans


class Precedence(NamedTuple):
    """Which task of one satellite comes before which, as a table of pairs near in time.

    Row ``b`` may come after ``a`` when ``b >= far_from[a]`` (even the longest slew fits), or
    ``near_from[a] <= b < far_from[a]`` and bit ``offset[a] + b - near_from[a]`` is set.

    Attributes
    ----------
    near_from, far_from
        Shape ``(m,)``; the near rows of ``a`` are ``near_from[a]`` up to ``far_from[a]``.
    offset
        First bit of each row's near part. Shape ``(m + 1,)``.
    bits
        Packed, least significant bit first.
    """

    near_from: Ints
    far_from: Ints
    offset: Longs
    bits: Bytes


_tables: WeakKeyDictionary[SatelliteProblem, Precedence] = WeakKeyDictionary()
_closures: WeakKeyDictionary[SatelliteProblem, Precedence] = WeakKeyDictionary()
_is_transitive: WeakKeyDictionary[SatelliteProblem, bool] = WeakKeyDictionary()
_far_from: WeakKeyDictionary[SatelliteProblem, Ints] = WeakKeyDictionary()


def direct_precedence(satellite: SatelliteProblem) -> Precedence:
    """Return which task may follow which directly; built once per satellite of a problem."""
    table = _tables.get(satellite)
    if table is None:
        near_from, far_from = near_spans(satellite.transitions)
        offset = np.concatenate([[0], np.cumsum(far_from.astype(np.int64) - near_from)])
        # Whole words and two to spare, so that kernels may read any 64 bits at once.
        bits = np.zeros(8 * (int(offset[-1]) // 64 + 3), dtype=np.uint8)
        table = Precedence(near_from, far_from, offset, bits)
        _fill_bits(satellite.transitions, table)
        _tables[satellite] = table
    return table


def transitive_closure(satellite: SatelliteProblem) -> Precedence:
    """Return "b may follow a, directly or with tasks in between"; the same table if transitive."""
    closure = _closures.get(satellite)
    if closure is None:
        closure = direct_precedence(satellite)
        if not is_transitive_on(satellite):
            closure = closure._replace(bits=_closure_bits(closure))
        _closures[satellite] = closure
    return closure


def is_transitive_on(satellite: SatelliteProblem) -> bool:
    """Return whether the satellite reaches by way of tasks only what it can reach directly."""
    found = _is_transitive.get(satellite)
    if found is None:
        found = _is_transitive[satellite] = _gains_no_way(satellite)
    return found


def _gains_no_way(satellite: SatelliteProblem) -> bool:
    turning = turns_slower_than_it_tracks(satellite.transitions)
    if satellite.transitions.is_moving:
        # The time of a turn in motion is overestimated: a detour by any task might take less.
        turning = np.ones_like(turning)
    return not turning.any() or not _is_shortcut_missing(direct_precedence(satellite), turning)


def is_transitive(problem: Problem) -> bool:
    """Return whether this holds for every satellite; see ``is_transitive_on``."""
    return all(is_transitive_on(satellite) for satellite in problem.satellites)


def num_near_pairs(problem: Problem) -> int:
    """Return how many pairs of tasks are near enough in time to exclude each other."""
    pairs = 0
    for satellite in problem.satellites:
        _, far_from = near_spans(satellite.transitions)
        pairs += int((far_from - np.arange(1, len(satellite) + 1)).sum())
    return pairs


@kernel
def _fill_bits(transitions: Transitions, table: Precedence) -> None:
    for a in range(len(table.near_from)):
        for b in range(table.near_from[a], table.far_from[a]):
            if may_follow(transitions, a, b):
                bit = table.offset[a] + b - table.near_from[a]
                table.bits[bit >> 3] |= np.uint8(1 << (bit & 7))


@kernel
def turns_slower_than_it_tracks(transitions: Transitions) -> Bools:
    """Return the tasks that turn a satellite further than a slew of their length would.

    Slew times grow with the angle, and two slews take no less than one through both angles.
    So if no task in between is one of these, what may follow by way of others may also directly.
    """
    looks, looked, slews = transitions.looks, transitions.looked, transitions.slews
    found = np.zeros(len(looks), dtype=np.bool_)
    for i in range(len(looks)):
        turned_deg = angle_between_deg(
            (looks[i, 0], looks[i, 1], looks[i, 2]), (looked[i, 0], looked[i, 1], looked[i, 2])
        )
        needed_s = slew_s(turned_deg, slews.rate_deg_s, slews.acceleration_deg_s2)
        # Both slews of a detour may have used the tolerance, and a detour settles once more.
        found[i] = (
            needed_s - slews.settle_s + TIME_TOLERANCE_S
            > transitions.end_s[i] - transitions.start_s[i]
        )
    return found


@kernel
def comes_before(precedence: Precedence, a: int, b: int) -> bool:
    """Return whether row ``a`` is related to the later row ``b``."""
    if b >= precedence.far_from[a]:
        return True
    if b < precedence.near_from[a]:
        return False
    bit = precedence.offset[a] + b - precedence.near_from[a]
    return bool((precedence.bits[bit >> 3] >> (bit & 7)) & 1)


@kernel
def are_comparable(precedence: Precedence, a: int, b: int) -> bool:
    """Return whether two different rows are related, whichever comes first."""
    return comes_before(precedence, a, b) if a < b else comes_before(precedence, b, a)


def excluded_beside(
    satellite: SatelliteProblem, rows: Ints, among: Ints | None = None
) -> tuple[Longs, Longs]:
    """Return pairs of tasks, the first from some local rows, that cannot be in one plan.

    They are in order, as the position of the first in ``rows`` and the local row of the other.

    Parameters
    ----------
    among
        The tasks that may be the other, in order; all by default.
    """
    begin, end = near_in_time(satellite, rows)
    if among is not None:
        begin, end = among.searchsorted(begin), among.searchsorted(end)
    count = end - begin
    position = np.repeat(np.arange(len(rows)), count)
    first_of = np.cumsum(count) - count
    other = np.arange(len(position)) - np.repeat(first_of - begin, count)
    if among is not None:
        other = among[other].astype(np.int64)
    one = rows[position].astype(np.int64)
    is_excluded = ~fit_beside(satellite, one, other) & (one != other)
    return position[is_excluded], other[is_excluded]


def fit_beside(satellite: SatelliteProblem, one: Longs, other: Longs) -> Bools:
    """Return for each pair of local rows whether both can be in one plan. Shape ``(k,)``."""
    earlier, later = np.minimum(one, other), np.maximum(one, other)
    if is_transitive_on(satellite):
        return may_follow_each(satellite.transitions, earlier, later)
    return _come_before(transitive_closure(satellite), earlier, later)


def near_in_time(satellite: SatelliteProblem, rows: Ints | Longs) -> tuple[Longs, Longs]:
    """Return for each of these local rows the range that it may exclude: first, last + 1."""
    far_from = _far_from.get(satellite)
    if far_from is None:
        _, far_from = near_spans(satellite.transitions)
        _far_from[satellite] = far_from
    # Tasks outside the range may come before or after the row even by the longest slew.
    begin = np.maximum.accumulate(far_from).searchsorted(rows, side="right")
    return begin, np.maximum(far_from[rows], rows + 1).astype(np.int64)


@kernel
def _come_before(precedence: Precedence, first: Longs, second: Longs) -> Bools:
    found = np.zeros(len(first), dtype=np.bool_)
    for i in range(len(first)):
        found[i] = first[i] != second[i] and comes_before(precedence, first[i], second[i])
    return found


@kernel
def _is_shortcut_missing(direct: Precedence, turning: Bools) -> bool:
    """Return whether some c may follow a by way of a turning task, but not directly."""
    for a in range(len(turning)):
        for b in range(direct.near_from[a], direct.far_from[a]):
            if not turning[b] or not comes_before(direct, a, b):
                continue
            for c in range(direct.near_from[b], direct.far_from[a]):
                if comes_before(direct, b, c) and not comes_before(direct, a, c):
                    return True
    return False


@kernel
def _closure_bits(direct: Precedence) -> Bytes:
    """Return the closure's bits, from the last task back: followers, and what they reach."""
    bits = direct.bits.copy()
    closed = Precedence(direct.near_from, direct.far_from, direct.offset, bits)
    for a in range(len(direct.near_from) - 1, -1, -1):
        for b in range(direct.near_from[a], direct.far_from[a]):
            if not comes_before(direct, a, b):
                continue
            for c in range(direct.near_from[b], direct.far_from[a]):
                if comes_before(closed, b, c):
                    bit = direct.offset[a] + c - direct.near_from[a]
                    bits[bit >> 3] |= np.uint8(1 << (bit & 7))
    return bits
