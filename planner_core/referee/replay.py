"""The referee: replay a plan, say what it earns and every rule that it breaks.

Only this module awards reward. It does not know which solver made a plan, and believes none.
"""

from __future__ import annotations

import hashlib
import heapq
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from planner_core.problem import (
    COLLECT,
    CONTACT,
    Floats,
    Problem,
)
from planner_core.problem.plan import Action, Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.brought_down import BroughtDown, brought_down_of
from planner_core.referee.delivery import delivered_s
from planner_core.referee.idle_time import Idle
from planner_core.referee.pinned_plan import breaches
from planner_core.referee.resource_profile import (
    Point,
    Profile,
    integrate,
    thin,
)
from planner_core.referee.sight import turn_between, turn_from_start
from planner_core.worth import share_earned

Mode = Literal["collect", "contact", "sunpoint", "hold"]
ViolationCode = Literal[
    "window",
    "overlap",
    "slew",
    "station",
    "duplicate",
    "battery",
    "recorder",
    "pin",
    "outage",
    "frozen",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """A rule that the plan breaks.

    Attributes
    ----------
    at_s
        When, in seconds from the start of the horizon.
    needed, available
        What the rule asks for and what the plan leaves: seconds, or fractions of capacity.
    blamed
        Positions in ``plan.actions`` of the actions that break it; those earn nothing.
    inherited
        Whether it held at the start already, and no action has a part in it.
    """

    code: ViolationCode
    satellite: int
    at_s: float
    needed: float
    available: float
    detail: str
    blamed: tuple[int, ...]
    inherited: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Slew:
    """The turn before an action; ``needed_s`` includes settling."""

    angle_deg: float
    needed_s: float
    available_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedAction:
    """One action of the timeline. ``opportunity`` and ``position`` are None in idle time.

    Attributes
    ----------
    worth
        Of a collect: what its image earns by itself.
    delivered_s
        Of a collect: when its last bit is on the ground; None for never.
    turn_to_s, turn_back_s
        Of sun-pointing: the turn to the sun that ends at its start, and the one from its end.
    """

    mode: Mode
    start_s: float
    end_s: float
    opportunity: int | None
    position: int | None
    slew: Slew | None
    reward: float
    battery_end: float | None
    recorder_end: float | None
    worth: float | None = None
    delivered_s: float | None = None
    turn_to_s: float | None = None
    turn_back_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resourceline:
    """Battery and recorder fractions over time; shape ``(k,)`` each."""

    time_s: Floats
    battery: Floats
    recorder: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class SatelliteTimeline:
    """What one satellite does, and its resources (None where they do not count)."""

    actions: tuple[JudgedAction, ...]
    resources: Resourceline | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Collected:
    """How a target was collected: by which plan action, and whether its image is down.

    Attributes
    ----------
    worth
        What the image earns.
    delivered_s, age_s
        When its last bit is on the ground, and how long after the collect; None for never.
    """

    position: int
    satellite: int
    worth: float
    delivered_s: float | None
    age_s: float | None

    @property
    def is_downlinked(self) -> bool:
        """Whether the image is on the ground by the end of the horizon."""
        return self.delivered_s is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Timeline:
    """A plan, judged.

    Attributes
    ----------
    reward
        Sum over targets of the best worth of their collects by actions that break nothing, and
        of what images earn that were on board at the start.
    collected
        By target index.
    downlinked, on_board
        What contacts took down, and what is in the recorder at the end, by satellite, in recorder
        capacities.
    battery_min, recorder_max
        The lowest battery and the highest recorder of any satellite at any instant.
    brought_down
        Of each image that a recorder held at the start, in the problem's order.
    """

    satellites: tuple[SatelliteTimeline, ...]
    violations: tuple[Violation, ...]
    reward: float
    collected: Mapping[int, Collected]
    downlinked: tuple[float, ...]
    on_board: tuple[float, ...]
    battery_min: float | None
    recorder_max: float | None
    brought_down: tuple[BroughtDown, ...] = ()

    @property
    def earned_by_new(self) -> float:
        """What the images of the plan itself earn."""
        return math.fsum(image.worth for image in self.collected.values())

    @property
    def is_valid(self) -> bool:
        """Whether nothing is broken; imaging a target twice is allowed, it earns nothing."""
        return all(v.code == "duplicate" for v in self.violations)

    @property
    def validity(self) -> Literal["valid", "inherited", "violations"]:
        """What is to be said of it: inherited violations are no fault of the plan."""
        if self.is_valid:
            return "valid"
        own = (v for v in self.violations if v.code != "duplicate" and not v.inherited)
        return "violations" if any(own) else "inherited"


def plan_sha256(problem: Problem, plan: Plan) -> str:
    """Return a hash of what the plan does, the same wherever and whenever it was made."""
    table = problem.opportunities
    content = []
    for action in plan.actions:
        i = action.opportunity
        place = int(table.place[i])
        is_collect = table.kind[i] == COLLECT
        content.append(
            [
                int(table.satellite[i]),
                "collect" if is_collect else "contact",
                problem.target_ids[place] if is_collect else place,
                round(action.start_s * 1000),
                round(action.end_s * 1000),
            ]
        )
    content.sort(key=lambda row: (row[0], row[3], row[4], str(row[1]), str(row[2])))
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()


def replay(problem: Problem, plan: Plan) -> Timeline:
    """Return the timeline of a plan: its reward, resources and every violation."""
    by_satellite: list[list[int]] = [[] for _ in problem.satellites]
    for position, action in enumerate(plan.actions):
        by_satellite[problem.opportunities.satellite[action.opportunity]].append(position)
    for positions in by_satellite:
        positions.sort(key=lambda p: plan.actions[p])

    violations: list[Violation] = _windows(problem, plan)
    slews: dict[int, Slew | None] = {}
    for index, positions in enumerate(by_satellite):
        found, turns = _turns(problem, plan, index, positions)
        violations += found
        slews |= turns
    violations += _stations(problem, plan)
    violations += [Violation(**b._asdict()) for b in breaches(problem, plan)]

    profiles: list[Profile | None] = [None] * len(problem.satellites)
    if problem.use_resources:
        for index, positions in enumerate(by_satellite):
            profile = integrate(
                problem, problem.satellites[index], [plan.actions[p] for p in positions]
            )
            profiles[index] = profile
            violations += _limits(problem, index, positions, profile)

    blamed = {p for v in violations for p in v.blamed}
    down_s = _delivered(problem, plan, by_satellite, profiles)
    worth = _worth(problem, plan, down_s)
    collected, duplicates = _collected(problem, plan, blamed, worth, down_s)
    violations += duplicates
    earned = {c.position: c.worth for c in collected.values()}
    brought_down = brought_down_of(problem, plan, by_satellite, profiles)
    points = [point for profile in profiles if profile for point in profile.points]
    return Timeline(
        satellites=tuple(
            _satellite_timeline(
                problem, plan, positions, slews, _Images(earned, worth, down_s), profile
            )
            for positions, profile in zip(by_satellite, profiles, strict=True)
        ),
        violations=tuple(sorted(violations, key=lambda v: (v.at_s, v.satellite, v.code))),
        reward=math.fsum((*earned.values(), *(image.earned for image in brought_down))),
        collected=collected,
        downlinked=tuple(profile.points[-1].removed if profile else 0.0 for profile in profiles),
        on_board=tuple(profile.points[-1].recorder if profile else 0.0 for profile in profiles),
        battery_min=min((p.battery for p in points), default=None),
        recorder_max=max((p.recorder for p in points), default=None),
        brought_down=brought_down,
    )


def _windows(problem: Problem, plan: Plan) -> list[Violation]:
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


def _turns(
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


def _stations(problem: Problem, plan: Plan) -> list[Violation]:
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


def _limits(
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


def _collected(
    problem: Problem, plan: Plan, blamed: set[int], worth: Floats, down_s: Floats
) -> tuple[dict[int, Collected], list[Violation]]:
    """Return the best unbroken collect of each target, and a warning for each other one.

    Of equal ones the first is the best.
    """
    table = problem.opportunities
    images: dict[int, list[int]] = {}
    for position in sorted(range(len(plan.actions)), key=lambda p: plan.actions[p]):
        i = plan.actions[position].opportunity
        if table.kind[i] == COLLECT and position not in blamed:
            images.setdefault(int(table.place[i]), []).append(position)
    collected: dict[int, Collected] = {}
    duplicates = []
    on_board = {image.target for image in problem.on_board}
    for target, positions in images.items():
        if target in on_board:
            duplicates += [_has_been_imaged(problem, plan, position) for position in positions]
            continue
        best = int(np.argmax(worth[positions]))
        satellites = [int(table.satellite[plan.actions[p].opportunity]) for p in positions]
        image_down_s = float(down_s[positions[best]])
        is_down = not math.isnan(image_down_s)
        collected[target] = Collected(
            position=positions[best],
            satellite=satellites[best],
            worth=float(worth[positions[best]]),
            delivered_s=image_down_s if is_down else None,
            age_s=image_down_s - plan.actions[positions[best]].end_s if is_down else None,
        )
        for order, position in enumerate(positions):
            if order == best:
                continue
            why = "is collected already" if order > best else "has a better image later"
            duplicates.append(
                Violation(code="duplicate", satellite=satellites[order], needed=1.0, available=2.0,
                          at_s=plan.actions[position].start_s, blamed=(),
                          detail=f"Target {problem.target_ids[target]} {why}.")
            )  # fmt: skip
    return collected, duplicates


def _has_been_imaged(problem: Problem, plan: Plan, position: int) -> Violation:
    action, table = plan.actions[position], problem.opportunities
    target = problem.target_ids[int(table.place[action.opportunity])]
    return Violation(
        code="duplicate", satellite=int(table.satellite[action.opportunity]), needed=1.0,
        available=2.0, at_s=action.start_s, blamed=(),
        detail=f"Target {target} has an image from before the horizon.",
    )  # fmt: skip


def _delivered(
    problem: Problem,
    plan: Plan,
    by_satellite: Sequence[Sequence[int]],
    profiles: Sequence[Profile | None],
) -> Floats:
    """Return when the image of each action is on the ground; NaN for never, and for contacts."""
    found = np.full(len(plan.actions), np.nan)
    for satellite, positions, profile in zip(
        problem.satellites, by_satellite, profiles, strict=True
    ):
        if profile is not None and len(positions):
            own = [plan.actions[p] for p in positions]
            found[positions] = delivered_s(problem, satellite, own, profile)
    return found


def _worth(problem: Problem, plan: Plan, down_s: Floats) -> Floats:
    """Return what the image of each action earns by itself, 0 for contacts."""
    rows = np.array([action.opportunity for action in plan.actions], dtype=np.int64)
    if not problem.counts_delivery:
        return problem.worth[rows]
    end_s = np.array([action.end_s for action in plan.actions])
    age_s = np.where(np.isnan(down_s), np.inf, down_s - end_s)
    return problem.worth_on_ground[rows] * share_earned(problem.objective, age_s)


class _Images(NamedTuple):
    """What the image of each action earns in the plan and by itself, and when it is down."""

    earned: Mapping[int, float]
    worth: Floats
    delivered_s: Floats


def _satellite_timeline(
    problem: Problem,
    plan: Plan,
    positions: Sequence[int],
    slews: Mapping[int, Slew | None],
    images: _Images,
    profile: Profile | None,
) -> SatelliteTimeline:
    table = problem.opportunities
    actions: list[JudgedAction] = []
    for order, position in enumerate(positions):
        action = plan.actions[position]
        level = profile.after[order] if profile else None
        is_contact = table.kind[action.opportunity] == CONTACT
        down_s = float(images.delivered_s[position])
        actions.append(
            JudgedAction(
                mode="contact" if is_contact else "collect",
                start_s=action.start_s,
                end_s=action.end_s,
                opportunity=action.opportunity,
                position=position,
                slew=slews[position],
                reward=images.earned.get(position, 0.0),
                worth=None if is_contact else float(images.worth[position]),
                delivered_s=None if math.isnan(down_s) else down_s,
                battery_end=level.battery if level else None,
                recorder_end=level.recorder if level else None,
            )
        )
    if profile is None:
        return SatelliteTimeline(actions=tuple(actions), resources=None)
    time_s, battery, recorder = thin(profile.points)
    idle = [_idle_action(*pair) for pair in zip(profile.idle, profile.sun_end, strict=True)]
    # Of a task and what is idle at one instant, as of overlapping tasks, the earlier stands first.
    actions = list(heapq.merge(actions, idle, key=lambda action: action.start_s))
    return SatelliteTimeline(
        actions=tuple(actions),
        resources=Resourceline(time_s=time_s, battery=battery, recorder=recorder),
    )


def _idle_action(span: Idle, level: Point) -> JudgedAction:
    """Return a stay at the sun, or a wait where there is no time for one."""
    is_at_sun = span.is_at_sun
    return JudgedAction(
        mode="sunpoint" if is_at_sun else "hold",
        start_s=span.sun_from_s if is_at_sun else span.start_s,
        end_s=span.sun_until_s if is_at_sun else span.end_s,
        opportunity=None,
        position=None,
        slew=None,
        reward=0.0,
        battery_end=level.battery,
        recorder_end=level.recorder,
        turn_to_s=span.turn_to_s if is_at_sun else None,
        turn_back_s=span.turn_back_s if is_at_sun else None,
    )
