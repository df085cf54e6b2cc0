"""Pinned actions, as clients write them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Body, Id, Instant, Open

PinnedMode = Literal["collect", "contact"]


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
    modes: list[Open[PinnedMode]] = Field(["collect", "contact"], min_length=1, max_length=2)


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
