"""Where a satellite looks when it begins an action and when it ends it, and how long it turns."""

from __future__ import annotations

import numpy as np

from planner_core.problem import Problem, line_of_sight
from planner_core.problem.moving import moving_turn_s, rotation_deg, turns_in
from planner_core.problem.plan import Action
from planner_core.problem.slew import (
    INSTANT,
    TIME_TOLERANCE_S,
    Vector,
    angle_between_deg,
    slew_s,
)
from planner_core.problem.sun_turns import angle_to_sun_deg, sun_turn_s

_Triple = tuple[float, float, float]


def looks(problem: Problem, action: Action) -> Vector:
    """Return the line of sight at an action's start."""
    table, i = problem.opportunities, action.opportunity
    if abs(action.start_s - table.start_s[i]) <= TIME_TOLERANCE_S:
        return np.asarray(table.los_start[i])
    return line_of_sight(problem, i, action.start_s)


def looked(problem: Problem, action: Action) -> Vector:
    """Return the line of sight at an action's end."""
    table, i = problem.opportunities, action.opportunity
    if abs(action.end_s - table.end_s[i]) <= TIME_TOLERANCE_S:
        return np.asarray(table.los_end[i])
    return line_of_sight(problem, i, action.end_s)


def moving_deg_s(problem: Problem, action: Action, *, is_end: bool) -> _Triple:
    """Return how the line of sight moves at an action's start or end, for turns in motion."""
    table = problem.opportunities
    rates = table.los_rate_end if is_end else table.los_rate_start
    return _triple(rates[action.opportunity])


def turn_between(
    problem: Problem, index: int, before: Action, after: Action
) -> tuple[float, float]:
    """Return angle (deg) and time (s, settling included) of a satellite's turn between tasks."""
    agility = problem.satellites[index].agility
    u, v = looked(problem, before), looks(problem, after)
    angle_deg = angle_between_deg(u, v)
    if not agility.tracks:
        acceleration = agility.acceleration_deg_s2 or INSTANT
        return angle_deg, slew_s(
            angle_deg, agility.slew_rate_deg_s, acceleration
        ) + agility.settle_s
    turn = rotation_deg(_triple(u), _triple(v))
    rates = (
        moving_deg_s(problem, before, is_end=True),
        moving_deg_s(problem, after, is_end=False),
    )
    limits = float(agility.slew_rate_deg_s), float(agility.acceleration_deg_s2 or INSTANT)
    needed_s = moving_turn_s(turn, *rates, *limits) + agility.settle_s
    available_s = after.start_s - before.end_s
    if needed_s > available_s and turns_in(
        available_s - agility.settle_s + TIME_TOLERANCE_S, turn, *rates, *limits
    ):
        # The least time is known to a microsecond or so; what fits, fits.
        needed_s = available_s
    return angle_deg, needed_s


def turn_from_start(problem: Problem, index: int, action: Action) -> tuple[float, float] | None:
    """Return angle (deg) and time (s) of the turn from where a satellite looked at the start.

    None where that is not known. For panels at the sun the angle is the one that they turn by.
    """
    satellite = problem.satellites[index]
    heading, agility = satellite.heading, satellite.agility
    if heading is None:
        return None
    v, moving = looks(problem, action), moving_deg_s(problem, action, is_end=False)
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
