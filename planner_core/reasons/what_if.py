"""A scenario with one change: targets or contacts forced or forbidden, limits relaxed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from typing import Any

import numpy as np

from planner_core.domain import Satellite, Scenario
from planner_core.errors import InvalidScenario, inside
from planner_core.pins import PinnedAction, Pins
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.reasons.as_flown import as_flown
from planner_core.reasons.displacing import displace_each
from planner_core.reasons.explain import earned_by
from planner_core.reasons.forcing import PlannedSatellite, force_each
from planner_core.referee.replay import replay

Settings = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Relaxation:
    """Other values of settings, whether tighter or looser.

    Attributes
    ----------
    satellites
        By satellite id, fields of its agility, its sensor and its resources.
    targets
        By target id, fields of the target.
    horizon_end
        The new end of the horizon.
    """

    satellites: Mapping[str, Settings] = field(default_factory=dict)
    targets: Mapping[str, Settings] = field(default_factory=dict)
    horizon_end: datetime | None = None

    def __bool__(self) -> bool:
        return bool(self.satellites or self.targets or self.horizon_end)


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """The changes to a scenario.

    Attributes
    ----------
    force, forbid
        Actions that the plan must, or must not, hold. A target without a time means any image.
    """

    force: tuple[PinnedAction, ...] = ()
    forbid: tuple[PinnedAction, ...] = ()
    relax: Relaxation = Relaxation()


def relaxed(scenario: Scenario, relax: Relaxation) -> Scenario:
    """Return the scenario with other settings.

    Raises
    ------
    InvalidScenario
        A name is unknown, or a value is out of range; with a pointer into ``/relax``.
    """
    satellites = {satellite.id: satellite for satellite in scenario.satellites}
    targets = {target.id: target for target in scenario.targets}
    for own_id, settings in relax.satellites.items():
        at = f"/relax/satellites/{own_id}"
        if own_id not in satellites:
            raise _unknown("satellite", own_id, at)
        satellites[own_id] = _set_satellite(satellites[own_id], settings, at)
    for own_id, settings in relax.targets.items():
        at = f"/relax/targets/{own_id}"
        if own_id not in targets:
            raise _unknown("target", own_id, at)
        targets[own_id] = _set(targets[own_id], settings, at)
    horizon = scenario.horizon
    if relax.horizon_end is not None:
        horizon = _set(horizon, {"end": relax.horizon_end}, "/relax/horizon_end")
    return replace(
        scenario,
        horizon=horizon,
        satellites=tuple(satellites[s.id] for s in scenario.satellites),
        targets=tuple(targets[t.id] for t in scenario.targets),
    )


def _unknown(what: str, own_id: str, pointer: str) -> InvalidScenario:
    return InvalidScenario(
        f"unknown_{what}", f"The scenario has no {what} {own_id!r}.", pointer=pointer
    )


def _set_satellite(satellite: Satellite, settings: Settings, pointer: str) -> Satellite:
    parts: dict[str, Any] = {}
    for name in ("agility", "sensor", "resources"):
        part = getattr(satellite, name)
        own = {f.name: settings[f.name] for f in fields(part) if f.name in settings}
        parts[name] = _set(part, own, pointer)
    known = {f.name for part in parts.values() for f in fields(part)}
    _check_names(settings, known, pointer)
    return replace(satellite, **parts)


def _set(part: Any, settings: Settings, pointer: str) -> Any:
    _check_names(settings, {f.name for f in fields(part)} - {"id"}, pointer)
    with inside(pointer):
        return replace(part, **settings)


def _check_names(settings: Settings, known: set[str], pointer: str) -> None:
    for name in settings:
        if name not in known:
            raise InvalidScenario(
                "unknown_field", f"There is no setting {name!r}.", pointer=f"{pointer}/{name}"
            )


def what_if(scenario: Scenario, change: Change, problem: Problem, plan: Plan) -> Scenario:
    """Return the scenario with a change: further pins, or other settings.

    A target is forced by pinning one image of it: the one that the plan already holds or else,
    by trial, the one that costs least reward when forced into the plan. The best plan with
    another image may earn more; to force that image, name its time.

    Parameters
    ----------
    problem, plan
        The problem compiled from ``relaxed(scenario, change.relax)``, and a plan of it. If
        nothing is relaxed, that is the current plan.

    Raises
    ------
    InvalidScenario
        The change is invalid; with a pointer into it.
    """
    changed = relaxed(scenario, change.relax)
    pins = scenario.pins
    keep = [
        _with_time(changed, problem, plan, action, f"/force/{i}")
        for i, action in enumerate(change.force)
    ]
    whole = [a.target_id for a in change.forbid if is_any_image(a) and a.target_id is not None]
    skip = [action for action in change.forbid if not is_any_image(action)]
    new = Pins(
        keep=(*pins.keep, *keep),
        skip=(*pins.skip, *skip),
        block=pins.block,
        forbid=tuple(dict.fromkeys((*pins.forbid, *whole))),
    )
    return replace(changed, pins=new)


def is_any_image(action: PinnedAction) -> bool:
    """Return whether any image of a target is meant, at whatever time."""
    return action.target_id is not None and action.start is None and action.opportunity_id is None


def _with_time(
    scenario: Scenario, problem: Problem, plan: Plan, action: PinnedAction, pointer: str
) -> PinnedAction:
    """Return the action, with a time if it means any image of a target."""
    if not is_any_image(action):
        return action
    if action.target_id not in problem.target_ids:
        raise _unknown("target", str(action.target_id), pointer)
    target = problem.target_ids.index(action.target_id)
    if problem.pointing is not None:
        made, plan = as_flown(problem, plan, np.array([target]))
        problem = made.problem
    row = _cheapest(problem, plan, action)
    if row is None:
        raise InvalidScenario(
            "pin_without_opportunity",
            f"Target {action.target_id!r} has no opportunity that could be forced.",
            pointer=pointer,
        )
    table = problem.opportunities
    return replace(
        action,
        satellite_id=problem.satellites[int(table.satellite[row])].id,
        start=scenario.horizon.instant(float(table.start_s[row])),
    )


def _cheapest(problem: Problem, plan: Plan, action: PinnedAction) -> int | None:
    """Return the image of a target that costs the plan least reward, the earliest of equals."""
    target = problem.target_ids.index(str(action.target_id))
    timeline = replay(problem, plan, in_detail=False)
    held = timeline.collected.get(target)
    table = problem.opportunities
    best: tuple[bool, float, int] | None = None
    earned = earned_by(problem, plan, timeline)
    for index, satellite in enumerate(problem.satellites):
        if action.satellite_id not in (None, satellite.id):
            continue
        rows = problem.collects_of(target)
        rows = rows[table.satellite[rows] == index]
        if held is not None and held.satellite == index:
            return plan.actions[held.position].opportunity
        if len(rows) == 0:
            continue
        planned = PlannedSatellite.of(problem, plan, index, earned)
        local = problem.local_row[rows]
        displaced = displace_each(planned, local, force_each(problem, planned, local))
        loss = displaced.dropped @ planned.sequence.earned - problem.worth[rows]
        for c in np.argsort(rows):
            offer = (not displaced.is_settled[c], float(loss[c]), int(rows[c]))
            best = offer if best is None or offer < best else best
    return None if best is None else best[2]
