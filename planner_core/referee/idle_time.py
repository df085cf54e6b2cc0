"""What a satellite does between its tasks: it turns to the sun and back, or it waits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from planner_core.problem import Problem, SatelliteProblem
from planner_core.problem.plan import Action
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.sun_turns import sun_turn_s
from planner_core.referee.sight import looked, looks, moving_deg_s


class Idle(NamedTuple):
    """A span without tasks, and the part of it that is spent at the sun.

    Attributes
    ----------
    start_s, end_s
        From the end of a task, or the start of the horizon, to the next start or its end.
    sun_from_s, sun_until_s
        The stay at the sun, between the two turns; of no length where there is no time for it.
    turn_to_s, turn_back_s
        To the sun, at the start of the horizon what is left of it; and from it, none at its end.
    """

    start_s: float
    end_s: float
    sun_from_s: float
    sun_until_s: float
    turn_to_s: float
    turn_back_s: float

    @property
    def is_at_sun(self) -> bool:
        """Whether there is time to go to the sun and back."""
        return self.sun_until_s > self.sun_from_s + TIME_TOLERANCE_S


def idle_spans(
    problem: Problem, satellite: SatelliteProblem, actions: Sequence[Action]
) -> tuple[Idle, ...]:
    """Return the idle spans of a satellite around its own actions, in order of start.

    The satellite begins the horizon with its panels at the sun where it is not known to look
    elsewhere.
    """

    def turn_s(action: Action | None, is_end: bool) -> float:
        if action is None or satellite.resources.sun_pointing == "free":
            return 0.0
        t_s = action.end_s if is_end else action.start_s
        line_of_sight = looked(problem, action) if is_end else looks(problem, action)
        r, agility = satellite.resources, satellite.agility
        x, y, z = moving_deg_s(problem, action, is_end=is_end)
        # The turn back is the turn to the sun, backward in time.
        rate = (x, y, z) if is_end else (-x, -y, -z)
        return sun_turn_s(r, agility, satellite.sun, line_of_sight, t_s, rate)

    spans = []
    before: Action | None = None
    free_from_s = 0.0
    for after in (*actions, None):
        until_s = problem.horizon_s if after is None else after.start_s
        if until_s > free_from_s + TIME_TOLERANCE_S:
            turn_to_s, turn_back_s = turn_s(before, True), turn_s(after, False)
            if before is None:
                turn_to_s = _first_turn_s(satellite)
            sun_from_s = free_from_s + turn_to_s
            sun_until_s = max(sun_from_s, until_s - turn_back_s)
            spans.append(
                Idle(free_from_s, until_s, sun_from_s, sun_until_s, turn_to_s, turn_back_s)
            )
        if after is not None and after.end_s > free_from_s:
            free_from_s, before = after.end_s, after
    return tuple(spans)


def _first_turn_s(satellite: SatelliteProblem) -> float:
    """Return how long after the horizon's start a satellite is at the sun, by its heading."""
    heading = satellite.heading
    if heading is None or heading.line_of_sight is None:
        return 0.0
    at_sun_s = heading.free_from_s + sun_turn_s(
        satellite.resources, satellite.agility, satellite.sun, heading.line_of_sight,
        heading.free_from_s, heading.moving_deg_s,
    )  # fmt: skip
    return max(0.0, at_sun_s)
