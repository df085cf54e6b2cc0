"""What a job answers: its progress, its timeline, and what became of each target."""

from __future__ import annotations

from datetime import datetime

from service.client.shapes import Horizon, Json, Shape


class ScenarioRef(Shape):
    """Which question a job answers."""

    id: str
    sha256: str


class Progress(Shape):
    """How far the work is; ``fraction`` counts within the phase."""

    phase: str
    fraction: float
    reward: float | None = None
    bound: float | None = None
    message: str = ""


class Limits(Shape):
    """What a job may use."""

    time_s: float
    memory_mb: int


class Failure(Shape):
    """Why a job failed."""

    code: str
    detail: str


class Slew(Shape):
    """The turn to an action, settling included."""

    angle_deg: float
    needed_s: float
    available_s: float


class Action(Shape):
    """One action of a plan, as the referee saw it."""

    id: str
    mode: str
    start: datetime
    end: datetime
    target_id: str | None
    station_id: str | None
    opportunity_id: str | None
    off_nadir_deg: float | None
    azimuth_deg: float | None
    slew: Slew | None
    reward: float
    battery_fraction_end: float | None
    recorder_fraction_end: float | None


class ResourceCurves(Shape):
    """Battery and recorder over time, and their limits."""

    time: tuple[datetime, ...]
    battery_fraction: tuple[float, ...]
    recorder_fraction: tuple[float, ...]
    battery_min_fraction: float
    recorder_max_fraction: float


class SatelliteTimeline(Shape):
    """What one satellite does."""

    id: str
    name: str
    actions: tuple[Action, ...]
    resources: ResourceCurves | None


class Violation(Shape):
    """A rule that the plan breaks."""

    code: str
    satellite_id: str
    at: datetime
    needed: float
    available: float
    detail: str


class Totals(Shape):
    """The plan in numbers; ``targets`` counts them by outcome."""

    reward: float
    bound: float | None
    gap: float | None
    bound_proof: str | None
    collects: int
    contacts: int
    targets: dict[str, int]
    downlinked_mbit: float | None
    downlinked_fraction: float | None
    battery_min_fraction: float | None
    recorder_max_fraction: float | None


class SolverUsed(Shape):
    """Who made the plan, and how."""

    name: str
    version: str
    params: Json
    seed: int


class Timeline(Shape):
    """The plan, judged. ``runtime_s`` is by phase."""

    schema_version: str
    job: str
    scenario_sha256: str
    plan_sha256: str
    solver: SolverUsed
    horizon: Horizon
    termination: str
    runtime_s: dict[str, float]
    validity: str
    violations: tuple[Violation, ...]
    totals: Totals
    warnings: tuple[str, ...] = ()
    satellites: tuple[SatelliteTimeline, ...]


class Reason(Shape):
    """Why a target was left out; ``blocking_actions`` are those in its way."""

    code: str
    certainty: str
    detail: str = ""
    blocking_actions: tuple[str, ...] = ()
    opportunity_id: str | None = None
    at: datetime | None = None
    change: Json | None = None


class TargetOutcome(Shape):
    """What became of one target."""

    target_id: str
    target_catalog_id: str | None = None
    outcome: str
    action_id: str | None = None
    satellite_id: str | None = None
    reason: Reason | None = None


class Attempt(Shape):
    """One opportunity of a target, tried in the plan; ``displaces`` are ids of actions."""

    opportunity_id: str
    satellite_id: str
    start: datetime
    end: datetime
    violations: tuple[Violation, ...]
    displaces: tuple[str, ...]
    fits_instead: bool
    reward_delta: float | None
    ruled_out: bool


class Explanation(TargetOutcome):
    """A target gone through opportunity by opportunity.

    Each of ``access_changes`` would give it one, and can be the ``relax`` of a what-if.
    """

    opportunities: tuple[Attempt, ...]
    access_changes: tuple[Json, ...]


class Planned(Shape):
    """A collect or a contact."""

    satellite_id: str
    mode: str
    target_id: str | None
    station_id: str | None
    start: datetime
    end: datetime


class Moved(Shape):
    """What is done at another time."""

    before: Planned
    after: Planned


class TotalDiff(Shape):
    """A figure that differs; ``delta`` is after less before."""

    before: float | None
    after: float | None
    delta: float | None


class PlanDiff(Shape):
    """From the plan of the job ``before`` to that of the job ``after``."""

    before: str
    after: str
    is_empty: bool
    questions_differ_in: tuple[str, ...]
    added: tuple[Planned, ...]
    removed: tuple[Planned, ...]
    moved: tuple[Moved, ...]
    totals: dict[str, TotalDiff]


class ComparedRun(Shape):
    """One line of a comparison; its figures are None until there is a timeline."""

    job_id: str
    state: str
    solver: str
    params: Json
    seed: int
    progress: Progress | None
    termination: str | None
    error: Failure | None
    reward: float | None
    bound: float | None
    gap: float | None
    bound_proof: str | None
    collects: int | None
    contacts: int | None
    downlinked_mbit: float | None
    downlinked_fraction: float | None
    solve_s: float | None
    runtime_s: float | None
    validity: str | None
    plan_sha256: str | None
