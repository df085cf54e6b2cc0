"""What a replan has changed, and why, worked out from the two plans alone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Literal

from planner_core.referee.plan_diff import PlannedAction, PlanView, plan_diff

Cause = Literal["lost", "displaced_by", "resource", "gain"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Changed:
    """An action that differs: as it was, as it is, and why.

    Attributes
    ----------
    because_of
        Actions of the new plan that took its time or its station.
    """

    before: PlannedAction | None
    after: PlannedAction | None
    cause: Cause
    because_of: tuple[PlannedAction, ...] = ()


def changes_of(
    before: Sequence[PlannedAction],
    after: Sequence[PlannedAction],
    is_lost: Callable[[PlannedAction], bool],
    turn_s: Mapping[str, float],
) -> tuple[Changed, ...]:
    """Return the differences between two plans, in order of time.

    Parameters
    ----------
    is_lost
        Whether an action could not have stayed, whatever is planned.
    turn_s
        By satellite, the longest turn between two of its tasks. Actions further apart do not
        compete for time.
    """
    diff = plan_diff(
        PlanView(actions=tuple(before), totals={}), PlanView(actions=tuple(after), totals={})
    )
    new = [*diff.added, *(now for _, now in diff.moved)]
    found = [_gone(was, None, is_lost, new, turn_s) for was in diff.removed]
    found += [_gone(was, now, is_lost, new, turn_s) for was, now in diff.moved]
    found += [
        Changed(before=None, after=action, cause="gain" if action.mode == "collect" else "resource")
        for action in diff.added
    ]
    return tuple(sorted(found, key=_time_of))


def _time_of(one: Changed) -> tuple[PlannedAction, bool]:
    action = one.before or one.after
    assert action is not None
    return action, one.before is None


def _gone(
    was: PlannedAction,
    now: PlannedAction | None,
    is_lost: Callable[[PlannedAction], bool],
    new: Collection[PlannedAction],
    turn_s: Mapping[str, float],
) -> Changed:
    if is_lost(was):
        return Changed(before=was, after=now, cause="lost")
    rivals = tuple(sorted(other for other in new if other != now and _crowds(was, other, turn_s)))
    if rivals:
        return Changed(before=was, after=now, cause="displaced_by", because_of=rivals)
    is_better = now is not None and now.mode == "collect"
    return Changed(before=was, after=now, cause="gain" if is_better else "resource")


def _crowds(was: PlannedAction, other: PlannedAction, turn_s: Mapping[str, float]) -> bool:
    """Return whether ``other`` may leave no time for an action, or takes its station."""
    if other.satellite_id == was.satellite_id:
        around = timedelta(seconds=turn_s.get(was.satellite_id, 0.0))
        return other.start < was.end + around and other.end > was.start - around
    is_same_station = was.mode == other.mode == "contact" and was.site_id == other.site_id
    return is_same_station and other.start < was.end and other.end > was.start


def share_of(found: Collection[Changed], num_before: int, *, forced: bool = False) -> float:
    """Return the share of the previous plan that is moved or removed (if ``forced``, only lost)."""
    counted = [
        one for one in found if one.before is not None and (one.cause == "lost" or not forced)
    ]
    return len(counted) / num_before if num_before else 0.0
