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
"""Fields of actions in timelines and plans."""


class PinnedActionIn(Body):
    """A description of an action, such as a booked contact or a promised image.

    An action copied from a timeline or a plan, recognised by its `mode`, is accepted unchanged.
    """

    satellite_id: Id | None = Field(
        None, description="Or the name of a satellite, if it is unique. Any satellite by default."
    )
    target_id: Id | None = Field(None, description="Target of the image.")
    station_id: Id | None = Field(
        None, description="Station of the contact; or its name, if it is unique."
    )
    start: Instant | None = Field(
        None,
        description="Selects, of the opportunities that overlap the span from start to end, the "
        "one that starts nearest to start. Required if there are several.",
    )
    end: Instant | None = Field(None, description="Defaults to start.")
    opportunity_id: Id | None = Field(
        None, description="The scenario's id of the opportunity, instead of the other fields."
    )

    @model_validator(mode="before")
    @classmethod
    def _of_a_plan(cls, value: object) -> object:
        """Drop the fields of an action that a pin does not have."""
        if not isinstance(value, dict) or "mode" not in value:
            return value
        if value["mode"] not in get_args(PinnedMode):
            raise PydanticCustomError("no_pinned_mode", "Only collects and contacts can be pinned")
        # Ids of opportunities differ between scenarios; times and sites suffice.
        own = cls.model_fields.keys() - {"opportunity_id"}
        dropped = OF_ACTIONS - own
        return {name: part for name, part in value.items() if name not in dropped}


class BlockedIn(Body):
    """A span in which a satellite may not take images, contact stations, or either."""

    satellite_id: Id
    start: Instant
    end: Instant
    modes: list[Open[PinnedMode]] = Field(["collect", "contact"], min_length=1, max_length=2)


class OutageIn(Body):
    """A span in which a satellite or a ground station is not available."""

    satellite_id: Id | None = Field(None, description="The satellite that is out, or null.")
    station_id: Id | None = Field(None, description="The station that is out, or null.")
    start: Instant
    end: Instant
    modes: list[Open[PinnedMode]] = Field(
        ["collect", "contact"],
        min_length=1,
        max_length=2,
        description="What a satellite cannot do meanwhile; a station's outage rules out contacts.",
    )
    reason: Reason | None = Field(None, description="For people, such as: safe mode.")


class PlacedOutage(OutageIn):
    """An outage of a scenario."""

    id: Id | None = Field(None, description="Its id under `/v1/outages`, if stored there.")


class OutageOut(Wire):
    """A stored outage."""

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
    """Attitude of a satellite: exactly one of these. `"sun"` is short for `{"sun": true}`."""

    sun: Literal[True] | None = Field(None, description="Its panels point at the sun.")
    target_id: Id | None = Field(None, description="It tracks this target.")
    station_id: Id | None = Field(None, description="It tracks this ground station.")
    opportunity_id: Id | None = Field(
        None, description="It tracks the site of this opportunity of the scenario."
    )
    line_of_sight: Annotated[list[float], Field(min_length=3, max_length=3)] | None = Field(
        None, description="Unit vector in TEME at that instant; the satellite is at rest."
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
        description="Data still to be downlinked; 0 if the image is on the ground and its target "
        "needs no other image.",
    )
    recorder_fraction: Fraction | None = Field(
        None, description="The same as a fraction of the recorder, instead of `mbit`."
    )
    worth: NonNegative | None = Field(
        None, description="Worth of the whole image; null for its target's reward."
    )


class StateIn(Body):
    """State of a satellite before the horizon; it idles until the horizon begins."""

    satellite_id: Id
    at: Instant = Field(description="The horizon's start, or up to seven days before it.")
    battery_fraction: Fraction | None = Field(
        None, description="Charge at that instant; null for the initial value in `resources`."
    )
    recorder_fraction: Fraction | None = Field(None, description="Likewise for the recorder.")
    attitude: AttitudeIn | None = Field(
        None,
        description="Attitude at that instant: the first task starts only after a slew from it. "
        "Null if unknown: the first task then needs no slew.",
    )
    on_board: list[OnBoardIn] | None = Field(
        None,
        max_length=100_000,
        description="Images on board; they are downlinked first, in this order, before the other "
        "data on the recorder. Their targets need no other image. Null if unknown: a replan then "
        "relies on the plan and its execution reports.",
    )


class PinsIn(Body):
    """Actions that plans must hold, and those they must not."""

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
