"""Problems, solvers, health, audit events and callers."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.wire.base import Instant, Json, Open, Wire

Constraint = Literal["slew", "station", "battery", "recorder", "duplicate"]
Scope = Literal["read", "submit", "approve", "admin"]


class FaultOut(Wire):
    """One error, and where it is."""

    pointer: str | None = Field(description="JSON pointer into the body, if it was JSON.")
    code: str
    row: int | None = Field(description="Line of the file, from 1; a header is line 1.")
    detail: str


class ProblemOut(Wire):
    """A problem document (RFC 9457)."""

    type: str = Field(description="Address of the explanation of this code.")
    title: str
    status: int
    code: str = Field(description="Stable name of the problem. More codes may be added.")
    detail: str
    instance: str = Field(description="Path of the request.")
    request_id: str
    errors: tuple[FaultOut, ...] = Field(description="At most 100; the detail says how many more.")


class SolverOut(Wire):
    """A solver."""

    name: str
    title: str
    description: str = Field(description="What it does, and when to choose it.")
    paper: str = Field(description="Where the paper describes it.")
    kind: Open[Literal["exact", "heuristic"]] = Field(
        description="An exact solver proves its plan optimal when it runs to the end."
    )
    honours: tuple[Open[Constraint], ...] = Field(description="Rules that its plans never break.")
    params_schema: Json = Field(description="JSON Schema of `params` of a job.")


class Live(Wire):
    """The process answers."""

    status: str = "live"


class Ready(Wire):
    """Jobs can be accepted and run."""

    status: str = "ready"
    database: str = "ok"
    queue: str = "ok"
    workers: int = Field(description="Workers that reported in the last 30 seconds.")
    last_heartbeat: Instant


class Version(Wire):
    """The name and version of the service."""

    name: str = "slewline"
    version: str


class ProblemExplained(Wire):
    """What a problem code means, and what to do about it."""

    code: str
    title: str
    status: int
    explanation: str


class AuditEventOut(Wire):
    """One change of one object."""

    id: str
    at: Instant
    owner: str = Field(description="Owner of the key; `local` without a key.")
    key_id: str | None
    key_name: str | None
    request_id: str | None = Field(description="As in the answer's `X-Request-ID` and the logs.")
    action: str = Field(description="`create`, `delete`, `cancel` and so on; more may be added.")
    kind: str = Field(description="`satellite`, `job` and so on; more may be added.")
    object_id: str


class CallerOut(Wire):
    """The caller of this request."""

    owner: str = Field(description="Owner of the jobs it sends; `local` without a key.")
    scope: Open[Scope] = Field(
        description="Each of read, submit, approve and admin includes those before it."
    )
    key_id: str | None = Field(description="Public part of the key; null without one.")
    key_name: str | None
