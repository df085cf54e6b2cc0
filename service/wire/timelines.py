"""Timelines: a plan as the referee found it, satellite by satellite."""

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
    """What made the plan: the same once more gives the same `plan_sha256`."""

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
    needed: float = Field(description="What the rule asks for, in seconds or as a fraction.")
    available: float = Field(description="What the plan leaves, in the same unit.")
    actions: tuple[str, ...] = Field(description="Ids of the actions in question.")
    detail: str
    inherited: bool = Field(
        False,
        description="It held at the start, or what is frozen leads to it; no action that was free "
        "to be planned has a part in it.",
    )


class SpreadOut(Wire):
    """A figure over all images."""

    mean: float
    median: float


class AgesOut(SpreadOut):
    """How old images are when their last bit is on the ground, in seconds."""

    p90: float = Field(description="Nine of ten are no older.")
    max: float


class ImageFiguresOut(Wire):
    """Of the images that earn, one of each target."""

    images: int | None = Field(None, description="How many there are.")
    expected_clear: float | None = Field(
        None, description="How many of them are clear on average; null without a forecast."
    )
    night_images: int | None = Field(
        None, description="Those with the sun below the target's horizon."
    )
    off_nadir_deg: SpreadOut | None = Field(
        None, description="At the middle of each; null where there is none."
    )
    quality_mean: float | None = Field(None, description="Null where there is none.")


class PreferredOut(Wire):
    """What a plan of the same worth was made to be like: before and after."""

    aim: Open[Preference]
    before: float = Field(
        description="`early`: mean age in seconds, an image that stays on board as old as the "
        "horizon; `off_nadir`, `sun`: mean angle in degrees; `balance`: the busiest satellite's "
        "share of all images; `margin`: lowest battery, as a fraction; `few_contacts`: how many."
    )
    after: float


class TotalsOut(ImageFiguresOut):
    """The plan in numbers, as the referee found them."""

    reward: float
    bound: float | None = Field(description="Proven: no plan of the scenario can earn more.")
    gap: float | None = Field(description="`(bound - reward) / bound`.")
    bound_proof: str | None = Field(
        description="`milp`, `lagrangian`, `dp` or `totals`; more may be added."
    )
    collects: int
    contacts: int
    targets: dict[Open[Outcome], int] = Field(
        description="How many came to what; together all of the scenario."
    )
    downlinked_mbit: float | None = Field(
        description="Null where a recorder has no capacity in megabits."
    )
    downlinked_fraction: float | None = Field(
        description="In multiples of what the recorders hold."
    )
    battery_min_fraction: float | None = Field(description="The lowest charge of any satellite.")
    recorder_max_fraction: float | None = Field(description="The highest fill of any recorder.")
    delivered: int | None = Field(
        None,
        description="How many of these images are on the ground by the end of the horizon; null "
        "without resources, as there are no contacts.",
    )
    age_s: AgesOut | None = Field(
        None, description="Of those, from the end of the collect to the last bit on the ground."
    )
    on_board_mbit_end: float | None = Field(
        None,
        description="What recorders hold at the end, telemetry included; null where a recorder "
        "has no capacity in megabits.",
    )
    preferred: list[PreferredOut] = Field(
        [], description="What the objective's `prefer` came to, in its order."
    )


class SlewOut(Wire):
    """The turn before an action."""

    angle_deg: float
    needed_s: float = Field(description="Settling included.")
    available_s: float


class ActionOut(Wire):
    """One thing that a satellite does."""

    id: str
    mode: Open[Mode] = Field(
        description="In idle time `sunpoint`, at the sun with panels that charge in sunlight, or "
        "`hold`, where there is no time to turn to it and back."
    )
    start: Instant
    end: Instant
    target_id: str | None
    target_name: str | None = Field(None, description="Of a collect whose target has one.")
    station_id: str | None
    station_name: str | None = Field(None, description="Of a contact.")
    opportunity_id: str | None
    off_nadir_deg: float | None = Field(description="At the middle of the action.")
    azimuth_deg: float | None
    slew: SlewOut | None
    turn_to_s: float | None = Field(
        None, description="Of `sunpoint`: the turn to the sun, which ends at its start."
    )
    turn_back_s: float | None = Field(
        None, description="Of `sunpoint`: the turn from the sun, which begins at its end."
    )
    reward: float = Field(description="What the plan earns with it.")
    worth: float | None = Field(
        None,
        description="Of a collect: what its image is worth by itself in this plan: the target's "
        "reward when it starts times quality and clear_probability, and of that what the "
        "`objective` lets it earn.",
    )
    quality: float | None = Field(
        None, description="Of a collect: what part of its target's reward its image is worth."
    )
    clear_probability: float | None = Field(
        None, description="Of a collect: that the sky is clear; null without a forecast."
    )
    delivered_at: Instant | None = Field(
        None,
        description="Of a collect: when the last bit of its image is on the ground, first in, "
        "first out; null for never.",
    )
    age_s: float | None = Field(None, description="From the end of the collect to that instant.")
    battery_fraction_end: float | None
    recorder_fraction_end: float | None


class ResourceCurvesOut(Wire):
    """Battery and recorder over time, straight between the instants, with their limits."""

    time: tuple[Instant, ...]
    battery_fraction: tuple[float, ...]
    recorder_fraction: tuple[float, ...]
    battery_min_fraction: float
    recorder_max_fraction: float


class SatelliteTotalsOut(ImageFiguresOut):
    """What one satellite has a part in."""

    reward: float
    collects: int
    contacts: int
    delivered: int | None = Field(description="As in the totals of all.")
    age_s: AgesOut | None
    on_board_mbit_end: float | None


class OnBoardOut(Wire):
    """What became of an image that the recorder held when the horizon began."""

    target_id: str
    collected_at: Instant
    mbit: float | None = Field(
        description="What was left of it; null where the recorder has no size in megabits."
    )
    recorder_fraction: float
    worth: float
    delivered_at: Instant | None = Field(description="Null for never.")
    age_s: float | None
    reward: float = Field(description="What it earns by coming down.")


class SatelliteTimelineOut(Wire):
    """What one satellite does, in order."""

    id: str
    name: str
    actions: tuple[ActionOut, ...]
    on_board: tuple[OnBoardOut, ...] = Field(
        (), description="Images that its recorder held at the start, the first to come down first."
    )
    totals: SatelliteTotalsOut | None = None
    eclipses: tuple[HorizonOut, ...] = Field((), description="Spans in the Earth's shadow.")
    resources: ResourceCurvesOut | None = Field(description="Null without resources.")


class ModelsOut(Wire):
    """The physics behind the accesses."""

    propagation: str = "SGP4"
    gravity: str = Field("WGS72", description="Of the element sets.")
    earth_orientation: str = "IERS daily dUT1 and polar motion"
    nadir: dict[str, Open[Nadir]] = Field({}, description="By satellite.")


class TimelineHead(Wire):
    """A timeline but for its satellites."""

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
        description="`inherited`: what is broken was so at the horizon's start, or what is frozen "
        "leads to it; no action that was free to be planned has a part in it."
    )
    violations: tuple[ViolationOut, ...]
    totals: TotalsOut
    warnings: tuple[str, ...]
    models: ModelsOut


class TimelineOut(TimelineHead):
    """A plan, judged by the referee."""

    satellites: tuple[SatelliteTimelineOut, ...]
