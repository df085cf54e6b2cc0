"""Idle time: between its tasks a satellite turns to the sun and back, or it waits."""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from planner_core.problem import Bools, Floats, Problem, SatelliteProblem
from planner_core.problem.plan import Columns
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.problem.sun_turns import SunTurns, sun_turn_s, sun_turns
from planner_core.referee.sight import lines_of_sight

_known: WeakKeyDictionary[Problem, Floats] = WeakKeyDictionary()
"""Turns from each opportunity to the sun, and back; NaN if not computed yet."""


class Idle(NamedTuple):
    """Spans without tasks, in order of start, and the part of each that is spent at the sun.

    Shape ``(n,)`` each.

    Attributes
    ----------
    start_s, end_s
        From the end of a task (or the start of the horizon) to the next start (or its end).
    sun_from_s, sun_until_s
        The stay at the sun, between the two turns; of zero length if there is no time for it.
    turn_to_s, turn_back_s
        Turn to the sun (in the first span, what is left of it) and back (none in the last).
    """

    start_s: Floats
    end_s: Floats
    sun_from_s: Floats
    sun_until_s: Floats
    turn_to_s: Floats
    turn_back_s: Floats

    @property
    def is_at_sun(self) -> Bools:
        """Whether there is time to go to the sun and back."""
        return np.asarray(self.sun_until_s > self.sun_from_s + TIME_TOLERANCE_S)


def idle_spans(problem: Problem, satellite: SatelliteProblem, actions: Columns) -> Idle:
    """Return the idle spans of a satellite between its own actions, in order of start.

    The satellite begins the horizon with its panels at the sun, unless its heading says otherwise.
    """
    out_s, back_s = _turns_s(problem, satellite, actions)
    until_s, turn_back_s = np.append(actions.start_s, problem.horizon_s), np.append(back_s, 0.0)
    # Among the start of the horizon and the tasks so far: the first of those that end last.
    end_s = np.append(0.0, actions.end_s)
    free_from_s = np.maximum.accumulate(end_s)
    is_later = np.append(True, free_from_s[1:] > free_from_s[:-1])
    last = np.maximum.accumulate(np.where(is_later, np.arange(len(end_s)), 0))
    turn_to_s = np.append(_first_turn_s(satellite), out_s)[last]
    sun_from_s = free_from_s + turn_to_s
    sun_until_s = np.maximum(sun_from_s, until_s - turn_back_s)
    spans = free_from_s, until_s, sun_from_s, sun_until_s, turn_to_s, turn_back_s
    has_time = until_s > free_from_s + TIME_TOLERANCE_S
    return Idle(*(column[has_time] for column in spans))


def _turns_s(
    problem: Problem, satellite: SatelliteProblem, actions: Columns
) -> tuple[Floats, Floats]:
    """Return the turns from each action to the sun, and from the sun to each action.

    Most actions are the same in successive plans of a search, so the turns of those at the times
    of their opportunity are remembered.
    """
    if satellite.resources.sun_pointing == "free":
        nothing = np.zeros(len(actions.row))
        return nothing, nothing
    table, row = problem.opportunities, actions.row
    if problem not in _known:
        _known[problem] = np.full((2, len(table)), np.nan)
    known = _known[problem]
    is_own = (actions.start_s == table.start_s[row]) & (actions.end_s == table.end_s[row])
    turns_s: Floats = np.where(is_own, known[:, row], np.nan)
    new = np.flatnonzero(np.isnan(turns_s[0]))
    if len(new):
        turns_s[:, new] = _new_turns_s(problem, satellite, actions.at(new))
        known[:, row[is_own]] = turns_s[:, is_own]
    return turns_s[0], turns_s[1]


def _new_turns_s(problem: Problem, satellite: SatelliteProblem, actions: Columns) -> SunTurns:
    at_start, moves = lines_of_sight(problem, actions, is_end=False)
    at_end, moved = lines_of_sight(problem, actions, is_end=True)
    return sun_turns(
        satellite.resources,
        satellite.agility,
        satellite.sun,
        start_s=actions.start_s,
        end_s=actions.end_s,
        looks=at_start,
        looked=at_end,
        moves=moves,
        moved=moved,
    )


def _first_turn_s(satellite: SatelliteProblem) -> float:
    """Return how long after the horizon's start a satellite is at the sun, given its heading."""
    heading = satellite.heading
    if heading is None or heading.line_of_sight is None:
        return 0.0
    at_sun_s = heading.free_from_s + sun_turn_s(
        satellite.resources, satellite.agility, satellite.sun, heading.line_of_sight,
        heading.free_from_s, heading.moving_deg_s,
    )  # fmt: skip
    return max(0.0, at_sun_s)
