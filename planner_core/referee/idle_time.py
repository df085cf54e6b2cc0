"""What a satellite does between its tasks: it turns to the sun and back, or it waits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner_core.problem import Problem, SatelliteProblem
from planner_core.problem.plan import Action
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.sun_turns import sun_turn_s, sun_turns
from planner_core.referee.sight import lines_of_sight


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
    out_s, back_s = _turns_s(problem, satellite, actions)
    spans = []
    free_from_s, turn_to_s = 0.0, _first_turn_s(satellite)
    for after, turn, turn_back_s in zip(
        (*actions, None), (*out_s, 0.0), (*back_s, 0.0), strict=True
    ):
        until_s = problem.horizon_s if after is None else after.start_s
        if until_s > free_from_s + TIME_TOLERANCE_S:
            sun_from_s = free_from_s + turn_to_s
            sun_until_s = max(sun_from_s, until_s - turn_back_s)
            spans.append(
                Idle(free_from_s, until_s, sun_from_s, sun_until_s, turn_to_s, turn_back_s)
            )
        if after is not None and after.end_s > free_from_s:
            free_from_s, turn_to_s = after.end_s, turn
    return tuple(spans)


def _turns_s(
    problem: Problem, satellite: SatelliteProblem, actions: Sequence[Action]
) -> tuple[list[float], list[float]]:
    """Return the turn from each action to the sun, and the one from there to it."""
    r = satellite.resources
    if r.sun_pointing == "free" or not actions:
        nothing = [0.0] * len(actions)
        return nothing, nothing
    at_start, moves = lines_of_sight(problem, actions, is_end=False)
    at_end, moved = lines_of_sight(problem, actions, is_end=True)
    turns = sun_turns(
        r,
        satellite.agility,
        satellite.sun,
        start_s=np.array([action.start_s for action in actions]),
        end_s=np.array([action.end_s for action in actions]),
        looks=at_start,
        looked=at_end,
        moves=moves,
        moved=moved,
    )
    return turns.out_s.tolist(), turns.back_s.tolist()


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
