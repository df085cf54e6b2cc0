"""What clients send and see of jobs."""

from __future__ import annotations

from typing import Annotated, Any, Literal, cast

import sqlalchemy as sa
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from service.api import ask_again
from service.api.shapes import Body, Instant, Name
from service.db.rows import JobRow
from service.jobs.lease import JobState
from service.scenarios.inputs import ScenarioFile, ScenarioIn
from service.scenarios.pin_inputs import Id

Outcome = Literal["downlinked", "collected", "unscheduled", "excluded"]


class LimitsIn(Body):
    """What a job may use; the server's defaults where it says nothing."""

    time_s: float | None = Field(
        None, gt=0, description="Seconds of work; the search then answers with its best plan."
    )
    memory_mb: int | None = Field(
        None, ge=64, le=1_000_000, description="Megabytes; a job that holds more is failed."
    )


def _form(scenario: object) -> str:
    is_file = isinstance(scenario, ScenarioFile) or (
        isinstance(scenario, dict) and not {"satellites", "targets"}.isdisjoint(scenario)
    )
    return "file" if is_file else "stored"


InlineScenario = Annotated[
    Annotated[ScenarioIn, Tag("stored")] | Annotated[ScenarioFile, Tag("file")],
    Discriminator(_form),
]


class QuestionIn(Body):
    """A scenario to plan, stored or sent along, and what a job of it may use."""

    scenario_id: Id | None = Field(None, description="A stored scenario.")
    scenario: InlineScenario | None = Field(
        None,
        description="Instead of `scenario_id`: the body of `POST /v1/scenarios`, or a whole "
        "scenario file; it is stored with the job.",
    )
    limits: LimitsIn = LimitsIn()
    priority: int = Field(5, ge=0, le=9, description="9 is the most urgent.")
    label: Name | None = None


class SolverIn(Body):
    """A solver and how it is to search."""

    solver: str = Field(description="A name of `GET /v1/solvers`.")
    params: dict[str, Any] = Field({}, description="The solver's own; the others are defaults.")
    seed: int = Field(0, ge=0, lt=2**63, description="Same seed, same plan.")


class JobIn(QuestionIn, SolverIn):
    """A scenario, the solver that is to plan it, and how."""


class ScenarioRef(BaseModel):
    """Which question a job answers."""

    id: str
    sha256: str


class ProgressOut(BaseModel):
    """How far the work is; `fraction` counts within the phase."""

    phase: Literal["access", "compile", "solve", "verify"]
    fraction: float
    reward: float | None
    bound: float | None
    message: str


class LimitsOut(BaseModel):
    """What a job may use."""

    time_s: float
    memory_mb: int


class ErrorOut(BaseModel):
    """Why a job failed."""

    code: str
    detail: str


class JobOut(BaseModel):
    """A job as it stands."""

    id: str
    state: JobState
    scenario: ScenarioRef
    solver: str
    params: dict[str, Any]
    seed: int
    limits: LimitsOut
    attempt: int = Field(description="Grows when a job is started again; 1 at first.")
    priority: int
    label: str | None
    progress: ProgressOut | None
    created_at: Instant
    started_at: Instant | None
    finished_at: Instant | None
    termination: str | None = Field(description="Why the search ended.")
    error: ErrorOut | None
    change: dict[str, Any] | None = Field(
        None, description="Of a what-if: what was to be different from the job it varies."
    )
    links: dict[str, str]


class TargetItem(BaseModel):
    """What became of one target."""

    model_config = ConfigDict(extra="allow")

    target_id: str
    target_catalog_id: str | None = None
    outcome: str
    action_id: str | None = None
    satellite_id: str | None = None
    reason: dict[str, Any] | None = Field(description="Why it is not collected.")


def shown(job: JobRow, scenario_sha256: str) -> JobOut:
    """Return a job as clients see it."""
    address = f"/v1/jobs/{job.id}"
    return JobOut(
        id=job.id,
        state=cast(JobState, job.state),
        scenario=ScenarioRef(id=job.scenario_id, sha256=scenario_sha256),
        solver=job.solver,
        params=job.params,
        seed=job.seed,
        limits=LimitsOut(**job.limits),
        attempt=max(job.run, 1),
        priority=job.priority,
        label=job.label,
        progress=None if job.progress is None else ProgressOut(**job.progress),
        created_at=job.created_at,
        started_at=job.started_at,
        finished_at=job.finished_at,
        termination=job.termination,
        error=None if job.error is None else ErrorOut(**job.error),
        change=job.change,
        links={
            "self": address,
            "timeline": f"{address}/timeline",
            "targets": f"{address}/targets",
            "events": f"{address}/events",
            "scenario": f"/v1/scenarios/{job.scenario_id}",
        }
        | ({} if job.rerun_of is None else {"rerun_of": f"/v1/jobs/{job.rerun_of}"})
        | ({} if job.what_if_of is None else {"what_if_of": f"/v1/jobs/{job.what_if_of}"}),
    )


def etag_of_job(job: JobRow | sa.Row[Any]) -> str:
    """Return the ETag of a job's present form."""
    return f'"{job.version}"'


def headers_of(job: JobRow | sa.Row[Any]) -> dict[str, str]:
    """Return the headers that every answer about one job has."""
    headers = {"ETag": etag_of_job(job)}
    seconds = ask_again.seconds_until(job.state, job.created_at)
    return headers if seconds is None else headers | {"Retry-After": str(seconds)}


def etag_of_timeline(job_id: str) -> str:
    """Return the ETag of a job's timeline document, which never changes."""
    return f'"{job_id}"'
