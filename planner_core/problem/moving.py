"""The time to turn between two moving lines of sight, within rate and acceleration limits.

A satellite that images tracks its target, so it ends one task and begins the next while rotating.
The turn is a burst from the first rate to a cruise rate, a coast, and a burst to the last rate.
Both bursts use the full acceleration. Rotations are added as vectors, which overestimates the
time, by a few per cent for large angles.
"""

from __future__ import annotations

import math
from typing import Final

from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.problem.slew import angle_between_deg

Vector = tuple[float, float, float]

_MOST_STEPS: Final = 60
_SETTLED: Final = 1e-9  # deg/s
_SLOWER: Final = 1e-4  # of the rate limit
_ACCURACY_S: Final = 1e-6
_MOST_RATES: Final = 5.0  # rate / acceleration: to brake, turn from rest to rest and speed up


@kernel
def longest_turn_s(rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """Return a time that suffices for every turn, whatever the rates at its ends."""
    return 180.0 / rate_deg_s + _MOST_RATES * rate_deg_s / acceleration_deg_s2


@borrowing
def rotation_deg(u: Vector, v: Vector) -> Vector:
    """Return the smallest rotation from one unit vector to another, as a vector along its axis."""
    x = u[1] * v[2] - u[2] * v[1]
    y = u[2] * v[0] - u[0] * v[2]
    z = u[0] * v[1] - u[1] * v[0]
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-15:
        return 0.0, 0.0, 0.0
    share = angle_between_deg(u, v) / length
    return share * x, share * y, share * z


@borrowing
def turns_in(
    room_s: float, turn: Vector, rate_from: Vector, rate_to: Vector,
    rate_deg_s: float, acceleration_deg_s2: float,
) -> bool:  # fmt: skip
    """Return whether a satellite can turn in ``room_s``, with these rates at both ends.

    Parameters
    ----------
    turn
        Rotation from the first line of sight to the second, in degrees.
    rate_from, rate_to
        Angular velocities at both ends, in deg/s.

    Notes
    -----
    The cruise rate that covers the rotation is a fixed point. Near the least time the iteration
    may not converge; the answer is then no.
    """
    if room_s <= 0.0:
        return False
    c = turn[0] / room_s, turn[1] / room_s, turn[2] / room_s
    before, step_before = c, (0.0, 0.0, 0.0)
    for k in range(_MOST_STEPS):
        first_s = _distance(c, rate_from) / acceleration_deg_s2
        last_s = _distance(c, rate_to) / acceleration_deg_s2
        cruise_s = room_s - 0.5 * (first_s + last_s)
        if cruise_s <= 0.0:
            return False
        # The rate that the cruise needs, measured from mid-burst to mid-burst, minus ``c``.
        step = (
            (turn[0] - 0.5 * (first_s * rate_from[0] + last_s * rate_to[0])) / cruise_s - c[0],
            (turn[1] - 0.5 * (first_s * rate_from[1] + last_s * rate_to[1])) / cruise_s - c[1],
            (turn[2] - 0.5 * (first_s * rate_from[2] + last_s * rate_to[2])) / cruise_s - c[2],
        )
        if _distance(step, (0.0, 0.0, 0.0)) < _SETTLED:
            is_slow = _distance(c, (0.0, 0.0, 0.0)) <= rate_deg_s + _SETTLED
            return is_slow and first_s + last_s <= room_s + _SETTLED
        share = _secant(step, step_before) if k > 0 else 0.0
        after = (
            c[0] + step[0] - share * (c[0] + step[0] - before[0] - step_before[0]),
            c[1] + step[1] - share * (c[1] + step[1] - before[1] - step_before[1]),
            c[2] + step[2] - share * (c[2] + step[2] - before[2] - step_before[2]),
        )
        before, step_before, c = c, step, after
    return False


@borrowing_inner
def _secant(step: Vector, before: Vector) -> float:
    """Return which share of the last change to undo so that the next step is smallest.

    This is Anderson acceleration with one step of memory. Near the least time of a turn two
    cruise rates coincide, and plain fixed-point steps would hardly converge.
    """
    x, y, z = step[0] - before[0], step[1] - before[1], step[2] - before[2]
    size = x * x + y * y + z * z
    if size <= 0.0:
        return 0.0
    return (x * step[0] + y * step[1] + z * step[2]) / size


@kernel
def moving_turn_s(
    turn: Vector, rate_from: Vector, rate_to: Vector,
    rate_deg_s: float, acceleration_deg_s2: float,
) -> float:  # fmt: skip
    """Return the least time of a turn, to about a microsecond; see ``turns_in``.

    >>> round(moving_turn_s((30.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 0.5), 3)
    32.0
    >>> round(moving_turn_s((30.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0, 0.5), 3)
    30.0
    """
    low_s, high_s = 0.0, longest_turn_s(rate_deg_s, acceleration_deg_s2)
    cruising_s = _cruising_turn_s(turn, rate_from, rate_to, rate_deg_s, acceleration_deg_s2)
    # If the bursts are long, a turn with a slower cruise may take less time.
    slower = (1.0 - _SLOWER) * rate_deg_s
    slower_s = _cruising_turn_s(turn, rate_from, rate_to, slower, acceleration_deg_s2)
    enough_s = cruising_s + 0.5 * _ACCURACY_S
    if 0.0 < cruising_s < slower_s and turns_in(
        enough_s, turn, rate_from, rate_to, rate_deg_s, acceleration_deg_s2
    ):
        return enough_s
    while high_s - low_s > _ACCURACY_S:
        middle_s = 0.5 * (low_s + high_s)
        if turns_in(middle_s, turn, rate_from, rate_to, rate_deg_s, acceleration_deg_s2):
            high_s = middle_s
        else:
            low_s = middle_s
    return high_s


@borrowing_inner
def _cruising_turn_s(
    turn: Vector, rate_from: Vector, rate_to: Vector,
    rate_deg_s: float, acceleration_deg_s2: float,
) -> float:  # fmt: skip
    """Return the time of a turn that cruises at ``rate_deg_s``; negative if none is found.

    All but short turns cruise at the rate limit. Then only the cruise's direction is unknown, which
    is close to the turn's: a few steps find it, whereas bisection would take a hundred.
    """
    length = _distance(turn, (0.0, 0.0, 0.0))
    left = turn
    for _ in range(_MOST_STEPS):
        if length <= 0.0:
            break
        share = rate_deg_s / length
        c = share * left[0], share * left[1], share * left[2]
        first_s = _distance(c, rate_from) / acceleration_deg_s2
        last_s = _distance(c, rate_to) / acceleration_deg_s2
        # The cruise's rotation, measured from mid-burst to mid-burst.
        left = (
            turn[0] - 0.5 * (first_s * rate_from[0] + last_s * rate_to[0]),
            turn[1] - 0.5 * (first_s * rate_from[1] + last_s * rate_to[1]),
            turn[2] - 0.5 * (first_s * rate_from[2] + last_s * rate_to[2]),
        )
        length = _distance(left, (0.0, 0.0, 0.0))
        at_rate = left[0] * rate_deg_s, left[1] * rate_deg_s, left[2] * rate_deg_s
        if _distance(at_rate, (length * c[0], length * c[1], length * c[2])) < _SETTLED * length:
            return length / rate_deg_s + 0.5 * (first_s + last_s)
    return -1.0


@borrowing_inner
def _distance(u: Vector, v: Vector) -> float:
    x, y, z = u[0] - v[0], u[1] - v[1], u[2] - v[2]
    return math.sqrt(x * x + y * y + z * z)
