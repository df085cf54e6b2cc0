"""The previous plan that a scenario's plans continue."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Body, Fraction, Id, Instant, NonNegative
from service.wire.pins import PinnedActionIn, StateIn


class PromiseIn(Body):
    """A target that the plan images, at whatever time."""

    target_id: Id
    image_by: Instant | None = Field(None, description="Latest end of the image.")
    deliver_by: Instant | None = Field(None, description="Latest delivery to the ground.")


class StabilityIn(Body):
    """The value of keeping actions of the previous plan."""

    weight: Fraction = Field(
        0.03,
        description="Value of keeping a collect, in the search: a share of a typical reward.",
    )
    contact_weight: Fraction = Field(0.05, description="The same for a contact.")
    max_changed_share: Fraction | None = Field(
        None, description="Largest share of the actions after the freeze to be moved or removed."
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
        description="Data recorded or downlinked; null for the planned amount (0 if it failed).",
    )


class ReplanOfFile(Body):
    """The previous plan that a scenario's plans continue."""

    base: list[PinnedActionIn] = Field(
        max_length=1_000_000,
        description="Its actions except failed ones: satellite, target or station, and start.",
    )
    freeze_until: Instant = Field(
        description="Actions that start before it stay as they are, and none is added there."
    )
    promises: list[PromiseIn] = Field([], max_length=10_000)
    stability: StabilityIn = StabilityIn()
    elements: Literal["same", "newest"] = Field(
        "same", description="`newest` if satellites have other elements than in the previous plan."
    )
    flown: list[FlownIn] = Field(
        [], max_length=1_000_000, description="Actions between the states and the horizon."
    )
    before: list[StateIn] = Field(
        [], max_length=10_000, description="Older states, from which follows what is on board."
    )
