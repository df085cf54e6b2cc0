"""Satellites: their agility, sensors, resources and orbits."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import AfterValidator, Discriminator, Field, StringConstraints, Tag, model_validator
from pydantic_core import PydanticCustomError

from service.wire.base import (
    TEXT,
    Body,
    Fraction,
    Free,
    Id,
    Instant,
    Json,
    Name,
    NonNegative,
    Open,
    Patch,
    Positive,
    Stored,
    Wire,
)
from service.wire.imports import RejectedRow

R = TypeVar("R")

SunExclusion = Annotated[float | None, Field(ge=0, le=180)]
PanelAngle = Annotated[float, Field(ge=0, le=180)]
DownlinkKnot = Annotated[list[NonNegative], Field(min_length=2, max_length=2)]
DownlinkRate = NonNegative | Annotated[list[DownlinkKnot], Field(min_length=1, max_length=100)]
SunElevation = Annotated[float | None, Field(ge=-90, le=90)]
LocalTime = Annotated[float | None, Field(ge=0, le=24)]
SensorType = Annotated[str, StringConstraints(min_length=1, max_length=100, pattern=TEXT)]
Nadir = Literal["geodetic", "geocentric"]
SunPointing = Literal["free", "slew"]
SlewModel = Literal["rest", "moving"]
LookSide = Literal["left", "right", "any"]
OrbitDirection = Literal["ascending", "descending", "any"]


class AgilityIn(Body):
    """How fast the satellite slews; the paper's 1 deg/s by default."""

    slew_rate_deg_s: Positive = 1.0
    acceleration_deg_s2: Positive | None = Field(
        None, description="Limit of acceleration and braking; null for no limit."
    )
    settle_s: NonNegative = Field(0.0, description="Wait after each slew.")
    slew_model: SlewModel = Field(
        "rest",
        description="rest: slews begin and end at rest. moving: they begin and end at the rates "
        "of the moving lines of sight; needs acceleration_deg_s2.",
    )
    sun_exclusion_deg: SunExclusion = Field(
        None,
        description="Least angle from boresight to sun in slews; not considered in planning.",
    )


class LightIn(Body):
    """Limits on light and viewing direction, which sensors and targets both have."""

    look_side: Open[LookSide] = Field("any", description="Relative to the direction of flight.")
    sun_elevation_min_deg: SunElevation = Field(None, description="Of the sun at the target.")
    sun_elevation_max_deg: SunElevation = Field(None, description="Of the sun at the target.")
    local_time_from_h: LocalTime = Field(
        None,
        description="Local apparent solar time at the target, in hours from midnight; needs "
        "local_time_to_h. A span from 22 to 2 includes midnight.",
    )
    local_time_to_h: LocalTime = None
    orbit_direction: Open[OrbitDirection] = Field(
        "any", description="Ascending while the satellite moves north."
    )


class SensorIn(LightIn):
    """The limits of the imager."""

    off_nadir_min_deg: float = Field(5.0, ge=0, le=90)
    off_nadir_max_deg: float = Field(55.0, ge=0, le=90)
    nadir: Open[Nadir] = Field(
        "geodetic", description="Perpendicular to the ellipsoid, or towards the Earth's centre."
    )
    min_elevation_deg: float = Field(0.0, ge=0, lt=90, description="At the target.")
    sun_exclusion_deg: SunExclusion = Field(
        None, description="Least angle between the line of sight and the sun; null for no limit."
    )
    sensor_type: SensorType | None = Field(
        None,
        description="A name of your own, such as visible or infrared, that targets may require.",
    )


class ResourcesIn(Body):
    """Battery and recorder. All rates are magnitudes."""

    battery_capacity_wh: Positive
    battery_min_fraction: Fraction = 0.3
    initial_battery_fraction: Fraction = 1.0
    sunpoint_power_w: NonNegative = Field(
        description="Charging power while sun-pointing, before idle_power_w is subtracted."
    )
    idle_power_w: NonNegative = Field(
        0.0, description="Drawn at all times, in eclipse too, in addition to each mode's power."
    )
    collect_power_w: NonNegative = Field(description="Net draw during a collect.")
    contact_power_w: NonNegative = Field(description="Net draw during a contact.")
    recorder_capacity_mbit: Positive
    recorder_max_fraction: Fraction = 0.75
    initial_recorder_fraction: Fraction = 0.0
    collect_rate_mbit_s: NonNegative = Field(description="Data that a collect writes.")
    downlink_rate_mbit_s: DownlinkRate = Field(
        description="Downlink rate of a contact: a number, or knots [elevation_deg, mbit_s] in "
        "ascending elevation at the station, linear between them and constant beyond."
    )
    telemetry_rate_mbit_s: NonNegative = Field(description="Telemetry, written at all times.")
    eclipse_aware: bool = Field(False, description="Charge only in sunlight.")
    sun_pointing: SunPointing = Field(
        "free",
        description="free: the satellite charges in all idle time. slew: only between a slew to "
        "the sun and one back.",
    )
    panel_angle_deg: PanelAngle = Field(
        180.0, description="Angle between the normal of the panels and the boresight."
    )


Preset = Literal["paper", "paper_code"]


class PresetResourcesIn(Body):
    """A preset with some settings changed."""

    preset: Preset
    battery_min_fraction: Fraction = 0.3
    initial_battery_fraction: Fraction = 1.0
    recorder_max_fraction: Fraction = 0.75
    initial_recorder_fraction: Fraction = 0.0
    eclipse_aware: bool = Field(False, description="Charge only in sunlight.")
    sun_pointing: SunPointing = Field(
        "free",
        description="free: the satellite charges in all idle time. slew: only between a slew to "
        "the sun and one back.",
    )
    panel_angle_deg: PanelAngle = Field(
        180.0, description="Angle between the normal of the panels and the boresight."
    )


def _form_of_resources(value: object) -> str:
    if isinstance(value, PresetResourcesIn) or (isinstance(value, dict) and "preset" in value):
        return "changed_preset"
    return "object" if isinstance(value, (dict, ResourcesIn)) else "preset"


def _shortest(resources: R) -> R | Preset:
    """Replace an unchanged preset by its name, so that equal questions have equal hashes."""
    if not isinstance(resources, PresetResourcesIn):
        return resources
    plain = PresetResourcesIn(preset=resources.preset)
    return resources.preset if resources == plain else resources


PresetOr = Annotated[
    Annotated[Preset, Tag("preset")]
    | Annotated[PresetResourcesIn, Tag("changed_preset")]
    | Annotated[R, Tag("object")],
    Discriminator(_form_of_resources),
    AfterValidator(_shortest),
]
ResourcesField = PresetOr[ResourcesIn]


_MOST_LINES: Final = 110_000
OemLine = Annotated[str, StringConstraints(max_length=300, pattern=TEXT)]


class OrbitIn(Body):
    """An element set for SGP4, ``tle`` or ``omm``, or an ephemeris, ``oem``."""

    tle: list[str] | None = Field(
        None, min_length=2, max_length=2, description="Line 1 and line 2 of a two-line element set."
    )
    omm: Free[dict[str, Any]] | None = Field(
        None, description="The keywords of a CCSDS OMM with mean elements for SGP4."
    )
    oem: list[OemLine] | None = Field(
        None,
        max_length=_MOST_LINES,
        description="The lines of a CCSDS OEM in its keyword form (KVN): states over time.",
    )

    @model_validator(mode="after")
    def _one_form(self) -> OrbitIn:
        if sum(form is not None for form in (self.tle, self.omm, self.oem)) != 1:
            raise PydanticCustomError("one_orbit", "Give the orbit as one of tle, omm and oem")
        return self


class OwnResources(Body):
    """Figures of battery and recorder that differ from those of the spacecraft type."""

    battery_capacity_wh: Positive | None = None
    battery_min_fraction: Fraction | None = None
    initial_battery_fraction: Fraction | None = None
    sunpoint_power_w: NonNegative | None = None
    idle_power_w: NonNegative | None = None
    collect_power_w: NonNegative | None = None
    contact_power_w: NonNegative | None = None
    recorder_capacity_mbit: Positive | None = None
    recorder_max_fraction: Fraction | None = None
    initial_recorder_fraction: Fraction | None = None
    collect_rate_mbit_s: NonNegative | None = None
    downlink_rate_mbit_s: DownlinkRate | None = None
    telemetry_rate_mbit_s: NonNegative | None = None
    eclipse_aware: bool | None = None
    sun_pointing: SunPointing | None = None
    panel_angle_deg: PanelAngle | None = None


OwnResourcesField = PresetOr[OwnResources]


class Figures(Body):
    """Settings of a spacecraft that differ from those of its type."""

    agility: AgilityIn = Field(
        default_factory=AgilityIn, description="Settings that differ from those of the type."
    )
    sensor: SensorIn = Field(
        default_factory=SensorIn, description="Settings that differ from those of the type."
    )
    resources: OwnResourcesField = Field(
        default_factory=OwnResources,
        description="Figures that differ from those of the type, or a preset: the paper's "
        "normalised spacecraft with the rates of its text (paper) or of the authors' code "
        '(paper_code). With your own fractions: {"preset": "paper", '
        '"battery_min_fraction": 0.2}.',
    )


def sent_by(body: Figures | Patch) -> Json:
    """Return only the fields that a client has sent, without nulls."""
    sent = body.model_dump(mode="json", exclude_unset=True, exclude={"resources"})
    if "resources" in body.model_fields_set:
        resources = getattr(body, "resources", None)
        if isinstance(resources, Body):
            resources = resources.model_dump(mode="json", exclude_none=True)
        sent["resources"] = resources
    return {name: value for name, value in sent.items() if value is not None}


class SatelliteIn(OrbitIn, Figures):
    """A satellite: a type of spacecraft in an orbit, and the settings that differ."""

    name: Name
    spacecraft: Id | None = Field(
        None,
        description="Id of a spacecraft type, or the name of a built-in one. By default "
        "generic_optical, or the paper's type if `resources` is a preset of the paper.",
    )


class TypedFigures(Body):
    """All figures of a spacecraft; those left out are the paper's."""

    spacecraft: Id | None = Field(
        None, description="Id or built-in name of the type it was made from."
    )
    agility: AgilityIn = AgilityIn()
    sensor: SensorIn = SensorIn()
    resources: ResourcesField = Field(
        "paper", description="The satellite's own figures, or a preset of the paper's spacecraft."
    )


class WholeSatellite(OrbitIn, TypedFigures):
    """A satellite with all its figures."""

    name: Name


class SatellitePatch(Patch):
    """Changes to a satellite; fields that are left out or null stay as they are."""

    name: Name | None = None
    spacecraft: Id | None = Field(
        None, description="Sets all figures to those of this type, before the other changes."
    )
    agility: AgilityIn | None = Field(None, description="Only the settings given are changed.")
    sensor: SensorIn | None = Field(None, description="Only the settings given are changed.")
    resources: ResourcesField | None = Field(None, description="Replaces all resources.")


class OemOut(Stored):
    """An ephemeris: its object, usable time span and number of states."""

    object_name: str
    object_id: str
    start: Instant
    stop: Instant
    num_states: int


class ElementsOut(Stored):
    """One element set of a satellite, or an ephemeris."""

    id: str
    epoch: Instant
    tle: tuple[str, ...] | None
    omm: Json | None
    oem: OemOut | None = None
    created_at: Instant


class SatelliteOut(Stored):
    """A satellite with the element set in force, the one of the newest epoch."""

    id: str
    name: str
    norad_cat_id: int
    epoch: Instant
    tle: tuple[str, ...] | None
    omm: Json | None
    oem: OemOut | None = None
    spacecraft: str | None = Field(
        None, description="The type it was made from; later changes of the type have no effect."
    )
    agility: AgilityIn
    sensor: SensorIn
    resources: ResourcesField
    created_at: Instant
    links: dict[str, str]


class RecordWarning(RejectedRow):
    """A correction made while reading a record."""


ImportStatus = Literal["created", "elements_added", "unchanged"]


class ImportedSatellite(Wire):
    """The satellite that a record belongs to."""

    id: str
    name: str
    norad_cat_id: int
    epoch: Instant
    row: int | None = Field(description="Line of the file where the record starts.")
    status: Open[ImportStatus] = Field(
        description="`elements_added`: the catalogue number was known, the epoch was new; "
        "`unchanged`: both were known."
    )
    warnings: tuple[RecordWarning, ...]
