"""The rules that a plan must keep, beside its pins: windows, turns, stations, and limits."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.plan import Action, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.resource_profile import Point, Profile
from planner_core.referee.sight import turn_between, turn_from_start
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
    for position in positions:
        action = plan.actions[position]
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
            angle_deg, needed_s = turn_between(problem, index, previous, action)
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


def limits(
    problem: Problem, index: int, positions: Sequence[int], profile: Profile
) -> list[Violation]:
    """Battery stays strictly above its minimum, recorder strictly below its maximum.

    From a state beyond a limit, actions that do not worsen it break nothing: a contact that
    empties a recorder which was too full at the start is the way back.
    """
    r = problem.satellites[index].resources

    def is_low(point: Point) -> bool:
        return point.battery <= r.battery_min_fraction

    def is_full(point: Point) -> bool:
        return point.recorder >= r.recorder_max_fraction

    def drains(before: Point, after: Point) -> bool:
        return after.battery < before.battery or after.battery <= 0.0

    def fills(before: Point, after: Point) -> bool:
        return after.recorder > before.recorder or after.recorder >= 1.0

    began_s = profile.points[0].time_s
    found = []
    for code, is_broken, worsens, limit in (
        ("battery", is_low, drains, r.battery_min_fraction),
        ("recorder", is_full, fills, r.recorder_max_fraction),
    ):
        blamed = [
            (before.time_s, after.time_s, position, worsens(before, after))
            for position, before, after in zip(
                positions, profile.before, profile.after, strict=True
            )
            if is_broken(after) or (problem.dynamics == "physical" and is_broken(before))
        ]
        for start_s, end_s, worst in _excursions(problem, profile.points, code, limit):
            partners = tuple(
                position
                for before_s, after_s, position, is_worse in blamed
                if before_s <= end_s and after_s >= start_s and (is_worse or start_s > began_s)
            )
            found.append(
                Violation(
                    code="battery" if code == "battery" else "recorder",
                    satellite=index,
                    at_s=start_s,
                    needed=limit,
                    available=worst,
                    detail=f"The {code} reaches {worst:.4f} of its capacity; "
                    f"the limit is {limit:.4f}.",
                    blamed=partners,
                    inherited=start_s == began_s and not partners,
                )
            )
    return found


def _excursions(
    problem: Problem, points: Sequence[Point], code: str, limit: float
) -> list[tuple[float, float, float]]:
    """Return (start, end, worst value) of each stay at or beyond a limit."""
    values = [p.battery if code == "battery" else p.recorder for p in points]
    sign = -1.0 if code == "battery" else 1.0
    found: list[tuple[float, float, float]] = []
    start_s: float | None = None
    worst = limit
    for i, value in enumerate(values):
        is_broken = sign * (value - limit) >= 0.0
        if is_broken and start_s is None:
            start_s, worst = points[i].time_s, value
            step = value - values[i - 1] if i else 0.0
            if problem.dynamics == "physical" and step != 0.0:
                share = (limit - values[i - 1]) / step
                start_s = points[i - 1].time_s + share * (points[i].time_s - points[i - 1].time_s)
        elif is_broken:
            worst = max(worst, value) if sign > 0 else min(worst, value)
        elif start_s is not None:
            found.append((start_s, points[i].time_s, worst))
            start_s = None
    if start_s is not None:
        found.append((start_s, points[-1].time_s, worst))
    return found
