"""The referee: replay a plan, report what it earns and every rule that it breaks.

Only this module awards reward. It does not know which solver made a plan, and trusts none.
"""

from __future__ import annotations

import hashlib
import heapq
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner_core.problem import COLLECT, CONTACT, Floats, Longs, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.alone import judged_alone
from planner_core.referee.brought_down import brought_down_of
from planner_core.referee.idle_time import Idle
from planner_core.referee.pinned_plan import breaches
from planner_core.referee.resource_profile import Curve, Profile, thin
from planner_core.referee.rules import slews, stations, windows
from planner_core.referee.timeline import (
    Collected,
    JudgedAction,
    Resourceline,
    SatelliteTimeline,
    Timeline,
    Violation,
)
from planner_core.worth import share_earned


def plan_sha256(problem: Problem, plan: Plan) -> str:
    """Return a hash of what the plan does, the same wherever and whenever it was made."""
    table = problem.opportunities
    content = []
    for action in plan.actions:
        i = action.opportunity
        site = int(table.site[i])
        is_collect = table.kind[i] == COLLECT
        content.append(
            [
                int(table.satellite[i]),
                "collect" if is_collect else "contact",
                problem.target_ids[site] if is_collect else site,
                round(action.start_s * 1000),
                round(action.end_s * 1000),
            ]
        )
    content.sort(key=lambda row: (row[0], row[3], row[4], str(row[1]), str(row[2])))
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()


def replay(problem: Problem, plan: Plan, *, in_detail: bool = True) -> Timeline:
    """Return the timeline of a plan: its reward, resources and every violation.

    Parameters
    ----------
    in_detail
        Whether to list actions and curves by satellite; a search needs only the verdict.
    """
    order, by_satellite = _in_order(problem, plan)
    alone = [
        judged_alone(problem, index, plan, positions)
        for index, positions in enumerate(by_satellite)
    ]
    profiles = [own.profile for own in alone]
    violations: list[Violation] = windows(problem, plan)
    violations += _placed((own.turns for own in alone), by_satellite)
    violations += stations(problem, plan)
    violations += breaches(problem, plan)
    violations += _placed((own.limits for own in alone), by_satellite)

    blamed = {p for v in violations for p in v.blamed}
    down_s = np.full(len(plan.actions), np.nan)
    for own, positions in zip(alone, by_satellite, strict=True):
        down_s[positions] = own.down_s
    worth = _worth(problem, plan, down_s)
    collected, duplicates = _collected(problem, plan, order, blamed, worth, down_s)
    violations += duplicates
    earned = {c.position: c.worth for c in collected.values()}
    brought_down = brought_down_of(problem, plan, by_satellite, profiles)
    curves = [profile.curve for profile in profiles if profile]
    return Timeline(
        satellites=tuple(
            _satellite_timeline(
                problem, plan, index, positions, _Images(earned, worth, down_s), profiles[index]
            )
            for index, positions in enumerate(by_satellite)
            if in_detail
        ),
        violations=tuple(sorted(violations, key=lambda v: (v.at_s, v.satellite, v.code))),
        reward=math.fsum((*earned.values(), *(image.earned for image in brought_down))),
        collected=collected,
        downlinked=tuple(float(p.curve.removed[-1]) if p else 0.0 for p in profiles),
        on_board=tuple(float(p.curve.recorder[-1]) if p else 0.0 for p in profiles),
        battery_min=min((float(curve.battery.min()) for curve in curves), default=None),
        recorder_max=max((float(curve.recorder.max()) for curve in curves), default=None),
        brought_down=brought_down,
    )


def _in_order(problem: Problem, plan: Plan) -> tuple[Longs, list[list[int]]]:
    """Return the positions of all actions in time order, and those of each satellite."""
    columns = plan.columns
    order = columns.order
    satellite = problem.opportunities.satellite[columns.row[order]]
    by_satellite = [order[satellite == index].tolist() for index in range(len(problem.satellites))]
    return order, by_satellite


def _placed(
    violations: Iterable[Sequence[Violation]], by_satellite: Sequence[Sequence[int]]
) -> Iterator[Violation]:
    """Yield violations found per satellite, with ``blamed`` as positions in the whole plan."""
    for found, positions in zip(violations, by_satellite, strict=True):
        for one in found:
            yield replace(one, blamed=tuple(positions[own] for own in one.blamed))


def _collected(
    problem: Problem,
    plan: Plan,
    order: Longs,
    blamed: set[int],
    worth: Floats,
    down_s: Floats,
) -> tuple[dict[int, Collected], list[Violation]]:
    """Return the best collect of each target that breaks nothing, and warnings for the others.

    Of equally good collects the first counts.
    """
    table, columns = problem.opportunities, plan.columns
    is_image = table.kind[columns.row] == COLLECT
    is_image[list(blamed)] = False
    images = order[is_image[order]]
    site = table.site[columns.row[images]]
    targets, first, count = np.unique(site, return_index=True, return_counts=True)
    best = images[first]
    duplicates = []
    is_known = np.zeros(len(targets), dtype=np.bool_)
    if problem.on_board:
        is_known = np.isin(targets, [image.target for image in problem.on_board])
    by_first = np.argsort(first)
    for target in by_first[((count > 1) | is_known)[by_first]].tolist():
        positions = images[site == targets[target]].tolist()
        if is_known[target]:
            duplicates += [_has_been_imaged(problem, plan, position) for position in positions]
        else:
            best[target] = max(positions, key=worth.__getitem__)
            duplicates += _beside_better(problem, plan, positions, int(best[target]))
    new = by_first[~is_known[by_first]]
    best = best[new]
    age_s = down_s[best] - columns.end_s[best]
    rows = zip(
        best.tolist(),
        table.satellite[columns.row[best]].tolist(),
        worth[best].tolist(),
        _or_none(down_s[best]),
        _or_none(age_s),
        strict=True,
    )
    return dict(zip(targets[new].tolist(), map(Collected._make, rows), strict=True)), duplicates


def _or_none(values: Floats) -> list[float | None]:
    return [None if math.isnan(value) else value for value in values.tolist()]


def _beside_better(
    problem: Problem, plan: Plan, positions: Sequence[int], best: int
) -> list[Violation]:
    """Return a warning for each image of a target except the best."""
    found = []
    why = "has a better image later"
    for position in positions:
        if position == best:
            why = "is collected already"
            continue
        row = plan.actions[position].opportunity
        target = problem.target_ids[int(problem.opportunities.site[row])]
        found.append(
            Violation(code="duplicate", satellite=int(problem.opportunities.satellite[row]),
                      needed=1.0, available=2.0, at_s=plan.actions[position].start_s,
                      blamed=(), detail=f"Target {target} {why}.")
        )  # fmt: skip
    return found


def _has_been_imaged(problem: Problem, plan: Plan, position: int) -> Violation:
    action, table = plan.actions[position], problem.opportunities
    target = problem.target_ids[int(table.site[action.opportunity])]
    return Violation(
        code="duplicate", satellite=int(table.satellite[action.opportunity]), needed=1.0,
        available=2.0, at_s=action.start_s, blamed=(),
        detail=f"Target {target} has an image from before the horizon.",
    )  # fmt: skip


def _worth(problem: Problem, plan: Plan, down_s: Floats) -> Floats:
    """Return what the image of each action would earn alone; 0 for contacts."""
    rows = plan.columns.row
    if not problem.counts_delivery:
        return problem.worth[rows]
    age_s = np.where(np.isnan(down_s), np.inf, down_s - plan.columns.end_s)
    return problem.worth_on_ground[rows] * share_earned(problem.objective, age_s)


class _Images(NamedTuple):
    """What the image of each action earns in the plan and would earn alone; when it is down."""

    earned: Mapping[int, float]
    worth: Floats
    delivered_s: Floats


def _satellite_timeline(
    problem: Problem,
    plan: Plan,
    index: int,
    positions: Sequence[int],
    images: _Images,
    profile: Profile | None,
) -> SatelliteTimeline:
    table = problem.opportunities
    actions: list[JudgedAction] = []
    own = [plan.actions[position].opportunity for position in positions]
    are_contacts = (table.kind[own] == CONTACT).tolist()
    worth, delivered_s = images.worth[positions].tolist(), images.delivered_s[positions].tolist()
    turned = slews(problem, index, [plan.actions[position] for position in positions])
    after = profile.after.points() if profile else []
    for order, position in enumerate(positions):
        action = plan.actions[position]
        level = after[order] if profile else None
        is_contact, down_s = are_contacts[order], delivered_s[order]
        actions.append(
            JudgedAction(
                mode="contact" if is_contact else "collect",
                start_s=action.start_s,
                end_s=action.end_s,
                opportunity=action.opportunity,
                position=position,
                slew=turned[order],
                reward=images.earned.get(position, 0.0),
                worth=None if is_contact else worth[order],
                delivered_s=None if math.isnan(down_s) else down_s,
                battery_end=level.battery if level else None,
                recorder_end=level.recorder if level else None,
            )
        )
    if profile is None:
        return SatelliteTimeline(actions=tuple(actions), resources=None)
    time_s, battery, recorder = thin(profile.curve)
    idle = _idle_actions(profile.idle, profile.sun_end)
    # The merge is stable: if a task and idle time start at the same instant, the task comes first.
    actions = list(heapq.merge(actions, idle, key=lambda action: action.start_s))
    return SatelliteTimeline(
        actions=tuple(actions),
        resources=Resourceline(time_s=time_s, battery=battery, recorder=recorder),
    )


def _idle_actions(idle: Idle, left: Curve) -> list[JudgedAction]:
    """Return sun-pointing, or a hold where there is no time for it, for each idle span."""
    at_sun = idle.is_at_sun
    columns = (
        at_sun,
        np.where(at_sun, idle.sun_from_s, idle.start_s),
        np.where(at_sun, idle.sun_until_s, idle.end_s),
        idle.turn_to_s,
        idle.turn_back_s,
        left.battery,
        left.recorder,
    )
    return [
        JudgedAction(
            mode="sunpoint" if is_at_sun else "hold",
            start_s=start_s,
            end_s=end_s,
            opportunity=None,
            position=None,
            slew=None,
            reward=0.0,
            battery_end=battery,
            recorder_end=recorder,
            turn_to_s=turn_to_s if is_at_sun else None,
            turn_back_s=turn_back_s if is_at_sun else None,
        )
        for is_at_sun, start_s, end_s, turn_to_s, turn_back_s, battery, recorder in zip(
            *(column.tolist() for column in columns), strict=True
        )
    ]
