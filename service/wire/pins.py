"""Pinned actions and outages, as clients write them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Body, Id, Instant, Open, Reason, Wire

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


class OutageIn(Body):
    """A span in which a satellite or a ground station is not to be had."""

    satellite_id: Id | None = Field(None, description="Either a satellite ...")
    station_id: Id | None = Field(None, description="... or a station is out.")
    start: Instant
    end: Instant
    modes: list[Open[PinnedMode]] = Field(
        ["collect", "contact"],
        min_length=1,
        max_length=2,
        description="What a satellite cannot do meanwhile; a station's outage takes its contacts.",
    )
    reason: Reason | None = Field(None, description="For people: safe mode, antenna in service.")


class PlacedOutage(OutageIn):
    """An outage of a scenario."""

    id: Id | None = Field(None, description="Of the one under `/v1/outages` that it was.")


class OutageOut(Wire):
    """An outage that is stored."""

    id: str
    satellite_id: str | None
    satellite_name: str | None
    station_id: str | None
    station_name: str | None
    start: Instant
    end: Instant
    modes: tuple[Open[PinnedMode], ...]
    reason: str | None
    created_at: Instant


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
