"""Which tasks of one satellite can stand in one plan at all, directly or with tasks between.

While a satellite turns faster than its lines of sight, "b may follow a" is transitive: what
cannot follow directly cannot stand in one plan. A slow satellite may still reach b from a
by way of a task that turns it. The transitive closure covers both: two tasks that it does not
relate exclude each other, whatever else is planned.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

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
)
from planner_core.problem.slew import (
    INSTANT,
    TIME_TOLERANCE_S,
    angle_between_deg,
    slew_s,
)


class Order(NamedTuple):
    """A partial order of one satellite's tasks in the sparse layout of ``Transitions``."""

    near_from: Ints
    far_from: Ints
    offset: Longs
    bits: Bytes


def order_of(transitions: Transitions) -> Order:
    """Return the arrays of a transition table, for kernels."""
    return Order(transitions.near_from, transitions.far_from, transitions.offset, transitions.bits)


def transitive_closure(problem: Problem, satellite: SatelliteProblem) -> Transitions:
    """Return "b may follow a, directly or with tasks in between"; the same table if transitive."""
    table = problem.opportunities
    turning = _turns_slower_than_it_tracks(
        satellite.start_s,
        satellite.end_s,
        np.ascontiguousarray(table.los_start[satellite.rows]),
        np.ascontiguousarray(table.los_end[satellite.rows]),
        satellite.agility.slew_rate_deg_s,
        satellite.agility.acceleration_deg_s2 or INSTANT,
        satellite.agility.settle_s,
    )
    order = order_of(satellite.transitions)
    if not turning.any() or not _is_shortcut_missing(order, turning):
        return satellite.transitions
    return replace(satellite.transitions, bits=_closure_bits(order))


def is_transitive(problem: Problem) -> bool:
    """Return whether no satellite gains by way of tasks what it cannot reach directly."""
    return all(transitive_closure(problem, s) is s.transitions for s in problem.satellites)


def num_near_pairs(problem: Problem) -> int:
    """Return how many pairs of tasks are near enough in time to exclude each other."""
    pairs = 0
    for satellite in problem.satellites:
        after = np.arange(1, len(satellite) + 1)
        pairs += int((satellite.transitions.far_from - after).sum())
    return pairs


@kernel
def _turns_slower_than_it_tracks(
    start_s: np.ndarray,
    end_s: np.ndarray,
    los_start: np.ndarray,
    los_end: np.ndarray,
    rate_deg_s: float,
    acceleration_deg_s2: float,
    settle_s: float,
) -> Bools:
    """Return the tasks that bring a satellite further than a slew of their length would.

    Slew times grow with the angle, and two slews take no less than one through both angles.
    So where no task between is one of these, what may follow by way of others may directly.
    """
    found = np.zeros(len(start_s), dtype=np.bool_)
    for i in range(len(start_s)):
        turned_deg = angle_between_deg(los_start[i], los_end[i])
        needed_s = slew_s(turned_deg, rate_deg_s, acceleration_deg_s2) - settle_s
        # Each of the two steps may have used its own rounding.
        found[i] = needed_s + TIME_TOLERANCE_S > end_s[i] - start_s[i]
    return found


@kernel
def comes_before(order: Order, a: int, b: int) -> bool:
    """Return whether row ``a`` is related to the later row ``b``."""
    if b >= order.far_from[a]:
        return True
    if b < order.near_from[a]:
        return False
    bit = order.offset[a] + b - order.near_from[a]
    return bool((order.bits[bit >> 3] >> (bit & 7)) & 1)


@kernel
def are_comparable(order: Order, a: int, b: int) -> bool:
    """Return whether two different rows are related, whichever comes first."""
    return comes_before(order, a, b) if a < b else comes_before(order, b, a)


@kernel
def _is_shortcut_missing(order: Order, turning: Bools) -> bool:
    """Return whether some c may follow a by way of a turning task, but not directly."""
    for a in range(len(turning)):
        for b in range(order.near_from[a], order.far_from[a]):
            if not turning[b] or not comes_before(order, a, b):
                continue
            for c in range(order.near_from[b], order.far_from[a]):
                if comes_before(order, b, c) and not comes_before(order, a, c):
                    return True
    return False


@kernel
def _closure_bits(order: Order) -> Bytes:
    """Work backward: what a task reaches is what its direct followers reach, and they."""
    bits = order.bits.copy()
    closed = Order(order.near_from, order.far_from, order.offset, bits)
    for a in range(len(order.near_from) - 1, -1, -1):
        for b in range(order.near_from[a], order.far_from[a]):
            if not comes_before(order, a, b):
                continue
            for c in range(order.near_from[b], order.far_from[a]):
                if comes_before(closed, b, c):
                    bit = order.offset[a] + c - order.near_from[a]
                    bits[bit >> 3] |= np.uint8(1 << (bit & 7))
    return bits
