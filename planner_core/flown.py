"""Carry the state of a satellite to the start of the horizon by the actions flown in between.

Energy is computed by the referee, over the actions that were done. Data is a queue, first in,
first out: images and telemetry enter at its end, contacts remove from its beginning. Amounts
reported in megabits replace the planned ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Final

import numpy as np

from planner_core.access.given import Given, table_of
from planner_core.domain import Flown, Horizon, Scenario, State
from planner_core.idling import Start
from planner_core.pins import PinnedAction, Pins
from planner_core.problem import COLLECT, CONTACT, Heading, ImageOnBoard, Problem
from planner_core.problem.plan import Action, Plan
from planner_core.problem.sun_turns import sun_turn_s
from planner_core.referee.contact_flow import flow
from planner_core.referee.resource_profile import integrate

_MARGIN: Final = timedelta(minutes=1)  # of orbit around an instant
_NOTHING: Final = 1e-12  # of a recorder
_NO_TARGET: Final = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """What one satellite did before the horizon, and what it does next if that is frozen.

    Attributes
    ----------
    index
        Index of the satellite in the scenario.
    state
        The state that the past begins with.
    before
        An older state, if ``state`` does not list what is on board.
    flown
        Actions in order of start; those that end before the state only tell where it looked.
    following
        The satellite's first action after the horizon's start, if that is frozen.
    """

    scenario: Scenario
    index: int
    state: State
    before: State | None
    flown: tuple[Flown, ...]
    following: Flown | None

    @property
    def done(self) -> list[Flown]:
        """The actions that drew energy after the state."""
        return [f for f in self.flown if f.outcome != "skipped" and f.end > self.state.at]

    @property
    def last(self) -> Flown | None:
        """The last action that was done before the horizon."""
        start = self.scenario.horizon.start
        done = [f for f in self.flown if f.outcome != "skipped" and f.start < start]
        return max(done, key=lambda f: f.end, default=None)

    @property
    def of_data(self) -> Past:
        """The same past, but from the older state on if there is one."""
        return self if self.before is None else replace(self, state=self.before, before=None)

    def part(self) -> Scenario:
        """Return the scenario of the span from the state to the horizon."""
        end = self.scenario.horizon.start
        if self.following is not None:
            end = max(end, self.following.end)
        return replace(
            self.scenario,
            horizon=Horizon(start=self.state.at, end=max(end, self.state.at + _MARGIN)),
            satellites=(self.scenario.satellites[self.index],),
            states=(replace(self.state, attitude=None, on_board=None),),
            dynamics="physical",
            continuous_starts=False,
            forecast=None,
            pins=Pins(),
            outages=(),
            replan=None,
        )

    def given(self, part: Scenario) -> list[Given]:
        """Return what was done and the following action as tasks of ``part``."""
        tasks = [*self.done, *([] if self.following is None else [self.following])]
        return [given_of(part, 0, task) for task in tasks]


def given_of(scenario: Scenario, index: int, task: Flown) -> Given:
    """Return an action as a task within a scenario's horizon."""
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    stations = {station.id: i for i, station in enumerate(scenario.ground_stations)}
    is_image = task.target_id is not None
    site = targets[task.target_id or ""] if is_image else stations[task.station_id or ""]
    horizon = scenario.horizon
    start_s = max(0.0, horizon.offset_s(task.start))
    end_s = min(horizon.duration_s, horizon.offset_s(task.end))
    return Given(index, COLLECT if is_image else CONTACT, site, start_s, end_s)


def pasts_of(scenario: Scenario) -> dict[int, Past]:
    """Return the pasts of satellites that flew anything before the horizon, by index."""
    if scenario.replan is None or not scenario.replan.flown:
        return {}
    states = {state.satellite_id: state for state in scenario.states}
    before = {state.satellite_id: state for state in scenario.replan.before}
    found = {}
    for index, satellite in enumerate(scenario.satellites):
        own = [f for f in scenario.replan.flown if f.satellite_id == satellite.id]
        if own:
            own.sort(key=lambda f: (f.start, f.end))
            begin = min(own[0].start, scenario.horizon.start)
            state = states.get(satellite.id, State(satellite_id=satellite.id, at=begin))
            older = before.get(satellite.id)
            if state.on_board is not None or (older is not None and older.at >= state.at):
                older = None
            found[index] = Past(
                scenario=scenario, index=index, state=state, before=older, flown=tuple(own),
                following=_following(scenario, satellite.id),
            )  # fmt: skip
    return found


def _following(scenario: Scenario, satellite_id: str) -> Flown | None:
    """Return the satellite's first frozen action that begins within the horizon."""
    replan, start = scenario.replan, scenario.horizon.start
    assert replan is not None
    frozen = [
        action
        for action in replan.base
        if action.satellite_id == satellite_id
        and action.start is not None
        and action.end is not None
        and start <= action.start < replan.freeze_until
    ]
    return flown_as(min(frozen, key=lambda one: one.start or start)) if frozen else None


def flown_as(action: PinnedAction) -> Flown:
    """Return an action with satellite, start and end as if it were flown."""
    assert action.satellite_id is not None
    assert action.start is not None
    assert action.end is not None
    return Flown(
        satellite_id=action.satellite_id, target_id=action.target_id, station_id=action.station_id,
        start=action.start, end=action.end,
    )  # fmt: skip


def carried(past: Past, part: Problem, of_data: Problem, given_start: Start) -> Start:
    """Return what a satellite begins the horizon with.

    Parameters
    ----------
    part
        The problem of ``past.part()``, whose opportunities are the actions done, in order.
    of_data
        The same for ``past.of_data``.
    given_start
        What the satellite would begin with if it had only idled since its state.
    """
    scenario, horizon = past.scenario, past.scenario.horizon
    satellite = part.satellites[0]
    resources = scenario.satellites[past.index].resources
    images = _queue(past, of_data)
    heading, sun_from_s = given_start.heading, given_start.sun_from_s
    last = past.last
    if last is not None and (last.end > past.state.at or past.state.attitude is None):
        heading, sun_from_s = _heading_after(past, part, last)
    if not scenario.use_resources:
        done = tuple(replace(image, amount=0.0) for image in images if image.target >= 0)
        return Start(resources=resources, heading=heading, images=done)
    plan = Plan.of(part, range(len(part.opportunities)))
    curve = integrate(part, satellite, plan).curve
    at_s = (horizon.start - past.state.at).total_seconds()
    battery = np.interp(at_s, curve.time_s, curve.battery)
    held = sum(image.amount for image in images)
    return Start(
        resources=replace(
            resources,
            initial_battery_fraction=float(battery),
            initial_recorder_fraction=min(1.0, float(held)),
        ),
        heading=heading,
        sun_from_s=sun_from_s,
        images=images,
    )


def _heading_after(past: Past, part: Problem, last: Flown) -> tuple[Heading | None, float]:
    """Return where the satellite looks after an action, and when it can be at the sun."""
    scenario, horizon = past.scenario, past.scenario.horizon
    satellite = scenario.satellites[past.index]
    free_from_s = horizon.offset_s(last.end)
    if free_from_s > 0.0:
        return None, 0.0  # the action still goes on, and is kept
    around = replace(
        past.part(), horizon=Horizon(start=last.start, end=last.end + _MARGIN), states=()
    )
    row = table_of(around, [given_of(around, 0, last)])
    x, y, z = row.los_end[0].tolist()
    rate_x, rate_y, rate_z = row.los_rate_end[0].astype(np.float64).tolist()
    look, moving = (x, y, z), (rate_x, rate_y, rate_z)
    heading = Heading(free_from_s=free_from_s, line_of_sight=look, moving_deg_s=moving)
    if not scenario.use_resources:
        return heading, 0.0
    turn_s = sun_turn_s(
        satellite.resources, satellite.agility, part.satellites[0].sun, look,
        (last.end - past.state.at).total_seconds(), moving,
    )  # fmt: skip
    at_sun_s = free_from_s + turn_s
    if satellite.resources.sun_pointing == "free" or at_sun_s > 0.0:
        return heading, max(0.0, at_sun_s)
    leaves_s = 0.0
    if past.following is not None:
        back_s = float(part.satellites[0].turns.back_s[-1])
        leaves_s = horizon.offset_s(past.following.start) - back_s
    if leaves_s < at_sun_s:
        return heading, 0.0  # no time for a visit
    # It may already be on its way to the next action; nothing else can begin before that one.
    return Heading(free_from_s=at_sun_s if leaves_s < 0.0 else 0.0), 0.0


class _Recorder:
    """A recorder's queue: amounts, each with its image or without one."""

    def __init__(self, satellite: int) -> None:
        self.satellite = satellite
        self.items: list[ImageOnBoard] = []

    def put(self, image: ImageOnBoard) -> None:
        if image.target != _NO_TARGET or image.amount > _NOTHING:
            self.items.append(image)

    def take(self, amount: float) -> None:
        for i, item in enumerate(self.items):
            if amount <= _NOTHING:
                break
            gone = min(amount, item.amount)
            left = item.amount - gone
            self.items[i] = replace(item, amount=0.0 if left <= _NOTHING else left)
            amount -= gone

    def correct(self, level: float) -> None:
        """Remove what was downlinked without a report, or add data that was not reported."""
        missing = level - sum(item.amount for item in self.items)
        if missing < 0.0:
            self.take(-missing)
        else:
            self.put(_image(self.satellite, _NO_TARGET, missing, 0.0, 0.0))

    def held(self) -> tuple[ImageOnBoard, ...]:
        return tuple(i for i in self.items if i.target != _NO_TARGET or i.amount > 0.0)


def _queue(past: Past, part: Problem) -> tuple[ImageOnBoard, ...]:
    """Return what the recorder holds when the horizon begins; images on the ground have 0.

    ``part`` is the problem of ``past.of_data``.
    """
    told, past = past.state, past.of_data
    resources = past.scenario.satellites[past.index].resources
    until = past.scenario.horizon.start
    level = told.recorder(resources.recorder_capacity_mbit)
    recorder = _recorder_at(past)
    now, is_corrected = past.state.at, told is past.state or level is None

    def wait(instant: datetime) -> None:
        nonlocal now
        amount = resources.telemetry_per_s * (instant - now).total_seconds()
        recorder.put(_image(past.index, _NO_TARGET, amount, 0.0, 0.0))
        now = instant

    for row, flown in enumerate(past.done):
        end = min(flown.end, until)
        if flown.start >= until:
            continue
        if not is_corrected and end > told.at:
            wait(told.at)
            recorder.correct(level or 0.0)
            is_corrected = True
        wait(end)
        _record(past, part, row, flown, recorder)
    if not is_corrected:
        wait(told.at)
        recorder.correct(level or 0.0)
    wait(until)
    return _without_overflow(recorder.held())


def _recorder_at(past: Past) -> _Recorder:
    """Return the recorder at the state: first the listed images, then what else it holds."""
    scenario, state, index = past.scenario, past.state, past.index
    resources = scenario.satellites[index].resources
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    recorder = _Recorder(index)
    for listed in state.on_board or ():
        target = targets[listed.target_id]
        worth = scenario.targets[target].reward if listed.worth is None else listed.worth
        amount = listed.amount(resources.recorder_capacity_mbit)
        collected_s = scenario.horizon.offset_s(listed.collected_at)
        recorder.put(_image(index, target, amount, collected_s, worth))
    listed_targets = {image.target for image in recorder.items}
    for flown in past.flown if state.on_board is not None else ():
        # Images that the state no longer lists are on the ground.
        if flown.is_imaged and flown.end <= state.at:
            target = targets[flown.target_id or ""]
            if target not in listed_targets:
                collected_s = scenario.horizon.offset_s(flown.end)
                recorder.put(_image(index, target, 0.0, collected_s, 0.0))
    held = state.recorder(resources.recorder_capacity_mbit)
    if held is None:
        held = resources.initial_recorder_fraction
    rest = held - sum(item.amount for item in recorder.items)
    recorder.put(_image(index, _NO_TARGET, rest, 0.0, 0.0))
    return recorder


def _record(past: Past, part: Problem, row: int, flown: Flown, recorder: _Recorder) -> None:
    """Add to a recorder what an action writes, or remove what it takes down."""
    scenario, amount = past.scenario, _amount(past, part, row, flown)
    if flown.target_id is None:
        recorder.take(amount)
        return
    if not flown.is_imaged or flown.end > scenario.horizon.start:
        recorder.put(_image(past.index, _NO_TARGET, amount, 0.0, 0.0))
        return
    target = next(i for i, t in enumerate(scenario.targets) if t.id == flown.target_id)
    worth, collected_s = float(part.worth_on_ground[row]), scenario.horizon.offset_s(flown.end)
    recorder.put(_image(past.index, target, amount, collected_s, worth))


def _image(
    satellite: int, target: int, amount: float, collected_s: float, worth: float
) -> ImageOnBoard:
    return ImageOnBoard(
        satellite=satellite, target=target, amount=amount, collected_s=collected_s, worth=worth
    )


def _without_overflow(images: Sequence[ImageOnBoard]) -> tuple[ImageOnBoard, ...]:
    """Return the images as far as they fit: a full recorder accepts no more data."""
    found, room = [], 1.0
    for image in images:
        amount = min(image.amount, room)
        room -= amount
        found.append(replace(image, amount=amount))
    return tuple(found)


def _amount(past: Past, part: Problem, row: int, flown: Flown) -> float:
    """Return how much an action recorded or took down between the state and the horizon."""
    resources = past.scenario.satellites[past.index].resources
    whole_s = (flown.end - flown.start).total_seconds()
    begin, end = max(flown.start, past.state.at), min(flown.end, past.scenario.horizon.start)
    share = (end - begin).total_seconds() / whole_s
    if flown.mbit is not None and resources.recorder_capacity_mbit is not None:
        return share * flown.mbit / resources.recorder_capacity_mbit
    if flown.outcome == "failed" or not past.scenario.use_resources:
        return 0.0
    if flown.target_id is not None:
        return resources.collect_fill_per_s * share * whole_s
    return _taken_down(part, row, *(_since(past, t) for t in (flown.start, begin, end)))


def _since(past: Past, instant: datetime) -> float:
    return (instant - past.state.at).total_seconds()


def _taken_down(part: Problem, row: int, start_s: float, begin_s: float, end_s: float) -> float:
    """Return what a contact takes down from ``begin_s`` on; its set-up begins at ``start_s``."""
    pieces = flow(part, part.satellites[0], Action(start_s, end_s, row))
    from_s, to_s, per_s = pieces.T
    return float(np.sum(np.maximum(to_s - np.maximum(from_s, begin_s), 0.0) * per_s))
