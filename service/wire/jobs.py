"""Jobs, the questions they plan, what varies them, and comparisons of several."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import Discriminator, Field, Tag

from service.wire.base import Body, Free, Id, Instant, Json, Name, Open, Stored, Wire
from service.wire.changes import ChangeIn
from service.wire.scenarios import ScenarioFile, ScenarioIn
from service.wire.timelines import AgesOut, Validity

JobState = Literal["queued", "running", "cancelling", "succeeded", "failed", "cancelled", "expired"]
ACTIVE: Final[tuple[JobState, ...]] = ("queued", "running", "cancelling")
FINAL: Final[tuple[JobState, ...]] = ("succeeded", "failed", "cancelled", "expired")
MAX_RUNS: Final = 32


class LimitsIn(Body):
    """What a job may use; the server's defaults where it says nothing."""

    time_s: float | None = Field(
        None,
        gt=0,
        description="Seconds of work; the search then answers with its best plan, "
        "which is its first one where the time was too short for more.",
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

    solver: Id = Field(description="A name of `GET /v1/solvers`.")
    params: Free[dict[str, Any]] = Field(
        {}, description="The solver's own; the others are defaults."
    )
    seed: int = Field(0, ge=0, lt=2**63, description="Same seed, same plan.")


class JobIn(QuestionIn, SolverIn):
    """A scenario, the solver that is to plan it, and how."""


class WhatIfIn(ChangeIn):
    """A change to the question of a job. What is left out is as in that job."""

    solver: Id | None = Field(None, description="A name of `GET /v1/solvers`.")
    params: Free[dict[str, Any] | None] = Field(
        None, description="The solver's own; the others are its defaults."
    )
    seed: int | None = Field(None, ge=0, lt=2**63)
    limits: LimitsIn = LimitsIn()
    priority: int | None = Field(None, ge=0, le=9)
    label: Name | None = None


class ScenarioRef(Wire):
    """Which question a job answers."""

    id: str
    sha256: str


class ProgressOut(Wire):
    """How far the work is; `fraction` counts within the phase."""

    phase: Open[Literal["access", "compile", "solve", "verify"]]
    fraction: float
    reward: float | None
    bound: float | None
    message: str


class LimitsOut(Wire):
    """What a job may use."""

    time_s: float
    memory_mb: int


class ErrorOut(Wire):
    """Why a job failed."""

    code: str
    detail: str


class JobOut(Stored):
    """A job as it stands."""

    id: str
    state: Open[JobState]
    scenario: ScenarioRef
    solver: str
    params: Json
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
    validity: Open[Validity] | None = Field(
        None,
        description="Of its plan, by the referee; `inherited`: only what it began with breaks "
        "limits. Null without a plan.",
    )
    warnings: tuple[str, ...] = Field((), description="About its plan, for people.")
    change: Json | None = Field(
        None,
        description="Of a what-if: what was to be different from the job it varies. Of a replan: "
        "the plan it follows (`replan_of`), its draft (`plan_id`) and `freeze_until`.",
    )
    links: dict[str, str]

    @property
    def is_final(self) -> bool:
        """Whether it changes no more."""
        return self.state in FINAL


class ComparisonIn(QuestionIn):
    """A scenario and the solvers that are to plan it; limits, priority, label are of each job."""

    runs: list[SolverIn] = Field(min_length=1, max_length=MAX_RUNS)


class FiguresOut(Wire):
    """Numbers of a run's timeline; all null as long as it has none."""

    reward: float | None = Field(None, description="As the referee awarded it.")
    bound: float | None = Field(None, description="No plan of the scenario can exceed it.")
    gap: float | None = Field(None, description="`(bound - reward) / bound`.")
    bound_proof: str | None = None
    collects: int | None = None
    contacts: int | None = None
    downlinked_mbit: float | None = Field(
        None, description="Null too where a recorder has no capacity in megabits."
    )
    downlinked_fraction: float | None = Field(
        None, description="In multiples of what the recorders hold."
    )
    delivered: int | None = Field(None, description="Images on the ground by the end.")
    age_s: AgesOut | None = Field(None, description="Of those images, when they are down.")
    solve_s: float | None = Field(None, description="Of the search alone.")
    runtime_s: float | None = Field(None, description="Of the whole job's work.")
    validity: str | None = None
    plan_sha256: str | None = None


class ComparedRun(FiguresOut):
    """One line of the table."""

    job_id: str
    state: Open[JobState]
    solver: str
    params: Json
    seed: int
    progress: ProgressOut | None
    termination: str | None
    error: ErrorOut | None
    links: dict[str, str]


class ComparisonOut(Stored):
    """Several solvers on one scenario, side by side."""

    id: str
    state: Open[Literal["running", "finished"]] = Field(
        description="`finished` when every job is final, whether it succeeded or not."
    )
    scenario: ScenarioRef
    label: str | None
    created_at: Instant
    runs: tuple[ComparedRun, ...] = Field(description="In the order of the request.")
    links: dict[str, str]

    @property
    def is_final(self) -> bool:
        """Whether every job has ended."""
        return self.state == "finished"
