"""What changed from one plan to another: actions and totals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from planner_core.domain import Scenario
from planner_core.problem import COLLECT, Problem
from planner_core.referee.timeline import Mode, Timeline

_SAME_TIME: Final = timedelta(milliseconds=1)


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class PlannedAction:
    """A collect or a contact in terms that do not depend on one problem's indices."""

    start: datetime
    end: datetime
    satellite_id: str
    mode: Mode
    site_id: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanView:
    """The parts of a plan that are compared; ``totals`` are numbers, or None if unknown."""

    actions: tuple[PlannedAction, ...]
    totals: Mapping[str, float | None]

    @classmethod
    def of(cls, scenario: Scenario, problem: Problem, timeline: Timeline) -> PlanView:
        """Return the view of a judged plan."""
        actions = []
        for satellite, line in zip(problem.satellites, timeline.satellites, strict=True):
            for action in line.actions:
                if action.opportunity is None:
                    continue
                site = int(problem.opportunities.site[action.opportunity])
                is_collect = problem.opportunities.kind[action.opportunity] == COLLECT
                actions.append(
                    PlannedAction(
                        start=scenario.horizon.instant(action.start_s),
                        end=scenario.horizon.instant(action.end_s),
                        satellite_id=satellite.id,
                        mode=action.mode,
                        site_id=(problem.target_ids if is_collect else problem.station_ids)[site],
                    )
                )
        modes = [action.mode for action in actions]
        age_s = [c.age_s for c in timeline.collected.values() if c.age_s is not None]
        return cls(
            actions=tuple(sorted(actions)),
            totals={
                "reward": timeline.reward,
                "collects": float(modes.count("collect")),
                "contacts": float(modes.count("contact")),
                "targets": float(len(timeline.collected)),
                "delivered": float(len(age_s)) if problem.use_resources else None,
                "age_mean_s": round(sum(age_s) / len(age_s), 3) if age_s else None,
                "downlinked_fraction": sum(timeline.downlinked) if problem.use_resources else None,
                "battery_min_fraction": timeline.battery_min,
                "recorder_max_fraction": timeline.recorder_max,
            },
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanDiff:
    """The difference between two plans.

    Attributes
    ----------
    moved
        Pairs (before, after): the same target at another time or by another satellite, or the
        same satellite's contact with the same station at another time.
    totals
        Second minus first, where they differ; None if one of the two is unknown.
    """

    added: tuple[PlannedAction, ...]
    removed: tuple[PlannedAction, ...]
    moved: tuple[tuple[PlannedAction, PlannedAction], ...]
    totals: Mapping[str, float | None]

    @property
    def is_empty(self) -> bool:
        """Whether the plans are the same."""
        return not (self.added or self.removed or self.moved or self.totals)


def plan_diff(first: PlanView, second: PlanView) -> PlanDiff:
    """Return the difference between two plans; it is empty for a plan and itself."""
    before, after = _without_common(first.actions, second.actions)
    there = _grouped(after, _site)
    pairs = sorted((abs(a.start - b.start), a, b) for a in before for b in there.get(_site(a), ()))
    moved = []
    gone, new = Counter(before), Counter(after)
    for _, a, b in pairs:
        if gone[a] and new[b]:
            moved.append((a, b))
            gone[a] -= 1
            new[b] -= 1
    return PlanDiff(
        added=tuple(sorted(new.elements())),
        removed=tuple(sorted(gone.elements())),
        moved=tuple(sorted(moved)),
        totals=_differences(first.totals, second.totals),
    )


def _without_common(
    first: tuple[PlannedAction, ...], second: tuple[PlannedAction, ...]
) -> tuple[list[PlannedAction], list[PlannedAction]]:
    """Return the actions that only one plan has; times may differ by a millisecond (rounding)."""
    left = _grouped(second, _task)
    before = []
    for action in first:
        there = left.get(_task(action), [])
        same = next((other for other in there if _is_at_same_time(action, other)), None)
        if same is None:
            before.append(action)
        else:
            there.remove(same)
    return before, [action for there in left.values() for action in there]


def _grouped(
    actions: Iterable[PlannedAction], key: Callable[[PlannedAction], tuple[str, ...]]
) -> dict[tuple[str, ...], list[PlannedAction]]:
    groups: dict[tuple[str, ...], list[PlannedAction]] = {}
    for action in actions:
        groups.setdefault(key(action), []).append(action)
    return groups


def _is_at_same_time(a: PlannedAction, b: PlannedAction) -> bool:
    return abs(a.start - b.start) <= _SAME_TIME and abs(a.end - b.end) <= _SAME_TIME


def _task(action: PlannedAction) -> tuple[str, ...]:
    return action.satellite_id, action.mode, action.site_id


def _site(action: PlannedAction) -> tuple[str, ...]:
    """Return the key of an action that stays the same when it moves."""
    if action.mode == "collect":
        return action.mode, action.site_id
    return action.mode, action.site_id, action.satellite_id


def _differences(
    first: Mapping[str, float | None], second: Mapping[str, float | None]
) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for name in first.keys() | second.keys():
        a, b = first.get(name), second.get(name)
        if a != b:
            found[name] = None if a is None or b is None else b - a
    return dict(sorted(found.items()))
