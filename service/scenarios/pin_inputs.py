"""What clients send to pin actions; `planner_core.pins` has the last word."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StringConstraints

from planner_core.pins import (
    BlockedInterval,
    PinnedAction,
    PinnedMode,
    Pins,
)
from service.api.shapes import Body, Instant

Id = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]


class PinnedActionIn(Body):
    """An action in words: a booked contact, a promised image."""

    satellite_id: Id | None = Field(None, description="Any satellite by default.")
    target_id: Id | None = Field(None, description="Of the image.")
    station_id: Id | None = Field(None, description="Of the contact.")
    start: Instant | None = Field(
        None,
        description="Of the opportunities that start and end touch, the one that starts nearest "
        "to start is meant. Needed where there are several.",
    )
    end: Instant | None = Field(None, description="start by default.")
    opportunity_id: Id | None = Field(
        None, description="The opportunity itself, as the scenario lists it, in place of the rest."
    )


class BlockedIn(Body):
    """A span in which a satellite may not image, not contact, or neither."""

    satellite_id: Id
    start: Instant
    end: Instant
    modes: list[PinnedMode] = Field(["collect", "contact"], min_length=1, max_length=2)


class PinsIn(Body):
    """What plans must hold, and what they must not."""

    keep: list[PinnedActionIn] = Field(
        [], max_length=10_000, description="Actions that every plan must hold."
    )
    skip: list[PinnedActionIn] = Field(
        [], max_length=10_000, description="Single actions that no plan may hold."
    )
    block: list[BlockedIn] = Field([], max_length=10_000)
    forbid: list[Id] = Field(
        [], max_length=10_000, description="Ids of targets that no plan may collect."
    )


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
