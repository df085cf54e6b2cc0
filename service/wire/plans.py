"""Plans and their life cycle: drafts that are approved, published, superseded or withdrawn."""

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
"""Transitions that a caller may request; publishing a plan makes others ``superseded``."""


class PlanIn(Body):
    """A job's plan to take into operations."""

    job_id: Id = Field(description="A job that has a timeline.")
    name: Name | None = None


class WaiverIn(Body):
    """A violation that somebody accepts responsibility for."""

    violation: Id = Field(
        description="JSON pointer to it in the plan, such as `/violations/0`, or a code for all "
        "violations with that code.",
    )
    reason: Reason


class TransitionIn(Body):
    """A transition of a plan."""

    to: Literal["approved", "published", "withdrawn"]
    reason: Reason | None = Field(None, description="Why, for the history.")
    effective_from: Instant | None = Field(
        None,
        description="For `published`: when the plan comes into force; by default now, but not "
        "before its horizon.",
    )
    waivers: list[WaiverIn] = Field(
        [], max_length=MAX_WAIVERS, description="For `approved`: covering each of its violations."
    )


class WaiverOut(Wire):
    """A violation that somebody accepted responsibility for."""

    violation: str
    reason: str


class PlanSatelliteOut(Wire):
    """A satellite of a plan, and when the plan is in force for it."""

    satellite_id: str
    satellite_name: str
    in_force_from: Instant | None = Field(description="Null until the plan is published.")
    in_force_until: Instant | None = Field(description="Null while nothing has ended it.")


class PlanOut(Stored):
    """A plan in its present state."""

    id: str
    name: str | None
    state: Open[PlanState]
    owner: str
    job_id: str
    parent_id: str | None = Field(description="The plan that this replan follows.")
    plan_sha256: str
    horizon: HorizonOut
    validity: Open[Validity]
    violations: tuple[ViolationOut, ...] = Field(description="To be waived on approval.")
    satellites: tuple[PlanSatelliteOut, ...]
    allowed: tuple[Open[PlanState], ...] = Field(description="States it can be moved to.")
    created_at: Instant
    links: dict[str, str]


class PlanActionOut(Wire):
    """A collect or a contact, and its outcome if one was reported."""

    id: str = Field(description="As in the timeline; execution reports refer to it.")
    satellite_id: str
    satellite_name: str | None
    mode: Open[PinnedMode]
    start: Instant
    end: Instant
    target_id: str | None
    target_name: str | None
    station_id: str | None
    station_name: str | None
    outcome: Open[Outcome] | None = Field(description="The last one reported.")


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
    """The outcome of one action."""

    action_id: Id
    outcome: Outcome
    at: Instant | None = Field(None, description="When it was done or failed.")
    mbit: float | None = Field(None, ge=0, le=1e12, description="Megabits recorded or downlinked.")
    detail: Reason | None = None


class ExecutionOut(Wire):
    """An execution report, as received."""

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
    """Telemetry, as received."""

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
    """The telemetry that was stored."""

    states: tuple[PlanStateOut, ...]


class ReportedOut(Wire):
    """The execution reports that were stored."""

    executions: tuple[ExecutionOut, ...]


class PlanChange(Wire):
    """The data of an event about a plan: enough to decide whether to fetch the rest."""

    plan_id: str
    state: Open[PlanState]
    name: str | None
    job_id: str
    parent_id: str | None
    reason: str | None
    effective_from: Instant | None
    links: dict[str, str]
