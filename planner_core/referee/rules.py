"""The rules that a plan must keep, besides pins and limits: windows, turns and stations."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np

from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.plan import Action, Columns, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.sight import are_in_time, turn_from_start, turns_between
from planner_core.referee.timeline import Slew, Violation, ViolationCode


def windows(problem: Problem, plan: Plan) -> list[Violation]:
    """Check that each action lies in its access and the horizon, and lasts as its opportunity."""
    table = problem.opportunities
    found = []
    for position in _outside(problem, plan):
        action = plan.actions[position]
        i = action.opportunity
        first_s = max(0.0, float(table.access_start_s[i]))
        last_s = min(problem.horizon_s, float(table.access_end_s[i]))
        early_s, late_s = first_s - action.start_s, action.end_s - last_s
        length_s = float(table.end_s[i] - table.start_s[i])
        if early_s > TIME_TOLERANCE_S:
            at_s, needed, available = action.start_s, first_s, action.start_s
            detail = f"It starts {early_s:.3f} s before its access."
        elif late_s > TIME_TOLERANCE_S:
            at_s, needed, available = action.end_s, last_s, action.end_s
            detail = f"It ends {late_s:.3f} s after its access."
        elif abs(action.end_s - action.start_s - length_s) > TIME_TOLERANCE_S:
            at_s, needed, available = action.start_s, length_s, action.end_s - action.start_s
            detail = f"It lasts {available:.3f} s instead of {length_s:.3f} s."
        else:
            at_s, needed, available = action.start_s, float(table.start_s[i]), action.start_s
            detail = "It is not one of the scenario's opportunities."
        found.append(
            Violation(code="window", satellite=int(table.satellite[i]), at_s=at_s, needed=needed,
                      available=available, detail=detail, blamed=(position,))
        )  # fmt: skip
    return found


def _outside(problem: Problem, plan: Plan) -> list[int]:
    """Return the positions of actions that do not match their opportunity."""
    table, columns = problem.opportunities, plan.columns
    row, start_s, end_s = columns.row, columns.start_s, columns.end_s
    first_s = np.maximum(table.access_start_s[row], 0.0)
    last_s = np.minimum(table.access_end_s[row], problem.horizon_s)
    longer_s = end_s - start_s - (table.end_s[row] - table.start_s[row])
    shift_s = np.abs(start_s - table.start_s[row])
    if problem.continuous_starts:
        shift_s[table.kind[row] == COLLECT] = 0.0
    off_s = np.max([first_s - start_s, end_s - last_s, np.abs(longer_s), shift_s], axis=0)
    return np.flatnonzero(off_s > TIME_TOLERANCE_S).tolist()


def turns(problem: Problem, plan: Plan, index: int, positions: Sequence[int]) -> list[Violation]:
    """Check that a satellite's tasks do not overlap and leave time for its turns: C(a, b)."""
    found = _first_turns(problem, index, [plan.actions[p] for p in positions], positions)
    columns = plan.columns.at(np.asarray(positions, dtype=np.int64))
    before, after = columns.at(slice(-1)), columns.at(slice(1, None))
    gap_s = after.start_s - np.maximum.accumulate(before.end_s)
    available_s = after.start_s - before.end_s
    is_late = ~are_in_time(problem, index, before, after) | (gap_s < -TIME_TOLERANCE_S)
    late = np.flatnonzero(is_late)
    if not len(late):
        return found
    turned = turns_between(problem, index, before.at(late), after.at(late))
    for i, (angle_deg, needed_s) in zip(late.tolist(), turned, strict=True):
        code: ViolationCode
        if gap_s[i] < -TIME_TOLERANCE_S:
            code, needed, available = "overlap", 0.0, float(gap_s[i])
            detail = f"It starts {-available:.3f} s before the previous task ends."
        elif available_s[i] < needed_s - TIME_TOLERANCE_S:
            code, needed, available = "slew", needed_s, float(available_s[i])
            detail = f"The turn of {angle_deg:.2f} deg takes {needed_s:.3f} s."
        else:
            continue
        found.append(
            Violation(code=code, satellite=index, at_s=float(after.start_s[i]), needed=needed,
                      available=available, detail=detail, blamed=(positions[i + 1],))
        )  # fmt: skip
    return found


def _first_turns(
    problem: Problem, index: int, actions: Sequence[Action], positions: Sequence[int]
) -> list[Violation]:
    """Check that each task leaves time for the turn from the line of sight at the start."""
    found: list[Violation] = []
    if problem.satellites[index].heading is None:
        return found
    for position, action in zip(positions, actions, strict=True):
        first = _first_slew(problem, index, action)
        if first is not None and first.available_s < first.needed_s - TIME_TOLERANCE_S:
            detail = (
                f"The turn of {first.angle_deg:.2f} deg from the initial attitude takes "
                f"{first.needed_s:.3f} s."
            )
            found.append(
                Violation(code="slew", satellite=index, at_s=action.start_s,
                          needed=first.needed_s, available=first.available_s, detail=detail,
                          blamed=(position,))
            )  # fmt: skip
    return found


def slews(problem: Problem, index: int, actions: Sequence[Action]) -> list[Slew | None]:
    """Return the turn before each action of a satellite; None before the first if unknown."""
    columns = Columns.of(actions)
    before, after = columns.at(slice(-1)), columns.at(slice(1, None))
    turned = turns_between(problem, index, before, after)
    available_s = (after.start_s - before.end_s).tolist()
    return [
        *(_first_slew(problem, index, action) for action in actions[:1]),
        *(
            Slew(angle_deg=angle_deg, needed_s=needed_s, available_s=room_s)
            for (angle_deg, needed_s), room_s in zip(turned, available_s, strict=True)
        ),
    ]


def _first_slew(problem: Problem, index: int, action: Action) -> Slew | None:
    """Return the turn to an action from the line of sight at the start, if that is known."""
    heading, turn = problem.satellites[index].heading, turn_from_start(problem, index, action)
    if heading is None or turn is None:
        return None
    available_s = action.start_s - heading.free_from_s
    return Slew(angle_deg=turn[0], needed_s=turn[1], available_s=available_s)


def stations(problem: Problem, plan: Plan) -> list[Violation]:
    """Check that no station serves more satellites at once than it has antennas."""
    table = problem.opportunities
    found = []
    busy: dict[int, list[float]] = {}
    contacts = [p for p, a in enumerate(plan.actions) if table.kind[a.opportunity] == CONTACT]
    for position in sorted(contacts, key=lambda p: plan.actions[p]):
        action = plan.actions[position]
        station = int(table.site[action.opportunity])
        ends = busy.setdefault(station, [])
        while ends and ends[0] <= action.start_s + TIME_TOLERANCE_S:
            heapq.heappop(ends)
        antennas = int(problem.station_antennas[station])
        if len(ends) < antennas:
            heapq.heappush(ends, action.end_s)
            continue
        found.append(
            Violation(
                code="station",
                satellite=int(table.satellite[action.opportunity]),
                at_s=action.start_s,
                needed=float(len(ends) + 1),
                available=float(antennas),
                detail=f"Station {problem.station_ids[station]} serves another satellite "
                f"until {ends[0]:.3f} s.",
                blamed=(position,),
            )
        )
    return found
