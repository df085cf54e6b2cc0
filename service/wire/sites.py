"""Sites on the ground: targets in their catalogues, and ground stations."""

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
    float, Field(ge=-180, le=360, description="East positive; 190 and -170 mean the same.")
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
    min_contact_s: NonNegative = Field(0.0, description="Shorter passes are not used.")
    elevation_mask: Mask = Field(
        [],
        description="Knots [azimuth_deg, elevation_deg] of the local horizon, azimuth ascending "
        "from north through east, linear between knots and from the last to the first. The higher "
        "of mask and min_elevation_deg applies.",
    )
    antennas: int = Field(1, ge=1, le=100, description="Number of satellites served at a time.")
    setup_s: NonNegative = Field(
        0.0, description="Time at the beginning of each contact before data is downlinked."
    )
    downlink_gain: Positive = Field(
        1.0, description="Factor on the downlink_rate_mbit_s of each satellite."
    )


class GroundStationPatch(Patch):
    """Changes to a ground station; fields that are left out or null stay as they are."""

    name: Name | None = None
    lat_deg: Latitude | None = None
    lon_deg: Longitude | None = None
    alt_m: Altitude | None = None
    min_elevation_deg: Annotated[float, Field(ge=0, lt=90)] | None = None
    min_contact_s: NonNegative | None = None
    elevation_mask: Mask | None = Field(None, description="Replaces the whole mask.")
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
        description="`updated`: the only station of this name was given new figures; "
        "`unchanged`: the same station is already stored."
    )


class TargetIn(LightIn):
    """A point on the ground to be imaged once, by any satellite.

    Its limits narrow those of the sensor: a collect meets both.
    """

    id: Id = Field(description="Your own id, unique in the catalogue.")
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
        description="Only satellites whose sensor has exactly this type collect it; null for any.",
    )
    reward_half_life_s: Duration | None = Field(
        None,
        description="Half-life of the reward, from `release` or the horizon's start to the start "
        "of the collect; null for a constant reward.",
    )


class TargetCatalogIn(Body):
    """A catalogue of targets."""

    name: Name
    targets: list[TargetIn] = Field(min_length=1, max_length=MAX_TARGETS)


class TargetCatalogPatch(Patch):
    """Changes to a catalogue; fields that are left out or null stay as they are."""

    name: Name | None = None
    rewards: dict[Id, NonNegative] | None = Field(
        None,
        max_length=MAX_TARGETS,
        description="New rewards by target id: what an image of the target earns from now on.",
    )


class TargetCatalogOut(Stored):
    """A catalogue; its targets have an address of their own."""

    id: str
    name: str
    num_targets: int
    created_at: Instant
    changed_at: Instant | None = Field(None, description="When name or rewards last changed.")
    links: dict[str, str]


class CreatedCatalog(TargetCatalogOut):
    """A new catalogue."""

    ignored_columns: tuple[str, ...] = Field(description="Columns of a CSV file that were ignored.")
