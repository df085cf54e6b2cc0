"""Scenarios: frozen questions, the files they are, and the opportunities they offer."""

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
    """What part of its target's reward an image earns: the product of all curves.

    A curve is a list of knots, an angle and a value from 0 to 1, angles ascending; linear between
    them and constant beyond. It is read at the middle of the collect.
    """

    off_nadir_deg: Curve = Field(
        [],
        description="Knots [off_nadir_deg, value], from 0 to 90; none for 1 everywhere.",
        examples=[[[0, 1], [45, 0.6]]],
    )
    sun_elevation_deg: Curve = Field(
        [],
        description="Knots [sun_elevation_deg, value], at the target, from -90 to 90; none for 1 "
        "everywhere.",
        examples=[[[10, 0.5], [40, 1]]],
    )


Preference = Literal["early", "off_nadir", "sun", "balance", "margin", "few_contacts"]


class ObjectiveIn(Body):
    """What a plan earns for an image when it is taken, and what when it is on the ground."""

    collected_share: Fraction = Field(
        1.0,
        description="The part of its worth that an image earns when it is taken. The rest it earns "
        "when its last bit is on the ground. Without resources images earn all when taken.",
    )
    half_life_s: float | None = Field(
        None,
        gt=0.0,
        description="The rest halves with every such time between the end of the collect and its "
        "last bit on the ground; null for no decay. With a `collected_share` of 1 nothing is left "
        "to halve.",
    )
    prefer: list[Preference] = Field(
        [],
        description="Secondary aims, in order, that never cost worth: `early` (least mean age), "
        "`off_nadir` (least mean angle), `sun` (highest mean sun elevation), `balance` (least "
        "share of the busiest satellite), `margin` (highest lowest battery), `few_contacts`. An "
        "aim may cost those before it a hundredth at most. A replan leaves them aside: it changes "
        "as little as it must.",
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
    """Shows the short names in the schema of what is sent and of what is answered alike.

    Two schemas of one thing would give it two names, and generated clients would lose both.
    """

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        names = {"type": "string", "enum": list(get_args(ObjectiveName))}
        return {"anyOf": [handler(schema), names]}


AnyObjective = Annotated[ObjectiveIn, BeforeValidator(_objective_named), _OrShortName()]


def default_objective(types: Iterable[object]) -> ObjectiveIn:
    """Return what a new question earns that does not say it, by the types of its satellites."""
    is_of_paper = all(name in ("paper", "paper_code") for name in types)
    return ObjectiveIn() if is_of_paper else DEFAULT_OBJECTIVE


def _without_default(schema: JsonSchemaValue) -> None:
    schema.pop("default", None)


class Question(Body):
    """What scenarios and scenario files share."""

    name: Name | None = None
    horizon: HorizonIn
    use_resources: bool = Field(
        True, description="False: no contacts, no sun-pointing, no battery and recorder limits."
    )
    dynamics: Open[Dynamics] = Field(
        "physical", description="How battery and recorder are integrated."
    )
    collect_spacing_s: Duration | None = Field(
        None, description="Several collects per access, this far apart; null for one, centred."
    )
    collect_alignment: Open[CollectAlignment] = Field(
        "access",
        description="Whether those start from each access's own start on, or at multiples of "
        "collect_spacing_s from the horizon's start.",
    )
    continuous_starts: bool = Field(
        False,
        description="A solver may place a collect anywhere inside its access; not with `quality`.",
    )
    quality: QualityIn = QualityIn()
    objective: AnyObjective = Field(
        ObjectiveIn(),
        description="What a plan is to earn. `collected` is short for a collected_share of 1, "
        "`delivered` for 0; `paper` is the same as `collected`. Left out, it is a collected_share "
        "of 0.9 with `early` and `off_nadir` preferred; `paper` where all satellites are of the "
        "types `paper` and `paper_code`, and in files of the first release.",
        # What it is by default hangs on the satellites.
        json_schema_extra=_without_default,
    )
    allow_old_elements: bool = Field(
        False,
        description="Plan with element sets that are more than 30 days from their epoch "
        "(low orbits), which is refused otherwise.",
    )
    pins: PinsIn = PinsIn()
    outages: list[PlacedOutage] = Field(
        [],
        max_length=10_000,
        description="What is known to be out, and when. Those stored under `/v1/outages` that "
        "concern the scenario are added when it is stored.",
    )
    states: list[StateIn] = Field(
        [],
        max_length=10_000,
        description="Battery, recorder and attitude of satellites before the horizon begins, at "
        "most one state of each. Without, their `resources` say what they have at its start.",
    )


class ScenarioIn(Question):
    """A planning question over what is stored."""

    satellite_ids: list[Id] = Field(min_length=1, max_length=10_000)
    target_catalog_ids: list[Id] = Field(min_length=1, max_length=1000)
    ground_station_ids: list[Id] = Field([], max_length=10_000)
    forecast_id: Id | None = Field(
        None, description="What it says of the targets is frozen with the scenario."
    )


class FileSatellite(WholeSatellite):
    """A satellite of a scenario file.

    Of a `spacecraft` that is built in, and in files of release 2, it takes what it leaves out.
    """

    spacecraft: BuiltIn | None = Field(None, description="A type that is built in.")

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
            description="By id of the target, one for each of `times`.",
        )
    )


class FileForecast(Body):
    """What a forecast says of the targets, frozen with the question."""

    default_clear_probability: float | None = Field(
        None, ge=0, le=1, description="Of targets and instants that no series covers."
    )
    series: Annotated[list[SkySeriesIn], FailFast()] = Field([], max_length=1_000_000)


class FileTarget(TargetIn):
    """A target of a scenario file."""

    catalog_id: Id | None = Field(None, description="The catalogue it came from.")


class ScenarioFile(Question):
    """A self-contained scenario, as ``GET /v1/scenarios/{id}?expand=true`` answers it."""

    release: Literal[1, 2] = Field(
        1,
        description="Of the file's form. In files of the first release satellites have the paper's "
        "figures where they leave them out, from the second on those of `generic_optical`.",
    )
    # The first thing that is wrong is told: of a whole file of them each would take memory.
    satellites: Annotated[list[FileSatellite], FailFast()] = Field(min_length=1, max_length=10_000)
    targets: Annotated[list[FileTarget], FailFast()] = Field(min_length=1, max_length=1_000_000)
    ground_stations: Annotated[list[FileGroundStation], FailFast()] = Field([], max_length=10_000)
    forecast: FileForecast | None = Field(None, description="Null to take every sky for clear.")
    replan: ReplanOfFile | None = Field(
        None, description="The plan that this one goes on from, as a replan makes it."
    )

    @model_validator(mode="before")
    @classmethod
    def _with_types(cls, value: object) -> object:
        """Give satellites the figures of their types; what is no such file is told later."""
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
    """How much the scenario holds."""

    satellites: int
    targets: int
    ground_stations: int


class ScenarioSummary(Stored):
    """A frozen question without its pins, as lists have it."""

    id: str
    sha256: str = Field(description="Of the canonical content, the name left out.")
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
        None, description="Where clear skies came from; null where the file had them, or none."
    )
    has_forecast: bool = False
    counts: Counts
    warnings: tuple[str, ...] = Field(
        description="About old orbits and what is nearly always a mistake, for people."
    )
    created_at: Instant
    links: dict[str, str]


class ScenarioOut(ScenarioSummary):
    """A frozen question. Later edits of what it names change nothing in it."""

    pins: PinsIn = PinsIn()
    outages: tuple[PlacedOutage, ...] = Field(
        (), description="With the `id` of each that was taken from `/v1/outages`."
    )
    states: tuple[StateIn, ...] = Field((), description="What satellites had before the horizon.")


class ViewOut(Wire):
    """What satellite and place see of each other at one instant."""

    off_nadir_deg: float
    elevation_deg: float
    azimuth_deg: float
    range_km: float
    sun_elevation_deg: float
    eclipse: bool


class OpportunityOut(Wire):
    """A collect or a contact that a plan may take. Angles and range hold at its middle."""

    id: str
    satellite_id: str
    satellite_name: str | None = None
    kind: Open[Kind]
    target_id: str | None = Field(description="Of a collect.")
    target_name: str | None = Field(None, description="Of a collect whose target has one.")
    station_id: str | None = Field(description="Of a contact.")
    station_name: str | None = Field(None, description="Of a contact.")
    start: Instant
    end: Instant
    access_start: Instant = Field(
        description="The opportunity lies within its access, cut to the release and due times."
    )
    access_end: Instant
    off_nadir_deg: float = Field(description="At the satellite, from the nadir named below.")
    elevation_deg: float = Field(description="At the target or station.")
    azimuth_deg: float = Field(description="Of the satellite, from north over east.")
    sun_elevation_deg: float = Field(description="At the target or station.")
    range_km: float = Field(description="From the satellite to the target or station.")
    eclipse: bool = Field(description="The satellite is in the Earth's shadow.")
    nadir: Open[Nadir] = Field(description="What off-nadir angles are measured from.")
    at_start: ViewOut | None = Field(None, description="With `edges=true`.")
    at_end: ViewOut | None = Field(None, description="With `edges=true`.")
