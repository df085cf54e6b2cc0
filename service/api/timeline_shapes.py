"""What timelines and proofs look like, for the OpenAPI document.

Jobs store these answers as finished text (``service.documents``), which is sent as it stands:
nothing is built from these classes, and the tests hold every answer against their schema.
"""

from __future__ import annotations

from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.api.shapes import Instant


class _Answer(BaseModel):
    model_config = ConfigDict(extra="allow")


class SolverUsed(_Answer):
    """What made the plan: the same once more gives the same `plan_sha256`."""

    name: str
    version: str
    params: dict[str, Any]
    seed: int


class HorizonOut(_Answer):
    """The span that is planned."""

    start: Instant
    end: Instant


class RuntimeOut(_Answer):
    """Seconds of each phase of the job."""

    access: float
    compile: float
    solve: float
    verify: float


class ViolationOut(_Answer):
    """A rule that the plan breaks."""

    code: str = Field(
        description="`slew`, `overlap`, `window`, `battery`, `recorder`, `duplicate`, `station`; "
        "more may be added. A plan whose only violations are `duplicate` is valid."
    )
    satellite_id: str
    at: Instant
    needed: float = Field(description="What the rule asks for, in seconds or as a fraction.")
    available: float = Field(description="What the plan leaves, in the same unit.")
    actions: list[str] = Field(description="Ids of the actions in question.")
    detail: str


class OutcomeCounts(_Answer):
    """How many targets came to what; together all of the scenario."""

    downlinked: int
    collected: int
    unscheduled: int
    excluded: int


class TotalsOut(_Answer):
    """The plan in numbers, as the referee found them."""

    reward: float
    bound: float | None = Field(description="Proven: no plan of the scenario can earn more.")
    gap: float | None = Field(description="`(bound - reward) / bound`.")
    bound_proof: str | None = Field(
        description="`milp`, `lagrangian`, `dp` or `totals`; more may be added."
    )
    collects: int
    contacts: int
    targets: OutcomeCounts
    downlinked_mbit: float | None = Field(
        description="Null where a recorder has no capacity in megabits."
    )
    downlinked_fraction: float | None = Field(description="In recorder capacities.")
    battery_min_fraction: float | None = Field(description="The lowest charge of any satellite.")
    recorder_max_fraction: float | None = Field(description="The highest fill of any recorder.")


class SlewOut(_Answer):
    """The turn before an action."""

    angle_deg: float
    needed_s: float = Field(description="Settling included.")
    available_s: float


class ActionOut(_Answer):
    """One thing that a satellite does."""

    id: str
    mode: Literal["collect", "contact", "sunpoint"]
    start: Instant
    end: Instant
    target_id: str | None
    station_id: str | None
    opportunity_id: str | None
    off_nadir_deg: float | None = Field(description="At the middle of the action.")
    azimuth_deg: float | None
    slew: SlewOut | None
    reward: float
    battery_fraction_end: float | None
    recorder_fraction_end: float | None


class ResourceCurvesOut(_Answer):
    """Battery and recorder over time, straight between the instants, with their limits."""

    time: list[Instant]
    battery_fraction: list[float]
    recorder_fraction: list[float]
    battery_min_fraction: float
    recorder_max_fraction: float


class SatelliteTimelineOut(_Answer):
    """What one satellite does, in order."""

    id: str
    name: str
    actions: list[ActionOut]
    resources: ResourceCurvesOut | None = Field(description="Null without resources.")


class TimelineOut(_Answer):
    """A plan, judged by the referee."""

    schema_version: str
    job: str
    scenario_sha256: str
    plan_sha256: str
    solver: SolverUsed
    horizon: HorizonOut
    dynamics: str
    use_resources: bool
    termination: str
    runtime_s: RuntimeOut
    validity: Literal["valid", "violations"]
    violations: list[ViolationOut]
    totals: TotalsOut
    warnings: list[Any]
    models: dict[str, Any] = Field(description="The physics behind the accesses.")
    satellites: list[SatelliteTimelineOut]


class ProofOut(_Answer):
    """What proves a bound: planner_core checks it without any search."""

    version: Any
    proof: str = Field(description="The argument: `milp`, `lagrangian`, `dp` or `totals`.")
    value: float = Field(description="The bound.")
    prices: list[float] | None = Field(
        None, description="A multiplier for each target, in the order of the scenario."
    )
    elementary: bool | None = Field(
        None, description="Whether the prices are for paths that take a target once in each pass."
    )


JSON_TIMELINE: Final = {"application/json": {"schema": {"$ref": "#/components/schemas/Timeline"}}}
JSON_PROOF: Final = {
    "application/json": {
        "schema": {"anyOf": [{"$ref": "#/components/schemas/Proof"}, {"type": "null"}]}
    }
}
"""For ``responses=``, by media type."""
