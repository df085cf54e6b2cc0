"""Battery and recorder beyond their limits: when, by whom, and whether any plan could help it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.referee.resource_profile import Point, Profile
from planner_core.referee.timeline import Violation
from planner_core.referee.unavoidable import is_unavoidable

_Check = tuple[
    Literal["battery", "recorder"],
    Callable[[Point], bool],
    Callable[[Point, Point], bool],
    Callable[[Point], bool],
    float,
]


def limits_broken(
    problem: Problem, plan: Plan, index: int, positions: Sequence[int], profile: Profile
) -> list[Violation]:
    """Battery stays strictly above its minimum, recorder strictly below its maximum.

    From a state beyond a limit, actions that do not worsen it break nothing: a contact that
    empties a recorder which was too full at the start is the way back. So it is where what is
    frozen leads there. What is frozen is to blame where it finds no room or energy at all.
    """
    r = problem.satellites[index].resources

    def is_low(point: Point) -> bool:
        return point.battery <= r.battery_min_fraction

    def is_full(point: Point) -> bool:
        return point.recorder >= r.recorder_max_fraction

    def drains(before: Point, after: Point) -> bool:
        return after.battery < before.battery or is_empty(after)

    def fills(before: Point, after: Point) -> bool:
        return after.recorder > before.recorder or has_no_room(after)

    def is_frozen(position: int) -> bool:
        return problem.pinned.is_frozen(plan.actions[position].start_s)

    began_s = profile.points[0].time_s
    checked: tuple[_Check, ...] = (
        ("battery", is_low, drains, is_empty, r.battery_min_fraction),
        ("recorder", is_full, fills, has_no_room, r.recorder_max_fraction),
    )
    found = []
    for code, is_broken, worsens, is_at_end, limit in checked:
        parts = [
            _Part(
                position,
                before.time_s,
                after.time_s,
                worsens=worsens(before, after),
                is_frozen=is_frozen(position) and not is_at_end(after),
            )
            for position, before, after in zip(
                positions, profile.before, profile.after, strict=True
            )
            if is_broken(after) or (problem.dynamics == "physical" and is_broken(before))
        ]
        for start_s, end_s, first, worst in _excursions(problem, profile.points, code, limit):
            is_given = start_s == began_s or is_unavoidable(problem, index, code, first, start_s)
            blamed = tuple(
                part.position
                for part in parts
                if part.start_s <= end_s
                and part.end_s >= start_s
                and (not is_given or (part.worsens and not part.is_frozen))
            )
            found.append(
                Violation(
                    code=code,
                    satellite=index,
                    at_s=start_s,
                    needed=limit,
                    available=worst,
                    detail=f"The {code} reaches {worst:.4f} of its capacity; "
                    f"the limit is {limit:.4f}.",
                    blamed=blamed,
                    inherited=is_given and all(map(is_frozen, blamed)),
                )
            )
    return found


def is_empty(point: Point) -> bool:
    """Return whether there is no energy at all."""
    return point.battery <= 0.0


def has_no_room(point: Point) -> bool:
    """Return whether data is lost."""
    return point.recorder >= 1.0


class _Part(NamedTuple):
    """An action that touches a limit: whether it makes it worse, and whether it had to be flown."""

    position: int
    start_s: float
    end_s: float
    worsens: bool
    is_frozen: bool


def _excursions(
    problem: Problem, points: Sequence[Point], code: str, limit: float
) -> list[tuple[float, float, float, float]]:
    """Return (start, end, value at the start, worst) of each stay at or beyond a limit."""
    values = [p.battery if code == "battery" else p.recorder for p in points]
    sign = -1.0 if code == "battery" else 1.0
    found: list[tuple[float, float, float, float]] = []
    start_s: float | None = None
    first = worst = limit
    for i, value in enumerate(values):
        is_broken = sign * (value - limit) >= 0.0
        if is_broken and start_s is None:
            start_s, first, worst = points[i].time_s, value, value
            step = value - values[i - 1] if i else 0.0
            if problem.dynamics == "physical" and step != 0.0:
                share = (limit - values[i - 1]) / step
                start_s = points[i - 1].time_s + share * (points[i].time_s - points[i - 1].time_s)
                first = limit
        elif is_broken:
            worst = max(worst, value) if sign > 0 else min(worst, value)
        elif start_s is not None:
            found.append((start_s, points[i].time_s, first, worst))
            start_s = None
    if start_s is not None:
        found.append((start_s, points[-1].time_s, first, worst))
    return found
