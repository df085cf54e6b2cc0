"""The way from what a client sends to stored jobs."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from functools import partial
from typing import Any, Final, TypeVar

from fastapi import Request
from sqlalchemy.orm import Session

from planner_core.errors import inside
from planner_core.solvers.registry import solver_class
from service.answers import store as answer_store
from service.api import bulkhead
from service.api.deps import Call, found
from service.api.idempotency import Once
from service.api.job_shapes import SOON_S, headers_of, shown
from service.db.rows import JobRow, ScenarioRow
from service.jobs.queue import JobQueue
from service.jobs.solver_params import params_of, parse_params
from service.jobs.submission import JobSpec, submit
from service.problems.faults import refuse_one
from service.problems.kinds import ServiceError
from service.scenarios import freezing
from service.scenarios.freezing import FrozenScenario
from service.scenarios.opportunities import Described, OpportunityReader
from service.scenarios.pin_inputs import with_settled_pins
from service.scenarios.translate import read_file
from service.settings import Settings
from service.stores import job_store as store
from service.stores import scenario_store
from service.wire.jobs import ACTIVE, JobIn, JobOut, LimitsIn, QuestionIn
from service.wire.replans import ReplanIn
from service.wire.scenarios import ScenarioFile, ScenarioIn

T = TypeVar("T")

_QUEUE_FULL_S: Final = 30


def described(call: Call, scenario_id: str, sha256: str) -> Described:
    """Return a scenario and its opportunities; 503 if computing them takes long."""
    reader: OpportunityReader = call.request.app.state.opportunities
    return reader.get(call.database, scenario_id, sha256)


def queue_of(request: Request) -> JobQueue:
    """Return the queue; 503 if this server has none."""
    queue: JobQueue | None = request.app.state.queue
    if queue is None:
        raise ServiceError("not_live", "This server takes no jobs: it has no queue.")
    return queue


def queue_with_room(call: Call, num_jobs: int = 1) -> JobQueue:
    """Return the queue; 503 if it is full, which is checked before any work and without a lock.

    ``require_room`` decides, in the transaction that stores the jobs.
    """
    queue = queue_of(call.request)
    with call.database.reading() as session:
        require_room(session, call, num_jobs)
    return queue


def asked_for(body: JobIn | ReplanIn, call: Call) -> partial[JobSpec]:
    """Return the spec of a job, which its body gives except for the scenario.

    Raises
    ------
    ServiceError
        If parameters or limits are wrong, before anything is stored.
    """
    return partial(
        JobSpec,
        solver=body.solver,
        params=all_params(body.solver, body.params),
        seed=body.seed,
        limits=limits_of(body.limits, call.settings),
        priority=body.priority,
        label=body.label,
        owner=call.caller.owner,
    )


def all_params(solver: str, params: Mapping[str, Any]) -> dict[str, Any]:
    """Return a solver's parameters with defaults; raise a ``PlannerError`` if they are wrong."""
    return params_of(parse_params(solver_class(solver), params))


def frozen(call: Call, body: QuestionIn) -> FrozenScenario | None:
    """Return the inline scenario of a body, ready to be stored; None if it names a stored one."""
    scenario, limits = body.scenario, call.settings.scenario_limits
    if (scenario is None) == (body.scenario_id is None):
        detail = "Give either scenario_id or scenario."
        if scenario is None:
            raise refuse_one("missing_field", detail, "/scenario_id")
        raise refuse_one("invalid_value", detail, "/scenario")
    with inside("/scenario"):
        if isinstance(scenario, ScenarioIn):
            return freeze(call, scenario)
        if isinstance(scenario, ScenarioFile):
            file = with_settled_pins(read_file(scenario.model_dump(mode="json")))
            return freezing.freeze_file(file, limits)
    return None


def freeze(call: Call, body: ScenarioIn) -> FrozenScenario:
    """Return a question, ready to be stored; raise ``Heavy`` if another process must freeze it."""
    with call.database.reading() as session:
        num_targets = freezing.num_targets(session, body.target_catalog_ids)
    bulkhead.require_light(call.request, body, num_targets)
    limits = call.settings.scenario_limits
    return freezing.freeze(call.database, body, limits, call.caller.visible_owner)


def save(
    session: Session, call: Call, frozen: FrozenScenario, owner: str | None = None
) -> tuple[ScenarioRow, bool]:
    """Store a scenario unless its content is stored already; return its row and whether it is new.

    A new one counts as stored by the caller. With an ``owner``, only that owner sees it.
    """
    row, is_new = freezing.save(session, frozen, owner)
    if is_new:
        call.count_stored(session, num_rows=1, num_bytes=len(frozen.content))
        call.audit.record(session, "create", "scenario", row.id)
    return row, is_new


def stored_scenario(
    session: Session, call: Call, body: QuestionIn, inline: FrozenScenario | None
) -> str:
    """Return the id of the scenario in question; an inline one is stored for its owner."""
    if inline is not None:
        return save(session, call, inline, call.caller.owner)[0].id
    assert body.scenario_id is not None
    if scenario_store.find(session, body.scenario_id, call.caller.visible_owner) is not None:
        return body.scenario_id
    detail = f"There is no scenario {body.scenario_id!r}."
    raise refuse_one("unknown_scenario", detail, "/scenario_id")


def limits_of(limits: LimitsIn, settings: Settings) -> dict[str, float]:
    """Return the seconds and megabytes that a job may use, by default the server's."""
    time_s = settings.default_time_s if limits.time_s is None else limits.time_s
    if time_s > settings.max_time_s:
        detail = f"{time_s:g} s is more than the {settings.max_time_s:g} s that a job may take."
        raise refuse_one("value_out_of_range", detail, "/limits/time_s")
    memory_mb = settings.default_memory_mb if limits.memory_mb is None else limits.memory_mb
    if memory_mb > settings.max_memory_mb:
        detail = f"{memory_mb} MB is more than the {settings.max_memory_mb} MB that a job may use."
        raise refuse_one("value_out_of_range", detail, "/limits/memory_mb")
    return {"time_s": time_s, "memory_mb": memory_mb}


def require_room(session: Session, call: Call, num_jobs: int = 1) -> None:
    """Refuse more jobs than the queue may hold, in all and of one owner, or beyond a quota."""
    settings = call.settings
    call.count_stored(session)
    most = (settings.max_queued, settings.max_queued_per_tenant)
    waiting = store.num_waiting(session, call.caller.owner)
    for limit, number, whose in zip(most, waiting, ("", " of one owner"), strict=True):
        if number + num_jobs > limit:
            raise ServiceError(
                "queue_full",
                f"At most {limit} jobs{whose} may wait, and there is no room for {num_jobs} more.",
                headers={"Retry-After": str(_QUEUE_FULL_S)},
            )


def find_job(session: Session, job_id: str) -> JobRow:
    """Return a job; 404 if there is none."""
    return found(session.get(JobRow, job_id), "job", job_id)


def require_answer(session: Session, job: JobRow) -> datetime:
    """Return when a job's answer was stored; 409 if it has none."""
    return _left_by(job, answer_store.answered_at(session, job.id))


def find_timeline(session: Session, job: JobRow) -> str:
    """Return a job's timeline as JSON text; 409 if there is none."""
    return _left_by(job, answer_store.timeline_of(session, job.id))


def _left_by(job: JobRow, answer: T | None) -> T:
    """Return a job's answer; 409 if it has none, be it not yet or never."""
    if answer is not None:
        return answer
    if job.state in ACTIVE:
        headers = {"Retry-After": str(SOON_S)}
        raise ServiceError("not_ready", f"The job is {job.state}.", headers=headers)
    why = job.error["code"] if job.error else "it was stopped before it had a plan"
    raise ServiceError("not_ready", f"The job is {job.state} and has no answer: {why}.")


def shown_job(session: Session, job: JobRow) -> JobOut:
    """Return a job as clients see it."""
    return shown(job, store.scenario_hashes(session, [job])[job.scenario_id])


def queued(session: Session, call: Call, once: Once, queue: JobQueue, spec: JobSpec) -> JobOut:
    """Queue a job; return it, with headers that say where to follow it."""
    job = submit(session, queue, spec)
    call.audit.record(session, "create", "job", job.id)
    call.response.headers.update({"Location": f"/v1/jobs/{job.id}"} | headers_of(job))
    return once.keep(session, shown_job(session, job))
