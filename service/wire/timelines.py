"""Timelines: plans as the referee replayed them, by satellite."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field

from service.wire.base import Instant, Json, Open, Wire
from service.wire.satellites import Nadir
from service.wire.scenarios import HorizonOut, Preference

Mode = Literal["collect", "contact", "sunpoint", "hold"]
IDLE_MODES: Final = ("sunpoint", "hold")
Validity = Literal["valid", "inherited", "violations"]
Outcome = Literal["downlinked", "collected", "unscheduled", "excluded"]


class SolverUsed(Wire):
    """The solver that made the plan; with the same settings it gives the same `plan_sha256`."""

    name: str
    version: str
    params: Json
    seed: int


class RuntimeOut(Wire):
    """Seconds of each phase of the job."""

    access: float
    compile: float
    solve: float
    verify: float


class ViolationOut(Wire):
    """A rule that the plan breaks."""

    code: str = Field(
        description="`slew`, `overlap`, `window`, `battery`, `recorder`, `duplicate`, `station`, "
        "`pin`, `outage`; more may be added. A plan whose only violations are `duplicate` is valid."
    )
    satellite_id: str
    satellite_name: str | None = None
    at: Instant
    needed: float = Field(description="What the rule requires, in seconds or as a fraction.")
    available: float = Field(description="What the plan leaves, in the same unit.")
    actions: tuple[str, ...] = Field(description="Ids of the actions involved.")
    detail: str
    inherited: bool = Field(
        False,
        description="Whether it existed at the start or results from frozen actions; no freely "
        "planned action contributes to it.",
    )


class SpreadOut(Wire):
    """Mean and median of a figure over all images."""

    mean: float
    median: float


class AgesOut(SpreadOut):
    """Ages of images when their last bit is on the ground, in seconds."""

    p90: float = Field(description="90th percentile.")
    max: float


class ImageFiguresOut(Wire):
    """Figures of the images that earn, one of each target."""

    images: int | None = Field(None, description="Number of these images.")
    expected_clear: float | None = Field(
        None, description="Expected number of clear ones; null without a forecast."
    )
    night_images: int | None = Field(
        None, description="Number of those with the sun below the target's horizon."
    )
    off_nadir_deg: SpreadOut | None = Field(
        None, description="At the middle of each image; null if there are none."
    )
    quality_mean: float | None = Field(None, description="Null if there are no images.")


class PreferredOut(Wire):
    """A secondary aim, before and after the plan was improved for it at the same worth."""

    aim: Open[Preference]
    before: float = Field(
        description="`early`: mean age in seconds, an image that stays on board counting as the "
        "whole horizon; `off_nadir`, `sun`: mean angle in degrees; `balance`: the busiest "
        "satellite's share of all images; `margin`: lowest battery level, as a fraction; "
        "`few_contacts`: number of contacts."
    )
    after: float


class TotalsOut(ImageFiguresOut):
    """Totals of the plan, computed by the referee."""

    reward: float
    bound: float | None = Field(description="Proven: no plan of the scenario can earn more.")
    gap: float | None = Field(description="`(bound - reward) / bound`.")
    bound_proof: str | None = Field(
        description="`milp`, `lagrangian`, `dp`, `linear` or `totals`; more may be added."
    )
    collects: int
    contacts: int
    targets: dict[Open[Outcome], int] = Field(
        description="Number of targets by outcome; together all of the scenario."
    )
    downlinked_mbit: float | None = Field(
        description="Null if a recorder has no capacity in megabits."
    )
    downlinked_fraction: float | None = Field(
        description="Sum over satellites, each in multiples of its recorder's capacity."
    )
    battery_min_fraction: float | None = Field(description="Lowest level of any battery.")
    recorder_max_fraction: float | None = Field(description="Highest level of any recorder.")
    delivered: int | None = Field(
        None,
        description="Number of images on the ground by the end of the horizon; null without "
        "resources, as there are no contacts.",
    )
    age_s: AgesOut | None = Field(
        None,
        description="Ages of those, from the end of the collect to the last bit on the ground.",
    )
    on_board_mbit_end: float | None = Field(
        None,
        description="Data on all recorders at the end, telemetry included; null if a recorder has "
        "no capacity in megabits.",
    )
    preferred: list[PreferredOut] = Field(
        [], description="Results for the objective's `prefer`, in its order."
    )


class SlewOut(Wire):
    """The slew before an action."""

    angle_deg: float
    needed_s: float = Field(description="Including settling.")
    available_s: float


class ActionOut(Wire):
    """One action of a satellite."""

    id: str
    mode: Open[Mode] = Field(
        description="Idle time is `sunpoint`, with the panels at the sun, charging in sunlight, "
        "or `hold`, if there is no time to slew to the sun and back."
    )
    start: Instant
    end: Instant
    target_id: str | None
    target_name: str | None = Field(None, description="For a collect whose target has a name.")
    station_id: str | None
    station_name: str | None = Field(None, description="Only for a contact.")
    opportunity_id: str | None
    off_nadir_deg: float | None = Field(description="At the middle of the action.")
    azimuth_deg: float | None
    slew: SlewOut | None
    turn_to_s: float | None = Field(
        None, description="For `sunpoint`: the slew to the sun, which ends at its start."
    )
    turn_back_s: float | None = Field(
        None, description="For `sunpoint`: the slew from the sun, which begins at its end."
    )
    reward: float = Field(description="What the plan earns by it.")
    worth: float | None = Field(
        None,
        description="For a collect: the worth of its image by itself in this plan: the target's "
        "reward at its start times quality and clear_probability, and of that the part that the "
        "`objective` lets it earn.",
    )
    quality: float | None = Field(
        None, description="For a collect: the share of its target's reward that its image is worth."
    )
    clear_probability: float | None = Field(
        None, description="For a collect: probability of a clear sky; null without a forecast."
    )
    delivered_at: Instant | None = Field(
        None,
        description="For a collect: when the last bit of its image is on the ground (first in, "
        "first out); null for never.",
    )
    age_s: float | None = Field(None, description="From the end of the collect to that instant.")
    battery_fraction_end: float | None
    recorder_fraction_end: float | None


class ResourceCurvesOut(Wire):
    """Battery and recorder levels over time, linear between the instants, with their limits."""

    time: tuple[Instant, ...]
    battery_fraction: tuple[float, ...]
    recorder_fraction: tuple[float, ...]
    battery_min_fraction: float
    recorder_max_fraction: float


class SatelliteTotalsOut(ImageFiguresOut):
    """Totals of one satellite."""

    reward: float
    collects: int
    contacts: int
    delivered: int | None = Field(description="As in the plan's totals.")
    age_s: AgesOut | None
    on_board_mbit_end: float | None


class OnBoardOut(Wire):
    """The delivery of an image that the recorder held when the horizon began."""

    target_id: str
    collected_at: Instant
    mbit: float | None = Field(
        description="Data still to be downlinked; null if the recorder has no size in megabits."
    )
    recorder_fraction: float
    worth: float
    delivered_at: Instant | None = Field(description="Null for never.")
    age_s: float | None
    reward: float = Field(description="What it earns by coming down.")


class SatelliteTimelineOut(Wire):
    """The actions of one satellite, in order."""

    id: str
    name: str
    actions: tuple[ActionOut, ...]
    on_board: tuple[OnBoardOut, ...] = Field(
        (), description="Images that its recorder held at the start, in order of downlink."
    )
    totals: SatelliteTotalsOut | None = None
    eclipses: tuple[HorizonOut, ...] = Field((), description="Spans in the Earth's shadow.")
    resources: ResourceCurvesOut | None = Field(description="Null without resources.")


class ModelsOut(Wire):
    """The physics behind the accesses."""

    propagation: str = "SGP4"
    gravity: str = Field("WGS72", description="Gravity model of the element sets.")
    earth_orientation: str = "IERS daily dUT1 and polar motion"
    nadir: dict[str, Open[Nadir]] = Field({}, description="By satellite.")


class TimelineHead(Wire):
    """A timeline without its satellites."""

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
    validity: Open[Validity] = Field(
        description="`inherited`: all violations existed at the horizon's start or result from "
        "frozen actions; no freely planned action contributes to them."
    )
    violations: tuple[ViolationOut, ...]
    totals: TotalsOut
    warnings: tuple[str, ...]
    models: ModelsOut


class TimelineOut(TimelineHead):
    """A plan, judged by the referee."""

    satellites: tuple[SatelliteTimelineOut, ...]
