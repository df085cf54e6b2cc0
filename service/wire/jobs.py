"""Jobs, the questions they plan, what-ifs, and comparisons of several jobs."""

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
    """Limits of a job; those left out are the server's defaults."""

    time_s: float | None = Field(
        None,
        gt=0,
        description="Seconds of work, after which the search returns the best plan so far "
        "(its first plan, if there was no time for more).",
    )
    memory_mb: int | None = Field(
        None, ge=64, le=1_000_000, description="Megabytes; a job that uses more fails."
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
    """A scenario to plan, stored or inline, and the limits of a job."""

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
    """A solver and its settings."""

    solver: Id = Field(description="A name from `GET /v1/solvers`.")
    params: Free[dict[str, Any]] = Field(
        {}, description="Parameters of the solver; those left out have their defaults."
    )
    seed: int = Field(0, ge=0, lt=2**63, description="The same seed gives the same plan.")


class JobIn(QuestionIn, SolverIn):
    """A scenario, and the solver that plans it."""


class WhatIfIn(ChangeIn):
    """A change to the question of a job. Fields left out are as in that job."""

    solver: Id | None = Field(None, description="A name from `GET /v1/solvers`.")
    params: Free[dict[str, Any] | None] = Field(
        None, description="Parameters of the solver; those left out have their defaults."
    )
    seed: int | None = Field(None, ge=0, lt=2**63)
    limits: LimitsIn = LimitsIn()
    priority: int | None = Field(None, ge=0, le=9)
    label: Name | None = None


class ScenarioRef(Wire):
    """The scenario that a job plans."""

    id: str
    sha256: str


class ProgressOut(Wire):
    """Progress of a job; `fraction` is that of the phase."""

    phase: Open[Literal["access", "compile", "solve", "verify"]]
    fraction: float
    reward: float | None
    bound: float | None
    message: str


class LimitsOut(Wire):
    """Limits of a job."""

    time_s: float
    memory_mb: int


class ErrorOut(Wire):
    """Why a job failed."""

    code: str
    detail: str


class JobOut(Stored):
    """A job in its present state."""

    id: str
    state: Open[JobState]
    scenario: ScenarioRef
    solver: str
    params: Json
    seed: int
    limits: LimitsOut
    attempt: int = Field(description="1 at first; grows with each further start.")
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
        description="The referee's verdict on its plan; `inherited`: only the initial state or "
        "frozen actions break limits. Null without a plan.",
    )
    warnings: tuple[str, ...] = Field((), description="About its plan, for people.")
    change: Json | None = Field(
        None,
        description="For a what-if: the changes to the original job. For a replan: the plan it "
        "follows (`replan_of`), its draft (`plan_id`) and `freeze_until`.",
    )
    links: dict[str, str]

    @property
    def is_final(self) -> bool:
        """Whether it can no longer change."""
        return self.state in FINAL


class ComparisonIn(QuestionIn):
    """A scenario and the solvers to compare; limits, priority and label apply to each job."""

    runs: list[SolverIn] = Field(min_length=1, max_length=MAX_RUNS)


class FiguresOut(Wire):
    """Figures of a run's timeline; all null until it has one."""

    reward: float | None = Field(None, description="As the referee awarded it.")
    bound: float | None = Field(None, description="No plan of the scenario can exceed it.")
    gap: float | None = Field(None, description="`(bound - reward) / bound`.")
    bound_proof: str | None = None
    collects: int | None = None
    contacts: int | None = None
    downlinked_mbit: float | None = Field(
        None, description="Also null if a recorder has no capacity in megabits."
    )
    downlinked_fraction: float | None = Field(
        None, description="Sum over satellites, each in multiples of its recorder's capacity."
    )
    delivered: int | None = Field(None, description="Images on the ground by the end.")
    age_s: AgesOut | None = Field(None, description="Ages of those images on delivery.")
    solve_s: float | None = Field(None, description="Seconds of the search alone.")
    runtime_s: float | None = Field(None, description="Seconds of the job's whole work.")
    validity: str | None = None
    plan_sha256: str | None = None


class ComparedRun(FiguresOut):
    """One row of the table."""

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
