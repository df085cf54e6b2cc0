"""Scenarios (frozen planning questions), scenario files, and opportunities."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Final, Literal, get_args

from pydantic import BeforeValidator, FailFast, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from service.wire.base import Body, Duration, Fraction, Id, Instant, Knot, Name, Open, Stored, Wire
from service.wire.pins import PinsIn, PlacedOutage, StateIn
from service.wire.plan_before import ReplanOfFile
from service.wire.satellites import Nadir, WholeSatellite
from service.wire.sites import GroundStationIn, TargetIn
from service.wire.spacecraft_types import BuiltIn, filled_file_satellite

Dynamics = Literal["physical", "paper"]
CollectAlignment = Literal["access", "horizon"]
Kind = Literal["collect", "contact"]


class HorizonIn(Body):
    """The span to plan."""

    start: Instant
    end: Instant


Curve = Annotated[list[Knot], Field(max_length=100)]


class QualityIn(Body):
    """The share of its target's reward that an image earns: the product of all curves.

    A curve is a list of knots (an angle, and a value from 0 to 1) in ascending order, linear
    between them and constant beyond. It is evaluated at the middle of the collect.
    """

    off_nadir_deg: Curve = Field(
        [],
        description="Knots [off_nadir_deg, value], from 0 to 90; empty for 1 everywhere.",
        examples=[[[0, 1], [45, 0.6]]],
    )
    sun_elevation_deg: Curve = Field(
        [],
        description="Knots [sun_elevation_deg, value], at the target, from -90 to 90; empty for 1 "
        "everywhere.",
        examples=[[[10, 0.5], [40, 1]]],
    )


Preference = Literal["early", "off_nadir", "sun", "balance", "margin", "few_contacts"]


class ObjectiveIn(Body):
    """How much a plan earns for an image when it is taken, and when it is on the ground."""

    collected_share: Fraction = Field(
        1.0,
        description="Share of its worth that an image earns when it is taken; it earns the rest "
        "when its last bit is on the ground. Without resources, images earn all when taken.",
    )
    half_life_s: float | None = Field(
        None,
        gt=0.0,
        description="Half-life of the rest, from the end of the collect until its last bit is on "
        "the ground; null for no decay. It has no effect if `collected_share` is 1.",
    )
    prefer: list[Preference] = Field(
        [],
        description="Secondary aims, in order, that never cost worth: `early` (lowest mean age), "
        "`off_nadir` (smallest mean angle), `sun` (highest mean sun elevation), `balance` "
        "(smallest share of the busiest satellite), `margin` (highest minimum battery level), "
        "`few_contacts`. An aim may worsen those before it by at most a hundredth. A replan "
        "ignores them, as it changes as little as it must.",
    )


DEFAULT_OBJECTIVE: Final = ObjectiveIn(collected_share=0.9, prefer=["early", "off_nadir"])
ObjectiveName = Literal["collected", "delivered", "paper"]
_SECOND: Final = 2
_NAMED: Final = {
    "collected": ObjectiveIn(),
    "delivered": ObjectiveIn(collected_share=0.0),
    "paper": ObjectiveIn(),
}


def _objective_named(value: object) -> object:
    """Return the objective that a short name stands for; anything else as it is."""
    return _NAMED.get(value, value) if isinstance(value, str) else value


class _OrShortName:
    """Shows the short names in the schemas of requests and answers alike.

    Two schemas of one model would get two names, and generated clients would lose both.
    """

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        names = {"type": "string", "enum": list(get_args(ObjectiveName))}
        return {"anyOf": [handler(schema), names]}


AnyObjective = Annotated[ObjectiveIn, BeforeValidator(_objective_named), _OrShortName()]


def default_objective(types: Iterable[object]) -> ObjectiveIn:
    """Return the default objective of a new question, given the types of its satellites."""
    is_of_paper = all(name in ("paper", "paper_code") for name in types)
    return ObjectiveIn() if is_of_paper else DEFAULT_OBJECTIVE


def _without_default(schema: JsonSchemaValue) -> None:
    schema.pop("default", None)


class Question(Body):
    """Fields that scenarios and scenario files share."""

    name: Name | None = None
    horizon: HorizonIn
    use_resources: bool = Field(
        True, description="False: no contacts, no sun-pointing, no battery or recorder limits."
    )
    dynamics: Open[Dynamics] = Field(
        "physical", description="How battery and recorder levels are integrated."
    )
    collect_spacing_s: Duration | None = Field(
        None, description="Interval between an access's collects; null for a single, centred one."
    )
    collect_alignment: Open[CollectAlignment] = Field(
        "access",
        description="Whether the collects are counted from the start of each access, or start at "
        "multiples of collect_spacing_s from the horizon's start.",
    )
    continuous_starts: bool = Field(
        False,
        description="Whether collects may start at any time in their access; not with `quality`.",
    )
    quality: QualityIn = QualityIn()
    objective: AnyObjective = Field(
        ObjectiveIn(),
        description="What images earn. `collected` is short for a collected_share of 1, "
        "`delivered` for 0; `paper` is the same as `collected`. The default is a collected_share "
        "of 0.9 with `early` and `off_nadir` preferred; it is `paper` if all satellites are of the "
        "types `paper` and `paper_code`, and in files of the first release.",
        # The default depends on the satellites.
        json_schema_extra=_without_default,
    )
    allow_old_elements: bool = Field(
        False,
        description="Accept element sets that are more than 30 days from their epoch "
        "(in low orbits), which are otherwise refused.",
    )
    pins: PinsIn = PinsIn()
    outages: list[PlacedOutage] = Field(
        [],
        max_length=10_000,
        description="Known outages. Those stored under `/v1/outages` that concern the scenario "
        "are added when it is stored.",
    )
    states: list[StateIn] = Field(
        [],
        max_length=10_000,
        description="Battery, recorder and attitude of satellites before the horizon begins, at "
        "most one state each. Without one, `resources` give the levels at the horizon's start.",
    )


class ScenarioIn(Question):
    """A planning question about stored satellites, targets and stations."""

    satellite_ids: list[Id] = Field(min_length=1, max_length=10_000)
    target_catalog_ids: list[Id] = Field(min_length=1, max_length=1000)
    ground_station_ids: list[Id] = Field([], max_length=10_000)
    forecast_id: Id | None = Field(
        None, description="Its values for the targets are frozen with the scenario."
    )


class FileSatellite(WholeSatellite):
    """A satellite of a scenario file.

    Figures left out are those of its `spacecraft` type, which has a default in files of release 2.
    """

    spacecraft: BuiltIn | None = Field(None, description="A built-in type.")

    id: Id | None = Field(None, description="Its name by default, made unique.")


class FileGroundStation(GroundStationIn):
    """A ground station of a scenario file."""

    id: Id | None = Field(None, description="Its name by default, made unique.")


class SkySeriesIn(Body):
    """Probabilities of a clear sky over some targets at the same instants; linear between them."""

    times: Annotated[list[Instant], FailFast()] = Field(
        min_length=1, max_length=100_000, description="Ascending."
    )
    clear_probability: Annotated[dict[Id, Annotated[list[Fraction], FailFast()]], FailFast()] = (
        Field(
            min_length=1,
            max_length=1_000_000,
            description="By target id: one value for each of `times`.",
        )
    )


class FileForecast(Body):
    """The values of a forecast for the targets, frozen with the question."""

    default_clear_probability: float | None = Field(
        None, ge=0, le=1, description="For targets and instants that no series covers."
    )
    series: Annotated[list[SkySeriesIn], FailFast()] = Field([], max_length=1_000_000)


class FileTarget(TargetIn):
    """A target of a scenario file."""

    catalog_id: Id | None = Field(None, description="The catalogue it came from.")


class ScenarioFile(Question):
    """A self-contained scenario, as ``GET /v1/scenarios/{id}?expand=true`` returns it."""

    release: Literal[1, 2] = Field(
        1,
        description="Version of the file's form. Figures left out by satellites without a type are "
        "the paper's in files of release 1, and those of `generic_optical` in files of release 2.",
    )
    # Only the first error is reported: in a large file, all of them would take too much memory.
    satellites: Annotated[list[FileSatellite], FailFast()] = Field(min_length=1, max_length=10_000)
    targets: Annotated[list[FileTarget], FailFast()] = Field(min_length=1, max_length=1_000_000)
    ground_stations: Annotated[list[FileGroundStation], FailFast()] = Field([], max_length=10_000)
    forecast: FileForecast | None = Field(None, description="Null to assume clear skies.")
    replan: ReplanOfFile | None = Field(
        None, description="The previous plan that this one continues, as a replan writes it."
    )

    @model_validator(mode="before")
    @classmethod
    def _with_types(cls, value: object) -> object:
        """Give satellites the figures of their types; malformed files are reported later."""
        if not isinstance(value, dict) or not isinstance(value.get("satellites"), list):
            return value
        satellites = [
            filled_file_satellite(one, value.get("release")) if isinstance(one, dict) else one
            for one in value["satellites"]
        ]
        filled = {**value, "satellites": satellites}
        if value.get("release") == _SECOND and "objective" not in value:
            filled["objective"] = default_objective(
                one.get("spacecraft") for one in satellites if isinstance(one, dict)
            )
        return filled


class HorizonOut(Wire):
    """The span to plan."""

    start: Instant
    end: Instant


class Counts(Wire):
    """Numbers of objects in the scenario."""

    satellites: int
    targets: int
    ground_stations: int


class ScenarioSummary(Stored):
    """A frozen question without its pins, outages and states, as in lists."""

    id: str
    sha256: str = Field(description="Hash of the canonical content without the name.")
    name: str | None
    horizon: HorizonOut
    satellite_ids: tuple[str, ...]
    target_catalog_ids: tuple[str, ...]
    ground_station_ids: tuple[str, ...]
    use_resources: bool
    dynamics: Open[Dynamics]
    collect_spacing_s: float | None
    collect_alignment: Open[CollectAlignment] = "access"
    continuous_starts: bool
    quality: QualityIn = QualityIn()
    objective: ObjectiveIn = ObjectiveIn()
    allow_old_elements: bool
    forecast_id: str | None = Field(
        None, description="The forecast used; null if the file held one, or there is none."
    )
    has_forecast: bool = False
    counts: Counts
    warnings: tuple[str, ...] = Field(
        description="For people: old orbits, and settings that are nearly always a mistake."
    )
    created_at: Instant
    links: dict[str, str]


class ScenarioOut(ScenarioSummary):
    """A frozen question. Later changes to the objects it names do not affect it."""

    pins: PinsIn = PinsIn()
    outages: tuple[PlacedOutage, ...] = Field(
        (), description="Those taken from `/v1/outages` have their `id`."
    )
    states: tuple[StateIn, ...] = Field((), description="States before the horizon.")


class ViewOut(Wire):
    """The geometry between a satellite and a site at one instant."""

    off_nadir_deg: float
    elevation_deg: float
    azimuth_deg: float
    range_km: float
    sun_elevation_deg: float
    eclipse: bool


class OpportunityOut(Wire):
    """A collect or a contact that a plan may take. Angles and range are those at its middle."""

    id: str
    satellite_id: str
    satellite_name: str | None = None
    kind: Open[Kind]
    target_id: str | None = Field(description="Only for a collect.")
    target_name: str | None = Field(None, description="For a collect whose target has a name.")
    station_id: str | None = Field(description="Only for a contact.")
    station_name: str | None = Field(None, description="Only for a contact.")
    start: Instant
    end: Instant
    access_start: Instant = Field(
        description="Start of the access that it lies in, cut to the release and due times."
    )
    access_end: Instant
    off_nadir_deg: float = Field(description="At the satellite, from the nadir given by `nadir`.")
    elevation_deg: float = Field(description="At the target or station.")
    azimuth_deg: float = Field(description="Of the satellite, from north through east.")
    sun_elevation_deg: float = Field(description="At the target or station.")
    range_km: float = Field(description="From the satellite to the target or station.")
    eclipse: bool = Field(description="The satellite is in the Earth's shadow.")
    nadir: Open[Nadir] = Field(description="Vertical that off-nadir angles are measured from.")
    at_start: ViewOut | None = Field(None, description="Only with `edges=true`.")
    at_end: ViewOut | None = Field(None, description="Only with `edges=true`.")
