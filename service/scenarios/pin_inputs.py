"""Pins, outages and states, from request bodies to the core, which makes the last checks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any, TypeVar

from planner_core.domain import Attitude, Flown, OnBoard, Outage, Promise, Replan, Stability, State
from planner_core.errors import InvalidScenario
from planner_core.pins import BlockedInterval, PinnedAction, Pins
from service.wire.base import fields_of
from service.wire.pins import AttitudeIn, BlockedIn, OutageIn, PinnedActionIn, PinsIn, StateIn
from service.wire.plan_before import ReplanOfFile
from service.wire.scenarios import FileGroundStation, FileSatellite, ScenarioFile

P = TypeVar("P", PinnedActionIn, BlockedIn)


def pins_from(body: PinsIn) -> Pins:
    """Return the pins of one body."""
    return Pins(
        keep=tuple(action_from(pinned) for pinned in body.keep),
        skip=tuple(action_from(pinned) for pinned in body.skip),
        block=tuple(BlockedInterval(**dict(one) | _modes(one)) for one in body.block),
        forbid=tuple(body.forbid),
    )


def outage_from(body: OutageIn) -> Outage:
    """Return the outage of one body."""
    return Outage(**fields_of(body, OutageIn) | _modes(body))


def _modes(body: BlockedIn | OutageIn) -> dict[str, Any]:
    """Return the modes of one body, each once."""
    return {"modes": tuple(dict.fromkeys(body.modes))}


def state_from(body: StateIn) -> State:
    """Return the state of one body."""
    attitude, images = body.attitude, body.on_board
    parts = {
        "attitude": None if attitude is None else attitude_from(attitude),
        "on_board": None if images is None else tuple(OnBoard(**dict(one)) for one in images),
    }
    return State(**dict(body) | parts)


def attitude_from(body: AttitudeIn) -> Attitude:
    """Return the attitude of one body."""
    look = body.line_of_sight
    return Attitude(
        opportunity_id=body.opportunity_id,
        target_id=body.target_id,
        station_id=body.station_id,
        line_of_sight=None if look is None else (look[0], look[1], look[2]),
        at_sun=bool(body.sun),
    )


def replan_from(body: ReplanOfFile) -> Replan:
    """Return the plan to go on from; errors point into ``/replan``."""
    return Replan(
        base=tuple(action_from(action) for action in body.base),
        freeze_until=body.freeze_until,
        promises=tuple(Promise(**dict(promise)) for promise in body.promises),
        stability=Stability(**body.stability.model_dump()),
        elements=body.elements,
        flown=tuple(Flown(**dict(flown)) for flown in body.flown),
        before=tuple(state_from(state) for state in body.before),
    )


def with_settled_pins(file: ScenarioFile) -> ScenarioFile:
    """Return the file with ids in place of the names of satellites and stations in its pins.

    Not part of the checks of a scenario: those of earlier releases keep their names.

    Raises
    ------
    InvalidScenario
        ``ambiguous_name`` if several have the name, ``duplicate_pin`` if one pin is
        written twice.
    """
    ids = {
        "satellite_id": _ids_by_name(file.satellites),
        "station_id": _ids_by_name(file.ground_stations),
    }
    pins = file.pins.model_copy(
        update={
            kind: [
                _with_ids(pin, ids, f"/pins/{kind}/{position}")
                for position, pin in enumerate(getattr(file.pins, kind))
            ]
            for kind in ("keep", "skip", "block")
        }
    )
    _refuse_duplicates(pins)
    return file.model_copy(update={"pins": pins})


def _ids_by_name(things: Iterable[FileSatellite | FileGroundStation]) -> Mapping[str, list[str]]:
    """Return the ids that each name may mean; an id means itself."""
    found: dict[str, list[str]] = {}
    for thing in things:
        found.setdefault(thing.name, []).append(thing.id or thing.name)
    return found | {thing.id: [thing.id] for thing in things if thing.id is not None}


def _with_ids(pin: P, ids: Mapping[str, Mapping[str, list[str]]], pointer: str) -> P:
    named = {}
    for field, ids_by_name in ids.items():
        name: str | None = getattr(pin, field, None)
        if name is None:
            continue
        meant = ids_by_name.get(name, [name])
        if len(meant) > 1:
            raise InvalidScenario(
                "ambiguous_name",
                f"{len(meant)} have the name {name!r}: give an id, such as {meant[0]!r}.",
                pointer=f"{pointer}/{field}",
            )
        if meant != [name]:
            named[field] = meant[0]
    return pin.model_copy(update=named)


def _refuse_duplicates(body: PinsIn) -> None:
    for kind in PinsIn.model_fields:
        seen = set()
        for position, pin in enumerate(getattr(body, kind)):
            text = pin if isinstance(pin, str) else pin.model_dump_json()
            if text in seen:
                pointer = f"/pins/{kind}/{position}"
                raise InvalidScenario("duplicate_pin", "It is listed already.", pointer=pointer)
            seen.add(text)


def pins_in(pins: Pins) -> PinsIn:
    """Return the body of pins, the inverse of `pins_from`."""
    return PinsIn(
        keep=[PinnedActionIn(**asdict(pinned)) for pinned in pins.keep],
        skip=[PinnedActionIn(**asdict(pinned)) for pinned in pins.skip],
        block=[BlockedIn(**asdict(one) | {"modes": list(one.modes)}) for one in pins.block],
        forbid=list(pins.forbid),
    )


def action_from(body: PinnedActionIn) -> PinnedAction:
    """Return the action of one body."""
    return PinnedAction(**dict(body))


def pinned_action(body: str | PinnedActionIn) -> PinnedAction:
    """Return the action that is meant; a mere id means that target, at any time."""
    return PinnedAction(target_id=body) if isinstance(body, str) else action_from(body)
