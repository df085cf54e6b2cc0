"""Lines of sight at the start and end of actions, and how long the turns between them take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.jit import kernel
from planner_core.problem import Bools, Floats, Problem, line_of_sight
from planner_core.problem.moving import moving_turn_s, rotation_deg, turns_in
from planner_core.problem.plan import Action, Columns
from planner_core.problem.slew import (
    INSTANT,
    TIME_TOLERANCE_S,
    Vector,
    angle_between_deg,
    slew_s,
)
from planner_core.problem.sun_turns import angle_to_sun_deg, sun_turn_s

_Triple = tuple[float, float, float]


class _Turns(NamedTuple):
    """A satellite's turns and its agility; turns without rates go from rest to rest."""

    lines_from: Floats
    lines_to: Floats
    rates_from: Floats
    rates_to: Floats
    available_s: Floats
    settle_s: float
    rate_deg_s: float
    acceleration_deg_s2: float


def lines_of_sight(problem: Problem, actions: Columns, *, is_end: bool) -> tuple[Floats, Floats]:
    """Return lines of sight at starts or ends of actions, and their rates; ``(n, 3)`` each."""
    table = problem.opportunities
    rows = actions.row
    if is_end:
        at_s, known_s = actions.end_s, table.end_s[rows]
        lines, rates = table.los_end[rows], table.los_rate_end[rows]
    else:
        at_s, known_s = actions.start_s, table.start_s[rows]
        lines, rates = table.los_start[rows], table.los_rate_start[rows]
    lines = lines.astype(np.float64)
    for own in np.flatnonzero(np.abs(at_s - known_s) > TIME_TOLERANCE_S).tolist():
        lines[own] = line_of_sight(problem, int(rows[own]), float(at_s[own]))
    return lines, rates.astype(np.float64)


def are_in_time(problem: Problem, index: int, before: Columns, after: Columns) -> Bools:
    """Return which turns of a satellite surely fit between their two actions.

    The shortest time of a turn takes a bisection to find; whether it fits is a single step of it.
    """
    return _fit(*_turns_asked(problem, index, before, after))


def _turns_asked(problem: Problem, index: int, before: Columns, after: Columns) -> _Turns:
    lines_from, moved = lines_of_sight(problem, before, is_end=True)
    lines_to, moves = lines_of_sight(problem, after, is_end=False)
    agility = problem.satellites[index].agility
    if not agility.tracks:
        moved = moves = moves[:0]
    return _Turns(
        lines_from,
        lines_to,
        moved,
        moves,
        after.start_s - before.end_s,
        float(agility.settle_s),
        float(agility.slew_rate_deg_s),
        float(agility.acceleration_deg_s2 or INSTANT),
    )


@kernel
def _fit(
    lines_from: Floats,
    lines_to: Floats,
    rates_from: Floats,
    rates_to: Floats,
    available_s: Floats,
    settle_s: float,
    rate_deg_s: float,
    acceleration_deg_s2: float,
) -> Bools:
    """Return which turns fit."""
    fits = np.empty(len(available_s), dtype=np.bool_)
    for i in range(len(available_s)):
        u = lines_from[i, 0], lines_from[i, 1], lines_from[i, 2]
        v = lines_to[i, 0], lines_to[i, 1], lines_to[i, 2]
        if len(rates_from) == 0:
            turn_s = slew_s(angle_between_deg(u, v), rate_deg_s, acceleration_deg_s2)
            fits[i] = turn_s + settle_s <= available_s[i]
            continue
        rate_from = rates_from[i, 0], rates_from[i, 1], rates_from[i, 2]
        rate_to = rates_to[i, 0], rates_to[i, 1], rates_to[i, 2]
        turn, room_s = rotation_deg(u, v), available_s[i] - settle_s + TIME_TOLERANCE_S
        fits[i] = turns_in(room_s, turn, rate_from, rate_to, rate_deg_s, acceleration_deg_s2)
    return fits


def turns_between(
    problem: Problem, index: int, before: Columns, after: Columns
) -> list[tuple[float, float]]:
    """Return angle (deg) and time (s, settling included) of a satellite's turns.

    Each goes from the end of an action to the start of another.
    """
    angles_deg, needed_s = _angles_and_times(*_turns_asked(problem, index, before, after))
    return list(zip(angles_deg.tolist(), needed_s.tolist(), strict=True))


@kernel
def _angles_and_times(
    lines_from: Floats,
    lines_to: Floats,
    rates_from: Floats,
    rates_to: Floats,
    available_s: Floats,
    settle_s: float,
    rate_deg_s: float,
    acceleration_deg_s2: float,
) -> tuple[Floats, Floats]:
    """Return angles and times of turns."""
    angles_deg, needed_s = np.empty(len(lines_from)), np.empty(len(lines_from))
    for i in range(len(lines_from)):
        u = lines_from[i, 0], lines_from[i, 1], lines_from[i, 2]
        v = lines_to[i, 0], lines_to[i, 1], lines_to[i, 2]
        angles_deg[i] = angle_between_deg(u, v)
        if len(rates_from) == 0:
            turn_s = slew_s(angles_deg[i], rate_deg_s, acceleration_deg_s2)
            needed_s[i] = turn_s + settle_s
            continue
        turn = rotation_deg(u, v)
        rate_from = rates_from[i, 0], rates_from[i, 1], rates_from[i, 2]
        rate_to = rates_to[i, 0], rates_to[i, 1], rates_to[i, 2]
        turn_s = moving_turn_s(turn, rate_from, rate_to, rate_deg_s, acceleration_deg_s2)
        needed_s[i] = turn_s + settle_s
        room_s = available_s[i] - settle_s + TIME_TOLERANCE_S
        if needed_s[i] > available_s[i] and turns_in(
            room_s, turn, rate_from, rate_to, rate_deg_s, acceleration_deg_s2
        ):
            # The shortest time is only accurate to about a microsecond: a turn that fits counts.
            needed_s[i] = available_s[i]
    return angles_deg, needed_s


def turn_from_start(problem: Problem, index: int, action: Action) -> tuple[float, float] | None:
    """Return angle (deg) and time (s) of the turn from the line of sight at the start.

    None if that is unknown. If the panels begin at the sun, the angle is the one they turn by.
    """
    satellite = problem.satellites[index]
    heading, agility = satellite.heading, satellite.agility
    if heading is None:
        return None
    lines, rates = lines_of_sight(problem, Columns.of([action]), is_end=False)
    v, moving = lines[0], _triple(rates[0])
    if heading.line_of_sight is None:
        x, y, z = moving
        # The turn to the sun, backward in time.
        needed_s = sun_turn_s(
            satellite.resources, agility, satellite.sun, v, action.start_s, (-x, -y, -z)
        )
        return angle_to_sun_deg(satellite.resources, satellite.sun, v, action.start_s), needed_s
    angle_deg = angle_between_deg(heading.line_of_sight, v)
    if not agility.tracks:
        acceleration = agility.acceleration_deg_s2 or INSTANT
        turn_s = slew_s(angle_deg, agility.slew_rate_deg_s, acceleration)
        return angle_deg, turn_s + agility.settle_s
    turn = rotation_deg(heading.line_of_sight, _triple(v))
    limits = float(agility.slew_rate_deg_s), float(agility.acceleration_deg_s2 or INSTANT)
    turn_s = moving_turn_s(turn, heading.moving_deg_s, moving, *limits)
    available_s = action.start_s - heading.free_from_s - agility.settle_s
    if turn_s > available_s and turns_in(
        available_s + TIME_TOLERANCE_S, turn, heading.moving_deg_s, moving, *limits
    ):
        turn_s = available_s
    return angle_deg, turn_s + agility.settle_s


def _triple(vector: Vector) -> _Triple:
    return float(vector[0]), float(vector[1]), float(vector[2])
