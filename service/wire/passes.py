"""Passes of satellites over ground stations, and what a plan does in them."""

from __future__ import annotations

from pydantic import Field

from service.wire.base import Instant, Wire


class PassConflictOut(Wire):
    """Another satellite that the station sees at the same time."""

    satellite_id: str
    satellite_name: str
    aos: Instant
    los: Instant
    planned: bool = Field(description="Whether the plan has a contact in that pass.")


class PassOut(Wire):
    """A satellite over a station, from the first moment above its mask to the last."""

    station_id: str
    station_name: str
    satellite_id: str
    satellite_name: str
    aos: Instant = Field(description="Acquisition of signal.")
    tca: Instant = Field(description="When the satellite is highest.")
    los: Instant = Field(description="Loss of signal.")
    max_elevation_deg: float = Field(description="At `tca`.")
    aos_cut: bool = Field(
        description="Whether `aos` is the horizon's start: the pass began earlier."
    )
    los_cut: bool = Field(description="Whether `los` is the horizon's end: the pass ends later.")
    planned: bool = Field(description="Whether the plan has a contact in it.")
    action_ids: tuple[str, ...] = Field(description="Those contacts, as in the timeline.")
    volume_mbit: float | None = Field(
        description="Data that these contacts downlink in the plan; null if none is planned or "
        "the recorder has no capacity in megabits."
    )
    conflicts: tuple[PassConflictOut, ...] = Field(
        description="Passes of other satellites that overlap this one at the station."
    )
