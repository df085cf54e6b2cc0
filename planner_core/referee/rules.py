"""The rules that a plan must keep, beside its pins and limits: windows, turns and stations."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.plan import Action, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.sight import turn_from_start, turns_between
from planner_core.referee.timeline import Slew, Violation, ViolationCode


def windows(problem: Problem, plan: Plan) -> list[Violation]:
    """Each action lies in its access and in the horizon, and has its opportunity's length."""
    table = problem.opportunities
    found = []
    for position, action in enumerate(plan.actions):
        i = action.opportunity
        first_s = max(0.0, float(table.access_start_s[i]))
        last_s = min(problem.horizon_s, float(table.access_end_s[i]))
        early_s, late_s = first_s - action.start_s, action.end_s - last_s
        length_s = float(table.end_s[i] - table.start_s[i])
        is_own_start = problem.continuous_starts and table.kind[i] == COLLECT
        shift_s = abs(action.start_s - float(table.start_s[i]))
        if early_s > TIME_TOLERANCE_S:
            at_s, needed, available = action.start_s, first_s, action.start_s
            detail = f"It starts {early_s:.3f} s before its access."
        elif late_s > TIME_TOLERANCE_S:
            at_s, needed, available = action.end_s, last_s, action.end_s
            detail = f"It ends {late_s:.3f} s after its access."
        elif abs(action.end_s - action.start_s - length_s) > TIME_TOLERANCE_S:
            at_s, needed, available = action.start_s, length_s, action.end_s - action.start_s
            detail = f"It lasts {available:.3f} s instead of {length_s:.3f} s."
        elif shift_s > TIME_TOLERANCE_S and not is_own_start:
            at_s, needed, available = action.start_s, float(table.start_s[i]), action.start_s
            detail = "It is not one of the scenario's opportunities."
        else:
            continue
        found.append(
            Violation(code="window", satellite=int(table.satellite[i]), at_s=at_s, needed=needed,
                      available=available, detail=detail, blamed=(position,))
        )  # fmt: skip
    return found


def turns(
    problem: Problem, plan: Plan, index: int, positions: Sequence[int]
) -> tuple[list[Violation], dict[int, Slew | None]]:
    """Tasks of one satellite neither overlap nor follow faster than it turns: C(a, b)."""
    found: list[Violation] = []
    slews: dict[int, Slew | None] = {}
    previous: Action | None = None
    busy_until: Action | None = None
    actions = [plan.actions[position] for position in positions]
    between = [(0.0, 0.0), *turns_between(problem, index, actions)][: len(actions)]
    for position, action, (angle_deg, needed_s) in zip(positions, actions, between, strict=True):
        slews[position] = first = _first_slew(problem, index, action)
        if first is not None and first.available_s < first.needed_s - TIME_TOLERANCE_S:
            detail = (
                f"The turn of {first.angle_deg:.2f} deg from where it looked at the start takes "
                f"{first.needed_s:.3f} s."
            )
            found.append(
                Violation(code="slew", satellite=index, at_s=action.start_s,
                          needed=first.needed_s, available=first.available_s, detail=detail,
                          blamed=(position,))
            )  # fmt: skip
        if previous is not None and busy_until is not None:
            available_s = action.start_s - previous.end_s
            slews[position] = Slew(angle_deg=angle_deg, needed_s=needed_s, available_s=available_s)
            gap_s = action.start_s - busy_until.end_s
            code: ViolationCode | None = None
            if gap_s < -TIME_TOLERANCE_S:
                code, needed, available = "overlap", 0.0, gap_s
                detail = f"It starts {-gap_s:.3f} s before the task ahead of it ends."
            elif available_s < needed_s - TIME_TOLERANCE_S:
                code, needed, available = "slew", needed_s, available_s
                detail = f"The turn of {angle_deg:.2f} deg takes {needed_s:.3f} s."
            if code is not None:
                found.append(
                    Violation(code=code, satellite=index, at_s=action.start_s, needed=needed,
                              available=available, detail=detail, blamed=(position,))
                )  # fmt: skip
        previous = action
        if busy_until is None or action.end_s > busy_until.end_s:
            busy_until = action
    return found, slews


def _first_slew(problem: Problem, index: int, action: Action) -> Slew | None:
    """Return the turn to an action from where its satellite looked at the start, if known."""
    heading, turn = problem.satellites[index].heading, turn_from_start(problem, index, action)
    if heading is None or turn is None:
        return None
    available_s = action.start_s - heading.free_from_s
    return Slew(angle_deg=turn[0], needed_s=turn[1], available_s=available_s)


def stations(problem: Problem, plan: Plan) -> list[Violation]:
    """Check that no station serves more satellites at a time than it has antennas."""
    table = problem.opportunities
    found = []
    busy: dict[int, list[float]] = {}
    contacts = [p for p, a in enumerate(plan.actions) if table.kind[a.opportunity] == CONTACT]
    for position in sorted(contacts, key=lambda p: plan.actions[p]):
        action = plan.actions[position]
        station = int(table.place[action.opportunity])
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
