"""What clients send, as JSON: one strict schema for each noun, defaults documented.

The ranges here are for the OpenAPI document and early answers; `planner_core.domain` has the
last word. Scenario files (`ScenarioFile`) are made of the same schemas.
"""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    Discriminator,
    FailFast,
    Field,
    StringConstraints,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError

from planner_core.domain import (
    CollectAlignment,
    Dynamics,
    LookSide,
    Nadir,
    OrbitDirection,
)
from service.api.shapes import Body, Instant, Name
from service.scenarios.pin_inputs import Id, PinsIn

NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Latitude = Annotated[float, Field(ge=-90, le=90, description="Geodetic (WGS84), north positive.")]
Longitude = Annotated[
    float, Field(ge=-180, le=360, description="East positive; both 190 and -170 are taken.")
]
SunElevation = Annotated[float | None, Field(ge=-90, le=90)]
LocalTime = Annotated[float | None, Field(ge=0, le=24)]
SensorType = Annotated[
    str, StringConstraints(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")
]
Altitude = Annotated[float, Field(ge=-500, le=10000, description="Above the WGS84 ellipsoid.")]


class AgilityIn(Body):
    """How fast the satellite turns; the paper's 1 deg/s by default."""

    slew_rate_deg_s: Positive = 1.0
    acceleration_deg_s2: Positive | None = Field(
        None, description="Limit of acceleration and braking; null for none."
    )
    settle_s: NonNegative = Field(0.0, description="Wait after each slew.")


class LightIn(Body):
    """When and from where an image may be taken: limits that sensor and target both have."""

    look_side: LookSide = Field("any", description="Of the direction of flight.")
    sun_elevation_min_deg: SunElevation = Field(None, description="Of the sun at the target.")
    sun_elevation_max_deg: SunElevation = Field(None, description="Of the sun at the target.")
    local_time_from_h: LocalTime = Field(
        None,
        description="Local apparent solar time at the target, in hours from midnight; with "
        "local_time_to_h. A span from 22 to 2 runs over midnight.",
    )
    local_time_to_h: LocalTime = None
    orbit_direction: OrbitDirection = Field(
        "any", description="Ascending while the satellite moves north."
    )


class SensorIn(LightIn):
    """The limits of the imager."""

    off_nadir_min_deg: float = Field(5.0, ge=0, le=90)
    off_nadir_max_deg: float = Field(55.0, ge=0, le=90)
    nadir: Nadir = Field(
        "geodetic", description="Perpendicular to the ellipsoid, or towards the Earth's centre."
    )
    min_elevation_deg: float = Field(0.0, ge=0, lt=90, description="At the target.")
    sensor_type: SensorType | None = Field(
        None,
        description="A name of your own, such as visible or infrared, that targets may ask for.",
    )


class ResourcesIn(Body):
    """Battery and recorder. All rates are magnitudes."""

    battery_capacity_wh: Positive
    battery_min_fraction: Fraction = 0.3
    initial_battery_fraction: Fraction = 1.0
    sunpoint_power_w: NonNegative = Field(description="Net charge while sun-pointing.")
    collect_power_w: NonNegative = Field(description="Net draw during a collect.")
    contact_power_w: NonNegative = Field(description="Net draw during a contact.")
    recorder_capacity_mbit: Positive
    recorder_max_fraction: Fraction = 0.75
    initial_recorder_fraction: Fraction = 0.0
    collect_rate_mbit_s: NonNegative = Field(description="What a collect writes.")
    downlink_rate_mbit_s: NonNegative = Field(description="What a contact takes down.")
    telemetry_rate_mbit_s: NonNegative = Field(description="What telemetry writes at all times.")
    eclipse_aware: bool = Field(False, description="Charge only in sunlight.")


Preset = Literal["paper", "paper_code"]


class PresetResourcesIn(Body):
    """A preset with other fractions than its own."""

    preset: Preset
    battery_min_fraction: Fraction = 0.3
    initial_battery_fraction: Fraction = 1.0
    recorder_max_fraction: Fraction = 0.75
    initial_recorder_fraction: Fraction = 0.0
    eclipse_aware: bool = Field(False, description="Charge only in sunlight.")


def _form_of_resources(value: object) -> str:
    if isinstance(value, PresetResourcesIn) or (isinstance(value, dict) and "preset" in value):
        return "changed_preset"
    return "object" if isinstance(value, (dict, ResourcesIn)) else "preset"


def _shortest(
    resources: Preset | PresetResourcesIn | ResourcesIn,
) -> Preset | PresetResourcesIn | ResourcesIn:
    """Return a preset that changes nothing by its name alone: one question has one hash."""
    if not isinstance(resources, PresetResourcesIn):
        return resources
    plain = PresetResourcesIn(preset=resources.preset)
    return resources.preset if resources == plain else resources


ResourcesField = Annotated[
    Annotated[Preset, Tag("preset")]
    | Annotated[PresetResourcesIn, Tag("changed_preset")]
    | Annotated[ResourcesIn, Tag("object")],
    Discriminator(_form_of_resources),
    AfterValidator(_shortest),
]


def _finite(omm: dict[str, Any]) -> dict[str, Any]:
    # Python's JSON reader lets NaN and Infinity through; the schema of an OMM is open.
    try:
        json.dumps(omm, allow_nan=False)
    except ValueError:
        raise PydanticCustomError("finite_number", "NaN and infinity are no JSON") from None
    return omm


class OrbitIn(Body):
    """An element set for SGP4: either ``tle`` or ``omm``."""

    tle: list[str] | None = Field(
        None, min_length=2, max_length=2, description="Line 1 and line 2 of a two-line element set."
    )
    omm: Annotated[dict[str, Any], AfterValidator(_finite)] | None = Field(
        None, description="The keywords of a CCSDS OMM with mean elements for SGP4."
    )

    @model_validator(mode="after")
    def _one_form(self) -> OrbitIn:
        if (self.tle is None) == (self.omm is None):
            raise PydanticCustomError("one_orbit", "Give the orbit either as tle or as omm")
        return self


class SatelliteIn(OrbitIn):
    """A satellite. Everything but its name and orbit defaults to the paper's spacecraft."""

    name: Name
    agility: AgilityIn = AgilityIn()
    sensor: SensorIn = SensorIn()
    resources: ResourcesField = Field(
        "paper",
        description="The satellite's own figures, or a preset: the paper's normalised spacecraft "
        "with the rates of its text (paper) or of the authors' code (paper_code); with fractions "
        'of your own as {"preset": "paper", "battery_min_fraction": 0.2}.',
    )


class GroundStationIn(Body):
    """A ground station."""

    name: Name
    lat_deg: Latitude
    lon_deg: Longitude
    alt_m: Altitude = 0.0
    min_elevation_deg: float = Field(5.0, ge=0, lt=90)
    min_contact_s: NonNegative = Field(0.0, description="Shorter passes are no contacts.")
    elevation_mask: list[Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(
        [],
        max_length=720,
        description="Knots [azimuth_deg, elevation_deg] of the horizon, azimuth ascending from "
        "north over east, linear between them and round the compass. The higher of mask and "
        "min_elevation_deg holds.",
    )
    antennas: int = Field(1, ge=1, le=100, description="Satellites served at a time.")


class TargetIn(LightIn):
    """A point on the ground to be imaged once, by any satellite.

    Its limits narrow those of the sensor: a collect meets both.
    """

    id: Id = Field(description="Your own; unique in the catalogue.")
    lat_deg: Latitude
    lon_deg: Longitude
    alt_m: Altitude = 0.0
    reward: NonNegative = 1.0
    collect_s: Positive = Field(30.0, description="How long one image takes.")
    off_nadir_min_deg: float | None = Field(
        None, ge=0, le=90, description="Narrows the sensor's limit."
    )
    off_nadir_max_deg: float | None = Field(
        None, ge=0, le=90, description="Narrows the sensor's limit."
    )
    min_elevation_deg: float | None = Field(
        None, ge=0, lt=90, description="Narrows the sensor's limit."
    )
    release: Instant | None = Field(None, description="No collect of it starts earlier.")
    due: Instant | None = Field(None, description="No collect of it ends later.")
    sensor_type: SensorType | None = Field(
        None,
        description="Only satellites whose sensor has this very type collect it; null for any.",
    )


class HorizonIn(Body):
    """The span to plan."""

    start: Instant
    end: Instant


class Question(Body):
    """What scenarios and scenario files share."""

    name: Name | None = None
    horizon: HorizonIn
    use_resources: bool = Field(
        True, description="False: no contacts, no sun-pointing, no battery and recorder limits."
    )
    dynamics: Dynamics = Field("physical", description="How battery and recorder are integrated.")
    collect_spacing_s: Positive | None = Field(
        None, description="Several collects per access, this far apart; null for one, centred."
    )
    collect_alignment: CollectAlignment = Field(
        "access",
        description="Whether those start from each access's own start on, or at multiples of "
        "collect_spacing_s from the horizon's start.",
    )
    continuous_starts: bool = Field(
        False, description="A solver may place a collect anywhere inside its access."
    )
    allow_old_elements: bool = Field(
        False,
        description="Plan with element sets that are more than 30 days from their epoch "
        "(low orbits), which is refused otherwise.",
    )
    pins: PinsIn = PinsIn()


class ScenarioIn(Question):
    """A planning question over what is stored."""

    satellite_ids: list[Id] = Field(min_length=1, max_length=10_000)
    target_catalog_ids: list[Id] = Field(min_length=1, max_length=1000)
    ground_station_ids: list[Id] = Field([], max_length=10_000)


class FileSatellite(SatelliteIn):
    """A satellite of a scenario file."""

    id: Id | None = Field(None, description="Its name by default, made unique.")


class FileGroundStation(GroundStationIn):
    """A ground station of a scenario file."""

    id: Id | None = Field(None, description="Its name by default, made unique.")


class FileTarget(TargetIn):
    """A target of a scenario file."""

    catalog_id: Id | None = Field(None, description="The catalogue it came from.")


class ScenarioFile(Question):
    """A self-contained scenario, as ``GET /v1/scenarios/{id}?expand=true`` answers it."""

    # The first thing that is wrong is told: of a whole file of them each would take memory.
    satellites: Annotated[list[FileSatellite], FailFast()] = Field(min_length=1, max_length=10_000)
    targets: Annotated[list[FileTarget], FailFast()] = Field(min_length=1, max_length=1_000_000)
    ground_stations: Annotated[list[FileGroundStation], FailFast()] = Field([], max_length=10_000)
