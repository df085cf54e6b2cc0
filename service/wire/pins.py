"""Pinned actions, outages and states, as clients write them."""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self, get_args

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from service.wire.base import Body, Fraction, Id, Instant, NonNegative, Open, Reason, Wire

PinnedMode = Literal["collect", "contact"]

OF_ACTIONS: Final = frozenset(
    (
        "id", "mode", "start", "end", "satellite_id", "satellite_name", "target_id", "target_name",
        "station_id", "station_name", "opportunity_id", "off_nadir_deg", "azimuth_deg", "slew",
        "turn_to_s", "turn_back_s", "reward", "worth", "quality", "clear_probability",
        "delivered_at", "age_s", "battery_fraction_end", "recorder_fraction_end", "outcome",
    )
)  # fmt: skip
"""What actions of timelines and plans tell."""


class PinnedActionIn(Body):
    """An action in words: a booked contact, a promised image.

    An action of a timeline or of a plan is taken as it is: its `mode` tells that it is one.
    """

    satellite_id: Id | None = Field(
        None, description="Or the name of one satellite alone. Any satellite by default."
    )
    target_id: Id | None = Field(None, description="Of the image.")
    station_id: Id | None = Field(
        None, description="Of the contact; or the name of one station alone."
    )
    start: Instant | None = Field(
        None,
        description="Of the opportunities that start and end touch, the one that starts nearest "
        "to start is meant. Needed where there are several.",
    )
    end: Instant | None = Field(None, description="start by default.")
    opportunity_id: Id | None = Field(
        None, description="The opportunity itself, as the scenario lists it, in place of the rest."
    )

    @model_validator(mode="before")
    @classmethod
    def _of_a_plan(cls, value: object) -> object:
        """Leave out what an action tells beyond a pin."""
        if not isinstance(value, dict) or "mode" not in value:
            return value
        if value["mode"] not in get_args(PinnedMode):
            raise PydanticCustomError("no_pinned_mode", "Only collects and contacts are pinned")
        # The same opportunity has another id in another scenario; times and places say it all.
        own = cls.model_fields.keys() - {"opportunity_id"}
        dropped = OF_ACTIONS - own
        return {name: part for name, part in value.items() if name not in dropped}


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


class AttitudeIn(Body):
    """Where a satellite looks: exactly one of these. `"sun"` is short for `{"sun": true}`."""

    sun: Literal[True] | None = Field(None, description="Its panels are at the sun.")
    target_id: Id | None = Field(None, description="It tracks this target.")
    station_id: Id | None = Field(None, description="It tracks this ground station.")
    opportunity_id: Id | None = Field(
        None, description="It tracks the place of this opportunity of the scenario."
    )
    line_of_sight: Annotated[list[float], Field(min_length=3, max_length=3)] | None = Field(
        None, description="A unit vector in TEME at that instant; the satellite is at rest."
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(value is not None for _, value in self) != 1:
            raise PydanticCustomError(
                "one_attitude",
                "Give exactly one of sun, target_id, station_id, opportunity_id and line_of_sight",
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def _named(cls, value: object) -> object:
        return {"sun": True} if value == "sun" else value


class OnBoardIn(Body):
    """An image that a recorder holds."""

    target_id: Id
    collected_at: Instant = Field(description="The end of its collect.")
    mbit: NonNegative | None = Field(
        None,
        description="What is left of it; 0 where it is on the ground, and its target needs no "
        "other image.",
    )
    recorder_fraction: Fraction | None = Field(
        None, description="The same in place of `mbit`, as a fraction of the recorder."
    )
    worth: NonNegative | None = Field(
        None, description="Of the image, whole; null for its target's reward."
    )


class StateIn(Body):
    """What a satellite had before the horizon; until that begins it idles."""

    satellite_id: Id
    at: Instant = Field(description="The horizon's start, or up to seven days before it.")
    battery_fraction: Fraction | None = Field(
        None, description="Of capacity at that instant; null for what `resources` say of the start."
    )
    recorder_fraction: Fraction | None = Field(None, description="Likewise, of the recorder.")
    attitude: AttitudeIn | None = Field(
        None,
        description="Where it looked: no task begins before it can have turned to it from there. "
        "Null where that is not known: the first task needs no turn.",
    )
    on_board: list[OnBoardIn] | None = Field(
        None,
        max_length=100_000,
        description="Images that come down first, in this order, and then what else the recorder "
        "holds; their targets need no other image. Null where that is not known: a replan then "
        "goes by the plan and what was reported of it.",
    )


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
