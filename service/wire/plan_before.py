"""The plan that a scenario's plans go on from."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Body, Fraction, Id, Instant, NonNegative
from service.wire.pins import PinnedActionIn, StateIn


class PromiseIn(Body):
    """A target that the plan images, at whatever time."""

    target_id: Id
    image_by: Instant | None = Field(None, description="When the image must have ended.")
    deliver_by: Instant | None = Field(None, description="When it must be on the ground.")


class StabilityIn(Body):
    """How dear it is to leave an action of the plan before."""

    weight: Fraction = Field(
        0.03,
        description="What keeping a collect counts in the search: a share of a typical reward.",
    )
    contact_weight: Fraction = Field(0.05, description="The same of a contact.")
    max_changed_share: Fraction | None = Field(
        None, description="Of the actions after the freeze, the most that may be moved or removed."
    )


class FlownIn(Body):
    """An action that began before the horizon, and what became of it."""

    satellite_id: Id
    target_id: Id | None = None
    station_id: Id | None = None
    start: Instant
    end: Instant
    outcome: Literal["executed", "failed", "skipped", "partial"] = "executed"
    mbit: NonNegative | None = Field(
        None,
        description="Taken or brought down; null for what was planned, of what failed nothing.",
    )


class ReplanOfFile(Body):
    """The plan that a scenario's plans go on from."""

    base: list[PinnedActionIn] = Field(
        max_length=1_000_000,
        description="Its actions but for what failed: satellite, target or station, and start.",
    )
    freeze_until: Instant = Field(
        description="What starts before it stays as it is, and nothing is added there."
    )
    promises: list[PromiseIn] = Field([], max_length=10_000)
    stability: StabilityIn = StabilityIn()
    elements: Literal["same", "newest"] = Field(
        "same", description="Whether satellites have other elements than in the plan before."
    )
    flown: list[FlownIn] = Field(
        [], max_length=1_000_000, description="What lies between the states and the horizon."
    )
    before: list[StateIn] = Field(
        [], max_length=10_000, description="Older states, which tell what is on board."
    )
