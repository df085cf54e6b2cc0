"""The turn from where a satellite looks at the start of the horizon to its tasks.

Every task must leave time for it, not only the first: a task that follows others begins later
anyway. Only a satellite that tracks faster than it slews could reach a task sooner by way of
others; such plans are left out, and the referee does not accept them.
"""

from __future__ import annotations

import math
from bisect import bisect_left

import numpy as np

from planner_core.problem.columns import Bools, Ints
from planner_core.problem.moving import longest_turn_s
from planner_core.problem.problem import Heading, Problem, SatelliteProblem, line_of_sight
from planner_core.problem.slew import INSTANT, TIME_TOLERANCE_S, angle_between_deg, slew_s
from planner_core.problem.sun_turns import sun_turn_s
from planner_core.problem.transitions import Transitions


def too_soon(problem: Problem) -> Bools:
    """Return which opportunities their satellite cannot turn to in time. Shape ``(n,)``."""
    found = np.zeros(len(problem.opportunities), dtype=np.bool_)
    for satellite in problem.satellites:
        if satellite.heading is not None:
            found[satellite.rows] = _too_soon(satellite, satellite.heading)
    return found


def _too_soon(satellite: SatelliteProblem, heading: Heading) -> Bools:
    if heading.line_of_sight is None:
        room_s = satellite.start_s - heading.free_from_s + TIME_TOLERANCE_S
        return np.asarray(satellite.turns.back_s > room_s)
    found = np.zeros(len(satellite), dtype=np.bool_)
    near = _near(satellite, heading)
    turn = _from_heading(satellite.transitions, heading, near)
    found[near] = [not turn.allows(0, 1 + i) for i in range(len(near))]
    return found


def _near(satellite: SatelliteProblem, heading: Heading) -> Ints:
    """Return the local rows that start before even the longest first turn would end."""
    tasks = satellite.transitions
    longest_s = tasks.slews.longest_s
    if tasks.is_moving:
        longest_s = longest_turn_s(tasks.slews.rate_deg_s, tasks.acceleration_deg_s2)
    until_s = heading.free_from_s + longest_s + tasks.slews.settle_s
    return np.flatnonzero(satellite.start_s < until_s + TIME_TOLERANCE_S).astype(np.int32)


def _from_heading(tasks: Transitions, heading: Heading, rows: Ints) -> Transitions:
    """Return some tasks, preceded by one of zero length that looks along the heading."""
    at_s, look = np.array([heading.free_from_s]), np.array([heading.line_of_sight])
    moving = np.array([heading.moving_deg_s]) if tasks.is_moving else np.empty((0, 3))
    own = rows if tasks.is_moving else rows[:0]
    return tasks._replace(
        start_s=np.concatenate([at_s, tasks.start_s[rows]]),
        end_s=np.concatenate([at_s, tasks.end_s[rows]]),
        looks=np.ascontiguousarray(np.concatenate([look, tasks.looks[rows]])),
        looked=np.ascontiguousarray(np.concatenate([look, tasks.looked[rows]])),
        moves=np.ascontiguousarray(np.concatenate([moving, tasks.moves[own]])),
        moved=np.ascontiguousarray(np.concatenate([moving, tasks.moved[own]])),
    )


def first_start_s(problem: Problem, row: int, open_s: float, close_s: float) -> float:
    """Return the first whole millisecond at which a task can start after the first turn.

    It lies between ``open_s`` and ``close_s``; infinite if there is none. While lines of sight turn
    more slowly than the satellite, every start after a feasible one is feasible too.
    """
    satellite = problem.satellites[int(problem.opportunities.satellite[row])]

    def is_late_enough(start_ms: int) -> bool:
        start_s = start_ms / 1000.0
        return start_s >= _turned_s(problem, satellite, row, start_s) - TIME_TOLERANCE_S

    first_ms, last_ms = math.ceil(open_s * 1000.0 - 1e-4), math.floor(close_s * 1000.0 + 1e-4)
    if first_ms > last_ms or not is_late_enough(last_ms):
        return math.inf
    found = bisect_left(range(first_ms, last_ms), True, key=is_late_enough)
    return (first_ms + found) / 1000.0


def _turned_s(problem: Problem, satellite: SatelliteProblem, row: int, start_s: float) -> float:
    """Return when a satellite can have turned to a task's line of sight at ``start_s``."""
    heading, agility = satellite.heading, satellite.agility
    if heading is None:
        return -math.inf
    look = line_of_sight(problem, row, start_s)
    if heading.line_of_sight is None:
        turn_s = sun_turn_s(satellite.resources, agility, satellite.sun, look, start_s)
        return heading.free_from_s + turn_s
    angle_deg = angle_between_deg(heading.line_of_sight, look)
    acceleration = agility.acceleration_deg_s2 or INSTANT
    turn_s = slew_s(angle_deg, agility.slew_rate_deg_s, acceleration)
    return heading.free_from_s + turn_s + agility.settle_s
