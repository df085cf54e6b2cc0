"""Plans with a life: drafts that are approved, published, superseded or withdrawn."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field

from service.wire.base import Body, Id, Instant, Name, Open, Reason, Stored, Wire
from service.wire.pins import AttitudeIn, OnBoardIn, PinnedMode
from service.wire.scenarios import HorizonOut
from service.wire.timelines import Validity, ViolationOut

PlanState = Literal["draft", "approved", "published", "superseded", "withdrawn"]
Outcome = Literal["executed", "failed", "skipped", "partial"]
MAX_WAIVERS: Final = 1000
MAX_REPORTED: Final = 10_000

TRANSITIONS: Final[dict[PlanState, tuple[PlanState, ...]]] = {
    "draft": ("approved", "withdrawn"),
    "approved": ("published", "withdrawn"),
    "published": ("withdrawn",),
    "superseded": (),
    "withdrawn": (),
}
"""What a caller may ask for; ``superseded`` comes by publishing another plan."""


class PlanIn(Body):
    """A job's plan, to be taken into operations."""

    job_id: Id = Field(description="A job that has a timeline.")
    name: Name | None = None


class WaiverIn(Body):
    """A violation that somebody answers for."""

    violation: Id = Field(
        description="Its place in the plan's `violations`, such as `/violations/0`, or a code for "
        "all with that code.",
    )
    reason: Reason


class TransitionIn(Body):
    """A step in a plan's life."""

    to: Literal["approved", "published", "withdrawn"]
    reason: Reason | None = Field(None, description="Why, for the history.")
    effective_from: Instant | None = Field(
        None,
        description="Of `published`: from when on the plan is in force; by default from now, but "
        "not before its horizon.",
    )
    waivers: list[WaiverIn] = Field(
        [], max_length=MAX_WAIVERS, description="Of `approved`: for each violation of the plan."
    )


class WaiverOut(Wire):
    """A violation that somebody answered for."""

    violation: str
    reason: str


class PlanSatelliteOut(Wire):
    """A satellite of a plan, and when the plan is in force for it."""

    satellite_id: str
    satellite_name: str
    in_force_from: Instant | None = Field(description="Null until the plan is published.")
    in_force_until: Instant | None = Field(description="Null while nothing has ended it.")


class PlanOut(Stored):
    """A plan as it stands."""

    id: str
    name: str | None
    state: Open[PlanState]
    owner: str
    job_id: str
    parent_id: str | None = Field(description="The plan that this one changes.")
    plan_sha256: str
    horizon: HorizonOut
    validity: Open[Validity]
    violations: tuple[ViolationOut, ...] = Field(description="To be waived on approval.")
    satellites: tuple[PlanSatelliteOut, ...]
    allowed: tuple[Open[PlanState], ...] = Field(description="Where it can go from here.")
    created_at: Instant
    links: dict[str, str]


class PlanActionOut(Wire):
    """A collect or a contact, and what became of it as far as that was reported."""

    id: str = Field(description="As in the timeline; executions name it.")
    satellite_id: str
    satellite_name: str | None
    mode: Open[PinnedMode]
    start: Instant
    end: Instant
    target_id: str | None
    target_name: str | None
    station_id: str | None
    station_name: str | None
    outcome: Open[Outcome] | None = Field(description="The last that was reported.")


class PlanEventOut(Wire):
    """One transition: who, when and why."""

    at: Instant
    from_state: Open[PlanState] | None = Field(description="Null for a new plan.")
    to_state: Open[PlanState]
    owner: str
    key_name: str | None = Field(description="Null without a key.")
    reason: str | None
    effective_from: Instant | None
    waivers: tuple[WaiverOut, ...]


class ExecutionIn(Body):
    """What became of one action."""

    action_id: Id
    outcome: Outcome
    at: Instant | None = Field(None, description="When it was done or failed.")
    mbit: float | None = Field(None, ge=0, le=1e12, description="Megabits taken or brought down.")
    detail: Reason | None = None


class ExecutionOut(Wire):
    """A report, as it came."""

    id: str
    action_id: str
    outcome: Open[Outcome]
    at: Instant | None
    mbit: float | None
    detail: str | None
    owner: str
    key_name: str | None
    reported_at: Instant


class PlanStateOut(Wire):
    """Telemetry, as it came."""

    id: str
    satellite_id: str
    at: Instant
    battery_fraction: float | None
    recorder_fraction: float | None
    attitude: AttitudeIn | None
    on_board: list[OnBoardIn] | None
    owner: str
    key_name: str | None
    reported_at: Instant


class StatesReportedOut(Wire):
    """What was taken down of telemetry."""

    states: tuple[PlanStateOut, ...]


class ReportedOut(Wire):
    """What was taken down of a report."""

    executions: tuple[ExecutionOut, ...]


class PlanChange(Wire):
    """What an event tells of a plan: enough to decide whether to fetch the rest."""

    plan_id: str
    state: Open[PlanState]
    name: str | None
    job_id: str
    parent_id: str | None
    reason: str | None
    effective_from: Instant | None
    links: dict[str, str]
