"""Pins and outages, from what clients send to the core's and back; the core has the last word."""

from __future__ import annotations

from planner_core.domain import Outage, Promise, Replan, Stability
from planner_core.errors import InvalidScenario
from planner_core.pins import BlockedInterval, PinnedAction, Pins
from service.wire.pins import BlockedIn, OutageIn, PinnedActionIn, PinsIn
from service.wire.plan_before import ReplanOfFile


def pins_from(body: PinsIn) -> Pins:
    """Return the pins of one body."""
    return Pins(
        keep=tuple(action_from(pinned) for pinned in body.keep),
        skip=tuple(action_from(pinned) for pinned in body.skip),
        block=tuple(
            BlockedInterval(
                satellite_id=blocked.satellite_id,
                start=blocked.start,
                end=blocked.end,
                modes=tuple(dict.fromkeys(blocked.modes)),
            )
            for blocked in body.block
        ),
        forbid=tuple(body.forbid),
    )


def outage_from(body: OutageIn) -> Outage:
    """Return the outage of one body."""
    return Outage(
        satellite_id=body.satellite_id,
        station_id=body.station_id,
        start=body.start,
        end=body.end,
        modes=tuple(dict.fromkeys(body.modes)),
        reason=body.reason,
    )


def replan_from(body: ReplanOfFile) -> Replan:
    """Return the plan to go on from; what cannot be points into ``/replan``."""
    return Replan(
        base=tuple(action_from(action) for action in body.base),
        freeze_until=body.freeze_until,
        promises=tuple(
            Promise(target_id=promise.target_id, image_by=promise.image_by)
            for promise in body.promises
        ),
        stability=Stability(**body.stability.model_dump()),
    )


def refuse_duplicate_pins(body: PinsIn) -> None:
    """Raise ``duplicate_pin`` where one is written twice.

    Not part of what a scenario is checked for: those of earlier releases keep theirs.
    """
    for kind in PinsIn.model_fields:
        seen = set()
        for position, pin in enumerate(getattr(body, kind)):
            text = pin if isinstance(pin, str) else pin.model_dump_json()
            if text in seen:
                pointer = f"/pins/{kind}/{position}"
                raise InvalidScenario("duplicate_pin", "It is listed before.", pointer=pointer)
            seen.add(text)


def pins_in(pins: Pins) -> PinsIn:
    """Return the body of pins: what `pins_from` has made them of."""
    return PinsIn(
        keep=[_action_in(pinned) for pinned in pins.keep],
        skip=[_action_in(pinned) for pinned in pins.skip],
        block=[
            BlockedIn(
                satellite_id=blocked.satellite_id,
                start=blocked.start,
                end=blocked.end,
                modes=list(blocked.modes),
            )
            for blocked in pins.block
        ],
        forbid=list(pins.forbid),
    )


def action_from(body: PinnedActionIn) -> PinnedAction:
    """Return the action of one body."""
    return PinnedAction(**{name: getattr(body, name) for name in PinnedActionIn.model_fields})


def _action_in(pinned: PinnedAction) -> PinnedActionIn:
    return PinnedActionIn(**{name: getattr(pinned, name) for name in PinnedActionIn.model_fields})


def pinned_action(body: str | PinnedActionIn) -> PinnedAction:
    """Return the action that is meant; an id alone is that of a target, at any time."""
    return PinnedAction(target_id=body) if isinstance(body, str) else action_from(body)
