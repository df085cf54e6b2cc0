"""From the scenario of a plan to that of the plan which follows it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final

from planner_core.errors import Fault
from service.problems.faults import pointer_to, require_none
from service.scenarios.translate import scenario_from_file
from service.wire.base import fields_of
from service.wire.pins import OutageIn, PinnedActionIn, PinsIn, PlacedOutage, StateIn
from service.wire.plan_before import FlownIn, PromiseIn, ReplanOfFile
from service.wire.replans import ReplanIn
from service.wire.scenarios import FileSatellite, FileTarget, HorizonIn, ScenarioFile

_PIN: Final = re.compile(r"/pins/(keep|skip)/(\d+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Happened:
    """What a replan starts from, in addition to its body.

    Attributes
    ----------
    base
        The actions of the plan, without those that failed.
    freeze_until
        Actions that start before it stay.
    outages
        Stored outages that concern the scenario.
    targets
        Those of catalogues to be added, with the index of the catalogue in the body.
    begins
        When the new plan begins; None for the beginning of the parent plan.
    states
        Each satellite's newest state before that instant.
    flown
        The actions done before it.
    elements
        Satellites with their current orbits, by id.
    """

    base: Sequence[PinnedActionIn]
    freeze_until: datetime
    outages: Sequence[PlacedOutage]
    targets: Sequence[tuple[int, FileTarget]]
    begins: datetime | None = None
    states: Mapping[str, StateIn] = field(default_factory=dict)
    flown: Sequence[FlownIn] = ()
    elements: Mapping[str, FileSatellite] = field(default_factory=dict)


def replan_file(file: ScenarioFile, body: ReplanIn, happened: Happened) -> ScenarioFile:
    """Return the scenario file of a replan.

    Raises
    ------
    ServiceError
        422, with all faults and their locations in the body.
    """
    targets = [*file.targets, *(FileTarget(**dict(t)) for t in body.add_targets)]
    targets += [target for _, target in happened.targets]
    begins = happened.begins or file.horizon.start
    end = body.horizon_end or file.horizon.end
    flown = {
        action.target_id
        for action in happened.base
        if action.start is not None and action.start < happened.freeze_until
    }
    require_none(
        [
            *_faults_of_times(begins, end, happened.freeze_until),
            *_faults_of_added(file, body, happened),
            *_faults_of_dropped(file, body, flown),
            *_faults_of_unknown(body, {target.id for target in targets}),
        ]
    )
    known = {outage.id for outage in file.outages}
    said = [fields_of(outage, OutageIn) for outage in file.outages]
    outages = [
        *file.outages,
        *(one for one in happened.outages if one.id not in known),
        *(PlacedOutage(**dict(outage)) for outage in body.outages if dict(outage) not in said),
    ]
    return file.model_copy(
        update={
            "name": None,
            "horizon": HorizonIn(start=begins, end=end),
            "satellites": [_with_elements(one, happened.elements) for one in file.satellites],
            "states": _states(file, happened),
            "targets": [
                one.model_copy(update={"reward": body.rewards[one.id]})
                if one.id in body.rewards
                else one
                for one in targets
            ],
            "outages": outages,
            "objective": body.objective or file.objective,
            "pins": _pins(file.pins, body),
            "replan": ReplanOfFile(
                base=list(happened.base),
                freeze_until=happened.freeze_until,
                promises=_promises(file, body),
                stability=body.stability,
                elements=body.elements,
                flown=[*(file.replan.flown if file.replan else ()), *happened.flown],
                before=_older(file, happened),
            ),
        }
    )


def _with_elements(satellite: FileSatellite, newest: Mapping[str, FileSatellite]) -> FileSatellite:
    """Return a satellite with its current orbit."""
    now = newest.get(satellite.id or "")
    if now is None:
        return satellite
    return satellite.model_copy(update={"tle": now.tle, "omm": now.omm, "oem": now.oem})


def _states(file: ScenarioFile, happened: Happened) -> list[StateIn]:
    """Return each satellite's initial state: from telemetry, or as in the parent plan."""
    if happened.begins is None:
        return list(file.states)
    began = {state.satellite_id: state for state in _began(file)}
    return list((began | dict(happened.states)).values())


def _began(file: ScenarioFile) -> list[StateIn]:
    """Return each satellite's initial state in a scenario, with default levels filled in."""
    known = {state.satellite_id: state for state in file.states}
    found = []
    for satellite in scenario_from_file(file).satellites:
        r = satellite.resources
        state = known.get(satellite.id)
        if state is None:
            state = StateIn(satellite_id=satellite.id, at=file.horizon.start)
        levels = {"battery_fraction": r.initial_battery_fraction}
        if state.on_board is None:  # otherwise the list gives the amount
            levels["recorder_fraction"] = r.initial_recorder_fraction
        missing = {name: own for name, own in levels.items() if getattr(state, name) is None}
        found.append(state.model_copy(update=missing))
    return found


def _older(file: ScenarioFile, happened: Happened) -> list[StateIn]:
    """Return the states since which data on board is known, if newer states do not list it."""
    if happened.begins is None:
        return [] if file.replan is None else file.replan.before
    older = {} if file.replan is None else {s.satellite_id: s for s in file.replan.before}
    return [
        older.get(began.satellite_id, began) if began.on_board is None else began
        for began in _began(file)
        if began.satellite_id in happened.states or began.satellite_id in older
    ]


def _pins(before: PinsIn, body: ReplanIn) -> PinsIn:
    """Return both sets of pins, those of the body first, so that faults are found in it."""
    keep = [pin for pin in before.keep if pin not in body.keep and pin not in body.skip]
    skip = [pin for pin in before.skip if pin not in body.keep and pin not in body.skip]
    forbid = dict.fromkeys((*before.forbid, *body.drop_targets))
    return before.model_copy(
        update={
            "keep": [*body.keep, *keep],
            "skip": [*body.skip, *skip],
            "forbid": list(forbid),
        }
    )


def place_in(body: ReplanIn, fault: Fault) -> str | None:
    """Return the location of a pin's fault in the body, if it is one of the body's pins."""
    pin = _PIN.match(fault.pointer or "")
    if pin is None or int(pin[2]) >= len(getattr(body, pin[1])):
        return fault.pointer
    return f"/{pin[1]}/{pin[2]}{pin.string[pin.end() :]}"


def _promises(file: ScenarioFile, body: ReplanIn) -> list[PromiseIn]:
    """Return the body's promises, and earlier promises for other targets."""
    before = [] if file.replan is None else file.replan.promises
    gone = {promise.target_id for promise in body.promises} | set(body.drop_targets)
    return [*body.promises, *(one for one in before if one.target_id not in gone)]


def _faults_of_times(begins: datetime, end: datetime, freeze_until: datetime) -> list[Fault]:
    if freeze_until < end and begins < end:
        return []
    detail = "Nothing is left to plan: the horizon ends before freeze_until."
    return [Fault(code="value_out_of_range", detail=detail, pointer="/horizon_end")]


def _faults_of_added(file: ScenarioFile, body: ReplanIn, happened: Happened) -> list[Fault]:
    seen = {target.id for target in file.targets}
    added = [(f"/add_targets/{i}/id", target.id) for i, target in enumerate(body.add_targets)]
    added += [(f"/add_target_catalog_ids/{i}", target.id) for i, target in happened.targets]
    faults = []
    for pointer, own_id in added:
        if own_id in seen:
            detail = f"The plan's scenario has a target {own_id!r} already."
            faults.append(Fault(code="duplicate_target_id", detail=detail, pointer=pointer))
        seen.add(own_id)
    return faults


def _faults_of_dropped(
    file: ScenarioFile, body: ReplanIn, flown: Collection[str | None]
) -> list[Fault]:
    known, promised = ({t.id for t in file.targets}, {p.target_id for p in body.promises})
    faults = []
    for i, own_id in enumerate(body.drop_targets):
        pointer = f"/drop_targets/{i}"
        if own_id not in known:
            detail = f"The plan's scenario has no target {own_id!r}."
            faults.append(Fault(code="unknown_target", detail=detail, pointer=pointer))
        elif own_id in flown:
            detail = f"Target {own_id!r} is imaged before freeze_until: it cannot be dropped."
            faults.append(Fault(code="invalid_value", detail=detail, pointer=pointer))
        elif own_id in promised:
            detail = f"Target {own_id!r} is promised in the same request."
            faults.append(Fault(code="invalid_value", detail=detail, pointer=pointer))
    return faults


def _faults_of_unknown(body: ReplanIn, known: Collection[str]) -> list[Fault]:
    """Return faults for promises and rewards of unknown targets."""
    named = [
        (pointer_to("promises", i, "target_id"), promise.target_id)
        for i, promise in enumerate(body.promises)
    ]
    named += [(pointer_to("rewards", target_id), target_id) for target_id in body.rewards]
    return [
        Fault(code="unknown_target", detail=f"There is no target {own_id!r}.", pointer=pointer)
        for pointer, own_id in named
        if own_id not in known
    ]
