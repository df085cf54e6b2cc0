"""Places on the ground: targets in their catalogues, and ground stations."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from service.wire.base import (
    Body,
    Duration,
    Id,
    Instant,
    Knot,
    Name,
    NonNegative,
    Open,
    Patch,
    Positive,
    Stored,
    Wire,
)
from service.wire.satellites import LightIn, SensorType

Latitude = Annotated[float, Field(ge=-90, le=90, description="Geodetic (WGS84), north positive.")]
Longitude = Annotated[
    float, Field(ge=-180, le=360, description="East positive; both 190 and -170 are taken.")
]
Mask = Annotated[list[Knot], Field(max_length=720)]
Altitude = Annotated[float, Field(ge=-500, le=10000, description="Above the WGS84 ellipsoid.")]
NarrowerOffNadir = Annotated[
    float | None, Field(ge=0, le=90, description="Narrows the sensor's limit.")
]
MAX_TARGETS: Final = 100_000


class GroundStationIn(Body):
    """A ground station."""

    name: Name
    lat_deg: Latitude
    lon_deg: Longitude
    alt_m: Altitude = 0.0
    min_elevation_deg: float = Field(5.0, ge=0, lt=90)
    min_contact_s: NonNegative = Field(0.0, description="Shorter passes are no contacts.")
    elevation_mask: Mask = Field(
        [],
        description="Knots [azimuth_deg, elevation_deg] of the horizon, azimuth ascending from "
        "north over east, linear between them and round the compass. The higher of mask and "
        "min_elevation_deg holds.",
    )
    antennas: int = Field(1, ge=1, le=100, description="Satellites served at a time.")
    setup_s: NonNegative = Field(
        0.0, description="At the beginning of each contact, in which nothing comes down."
    )
    downlink_gain: Positive = Field(
        1.0, description="Factor on the downlink_rate_mbit_s of each satellite."
    )


class GroundStationPatch(Patch):
    """What is to be different about a ground station; what is left out or null stays."""

    name: Name | None = None
    lat_deg: Latitude | None = None
    lon_deg: Longitude | None = None
    alt_m: Altitude | None = None
    min_elevation_deg: Annotated[float, Field(ge=0, lt=90)] | None = None
    min_contact_s: NonNegative | None = None
    elevation_mask: Mask | None = Field(None, description="Replaces the mask as a whole.")
    antennas: Annotated[int, Field(ge=1, le=100)] | None = None
    setup_s: NonNegative | None = None
    downlink_gain: Positive | None = None


class GroundStationOut(GroundStationIn, Stored):
    """A ground station."""

    id: str
    created_at: Instant


class ImportedStation(Wire):
    """The station that a record belongs to."""

    id: str
    name: str
    row: int | None = Field(description="Line of the file, for CSV.")
    status: Open[Literal["created", "updated", "unchanged"]] = Field(
        description="`updated`: the only station of this name has other figures now; "
        "`unchanged`: the same station is stored already."
    )


class TargetIn(LightIn):
    """A point on the ground to be imaged once, by any satellite.

    Its limits narrow those of the sensor: a collect meets both.
    """

    id: Id = Field(description="Your own; unique in the catalogue.")
    name: Name | None = None
    lat_deg: Latitude
    lon_deg: Longitude
    alt_m: Altitude = 0.0
    reward: NonNegative = 1.0
    collect_s: Duration = Field(30.0, description="How long one image takes.")
    off_nadir_min_deg: NarrowerOffNadir = None
    off_nadir_max_deg: NarrowerOffNadir = None
    min_elevation_deg: float | None = Field(
        None, ge=0, lt=90, description="Narrows the sensor's limit."
    )
    release: Instant | None = Field(None, description="No collect of it starts earlier.")
    due: Instant | None = Field(None, description="No collect of it ends later.")
    sensor_type: SensorType | None = Field(
        None,
        description="Only satellites whose sensor has this very type collect it; null for any.",
    )
    reward_half_life_s: Duration | None = Field(
        None,
        description="The reward halves with every such time between `release`, or the horizon's "
        "start, and the start of the collect; null where it does not fall.",
    )


class TargetCatalogIn(Body):
    """A catalogue of targets."""

    name: Name
    targets: list[TargetIn] = Field(min_length=1, max_length=MAX_TARGETS)


class TargetCatalogPatch(Patch):
    """What is to be different about a catalogue; what is left out or null stays."""

    name: Name | None = None
    rewards: dict[Id, NonNegative] | None = Field(
        None,
        max_length=MAX_TARGETS,
        description="By target, its priority: what its image earns from now on.",
    )


class TargetCatalogOut(Stored):
    """A catalogue; its targets have their own address."""

    id: str
    name: str
    num_targets: int
    created_at: Instant
    changed_at: Instant | None = Field(None, description="When name or rewards were changed last.")
    links: dict[str, str]


class CreatedCatalog(TargetCatalogOut):
    """A new catalogue."""

    ignored_columns: tuple[str, ...] = Field(
        description="Columns of a CSV file that mean nothing here."
    )
