"""Which task of one satellite may follow which: C(a, b) of eq. 4, computed from geometry.

Testing a pair costs two loads of a line of sight and one lookup in a small table of slews. So there
is no table of pairs, which would grow with the square of the number of targets in view; code that
tests each pair many times builds one (``planner_core.precedence.relation``).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.domain import Agility
from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.problem.moving import longest_turn_s, rotation_deg, turns_in
from planner_core.problem.slew import (
    INSTANT,
    TIME_TOLERANCE_S,
    angle_between_deg,
    reach_deg,
    slew_s,
)

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Vector = tuple[float, float, float]

CLEARLY: Final = 1e-7
"""A margin in the cosine of an angle: rounding is far smaller."""

_NUM_ROOMS: Final = 4096
"""Entries of a table of slews: 32 kB stay in the first-level cache, and only about one pair in a
thousand lies between two entries and needs the exact slew time."""


class Slews(NamedTuple):
    """How far a satellite turns in a given time.

    Attributes
    ----------
    longest_s
        Time of a turn through 180 degrees, without settling.
    per_s
        Entries of ``least_cosine`` for each second.
    least_cosine
        Cosine of the angle that the satellite turns through in 0, 1 / ``per_s``, ... seconds.
        Several satellites' tables may lie in one array.
    first
        Index at which this satellite's table begins in that array.
    """

    rate_deg_s: float
    acceleration_deg_s2: float
    settle_s: float
    longest_s: float
    per_s: float
    least_cosine: Floats
    first: int


@bundle
class Transitions(NamedTuple):
    """Tasks of one satellite in order of start, and how it turns from one to the next.

    Attributes
    ----------
    start_s, end_s
        Shape ``(m,)``.
    looks, looked
        Lines of sight at start and at end, unit vectors. Shape ``(m, 3)``, C order.
    moves, moved
        Their angular velocities there, in deg/s. Shape ``(m, 3)``, C order; ``(0, 3)`` if the
        satellite is modelled as turning from rest to rest.
    slews
        With such velocities, lower bounds on the true turns: accelerating takes no time.
    acceleration_deg_s2
        The limit for turns between moving lines of sight; ``INSTANT`` if there are no such turns.
    """

    start_s: Floats
    end_s: Floats
    looks: Floats
    looked: Floats
    moves: Floats
    moved: Floats
    slews: Slews
    acceleration_deg_s2: float

    @property
    def is_moving(self) -> bool:
        """Whether turns begin and end with the rates of tracking."""
        return self.acceleration_deg_s2 > INSTANT

    def allows(self, a: int, b: int) -> bool:
        """Return whether local row ``b`` may follow local row ``a`` directly."""
        return bool(may_follow(self, a, b))


@lru_cache(maxsize=64)
def slews_of(agility: Agility) -> Slews:
    """Return a satellite's slews from rest to rest; with ``INSTANT`` if it turns in motion."""
    acceleration = INSTANT if agility.tracks else agility.acceleration_deg_s2 or INSTANT
    longest_s = float(slew_s(180.0, agility.slew_rate_deg_s, acceleration))
    per_s = (_NUM_ROOMS - 2) / max(longest_s, 1e-3)
    return Slews(
        rate_deg_s=float(agility.slew_rate_deg_s),
        acceleration_deg_s2=float(acceleration),
        settle_s=float(agility.settle_s),
        longest_s=longest_s,
        per_s=per_s,
        least_cosine=_least_cosines(agility.slew_rate_deg_s, acceleration, per_s),
        first=0,
    )


@kernel
def _least_cosines(rate_deg_s: float, acceleration_deg_s2: float, per_s: float) -> Floats:
    cosines = np.empty(_NUM_ROOMS)
    for k in range(_NUM_ROOMS):
        angle_deg = reach_deg(k / per_s, rate_deg_s, acceleration_deg_s2)
        cosines[k] = math.cos(math.radians(angle_deg))
    return cosines


@borrowing_inner
def turns_within(slews: Slews, room_s: float, looked: Vector, looks: Vector) -> bool:
    """Return whether the satellite can turn from one line of sight to another in ``room_s``.

    ``room_s`` excludes settling and includes ``TIME_TOLERANCE_S``.
    """
    if room_s < 0.0:
        return False
    if room_s >= slews.longest_s + TIME_TOLERANCE_S:
        return True
    at = slews.first + int(room_s * slews.per_s)
    # Most pairs are far from the limit, and cosines are cheaper than angles.
    cosine = looked[0] * looks[0] + looked[1] * looks[1] + looked[2] * looks[2]
    if cosine >= slews.least_cosine[at] + CLEARLY:
        return True
    if cosine < slews.least_cosine[at + 1] - CLEARLY:
        return False
    angle_deg = angle_between_deg(looked, looks)
    return slew_s(angle_deg, slews.rate_deg_s, slews.acceleration_deg_s2) <= room_s


@borrowing
def may_follow(transitions: Transitions, a: int, b: int) -> bool:
    """Return whether local row ``b`` may follow ``a``; ``a = -1`` means "no task yet"."""
    if a < 0:
        return True
    # Times alone would let a task of zero length follow itself.
    if b <= a:
        return False
    slews, looks, looked = transitions.slews, transitions.looks, transitions.looked
    room_s = transitions.start_s[b] - transitions.end_s[a] - slews.settle_s + TIME_TOLERANCE_S
    before = looked[a, 0], looked[a, 1], looked[a, 2]
    after = looks[b, 0], looks[b, 1], looks[b, 2]
    if not turns_within(slews, room_s, before, after):
        return False
    if len(transitions.moves) == 0:
        return True
    acceleration = transitions.acceleration_deg_s2
    if room_s >= longest_turn_s(slews.rate_deg_s, acceleration):
        return True
    moves, moved = transitions.moves, transitions.moved
    return turns_in(
        room_s,
        rotation_deg(before, after),
        (moved[a, 0], moved[a, 1], moved[a, 2]),
        (moves[b, 0], moves[b, 1], moves[b, 2]),
        slews.rate_deg_s,
        acceleration,
    )


@kernel
def may_follow_each(transitions: Transitions, a: Longs, b: Longs) -> Bools:
    """Return for each pair of local rows whether the second may follow the first; ``(k,)``."""
    found = np.zeros(len(a), dtype=np.bool_)
    for i in range(len(a)):
        found[i] = may_follow(transitions, a[i], b[i])
    return found


def near_spans(transitions: Transitions) -> tuple[Ints, Ints]:
    """Return for each task the first row after its end, and the first from which all may follow.

    Shape ``(m,)`` each. Which of the rows in between may follow depends on the lines of sight.
    """
    start_s, end_s, slews = transitions.start_s, transitions.end_s, transitions.slews
    near_from = np.searchsorted(start_s, end_s - TIME_TOLERANCE_S)
    near_from = np.maximum(near_from, np.arange(1, len(start_s) + 1))
    longest_s = slews.longest_s
    if transitions.is_moving:
        longest_s = longest_turn_s(slews.rate_deg_s, transitions.acceleration_deg_s2)
    far_from = np.searchsorted(start_s, end_s + (longest_s + slews.settle_s))
    return near_from.astype(np.int32), np.maximum(far_from, near_from).astype(np.int32)
