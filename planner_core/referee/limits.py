"""Battery and recorder beyond their limits: when, caused by which actions, and if avoidable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.referee.resource_profile import Curve, Point, Profile
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
    """Check that battery stays strictly above its minimum and recorder strictly below its maximum.

    If the horizon begins beyond a limit, only actions that make it worse break it: a contact that
    empties an overfull recorder is the way back. The same holds if frozen actions lead beyond the
    limit. A frozen action is blamed only if it leaves the battery empty or the recorder full.
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

    began_s = float(profile.curve.time_s[0])
    checked: tuple[_Check, ...] = (
        ("battery", is_low, drains, is_empty, r.battery_min_fraction),
        ("recorder", is_full, fills, has_no_room, r.recorder_max_fraction),
    )
    found = []
    for code, is_broken, worsens, is_at_end, limit in checked:
        excursions = _excursions(problem, profile.curve, code, limit)
        if not excursions:
            continue
        parts = [
            _Part(
                position,
                before.time_s,
                after.time_s,
                worsens=worsens(before, after),
                is_frozen=is_frozen(position) and not is_at_end(after),
            )
            for position, before, after in zip(
                positions, profile.before.points(), profile.after.points(), strict=True
            )
            if is_broken(after) or (problem.dynamics == "physical" and is_broken(before))
        ]
        for start_s, end_s, first, worst in excursions:
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
    """Return whether the battery is empty."""
    return point.battery <= 0.0


def has_no_room(point: Point) -> bool:
    """Return whether the recorder is full, so that data is lost."""
    return point.recorder >= 1.0


class _Part(NamedTuple):
    """An action at a limit: whether it makes it worse, and whether it is frozen (not to blame)."""

    position: int
    start_s: float
    end_s: float
    worsens: bool
    is_frozen: bool


def _excursions(
    problem: Problem, curve: Curve, code: str, limit: float
) -> list[tuple[float, float, float, float]]:
    """Return (start, end, value at the start, worst value) of each time at or beyond a limit."""
    sign, values = (-1.0, curve.battery) if code == "battery" else (1.0, curve.recorder)
    is_broken = sign * (values - limit) >= 0.0
    if not is_broken.any():
        return []
    edges = np.diff(is_broken, prepend=False, append=False)
    found = []
    for begin, end in np.flatnonzero(edges).reshape(-1, 2).tolist():
        start_s, first = curve.time_s[begin], values[begin]
        step = values[begin] - values[begin - 1] if begin else 0.0
        if problem.dynamics == "physical" and step != 0.0:
            share = (limit - values[begin - 1]) / step
            before_s = curve.time_s[begin - 1]
            start_s, first = before_s + share * (start_s - before_s), limit
        stay = values[begin:end]
        worst = stay.max() if sign > 0 else stay.min()
        end_s = curve.time_s[min(end, len(values) - 1)]
        found.append((float(start_s), float(end_s), float(first), float(worst)))
    return found
