"""Jobs: send one, watch it, cancel it, read its answer."""

from __future__ import annotations

import json
import logging
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Query, Request, Response
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from planner_core.errors import Fault
from planner_core.solvers import solver_class
from service import job_store as store
from service import scenario_store
from service.access.audit import Audit
from service.access.callers import Caller
from service.api.deps import AuditDep, CallerDep, DatabaseDep, SettingsDep, own_job_only
from service.api.errors import problem_responses, refuse
from service.api.job_shapes import JobIn, JobOut, Outcome, TargetItem, etag_of_job, shown
from service.api.job_wait import wait_for_change
from service.api.paging import Listed, PagingDep, newest_first
from service.api.problems import ServiceError
from service.api.shapes import matches
from service.db.rows import JobRow
from service.db.session import Database
from service.inputs import ScenarioFile, ScenarioIn
from service.jobs import lease
from service.jobs.lease import JobState
from service.jobs.queue import JobQueue
from service.settings import Settings
from service.solver_params import params_of, parse_params
from service.translate import inside, read_file

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])
log = logging.getLogger(__name__)

LONGEST_WAIT_S: Final = 30.0
_ASK_AGAIN_S: Final = 1
_QUEUE_FULL_S: Final = 30

Suffix = Annotated[str, Path(description="Form of the answer; today `json`.")]


@router.post("", status_code=202, responses=problem_responses(503))
def create_job(
    body: JobIn,
    database: DatabaseDep,
    settings: SettingsDep,
    caller: CallerDep,
    audit: AuditDep,
    request: Request,
    response: Response,
) -> JobOut:
    """Queue a job; the answer tells where to follow it.

    Jobs with a higher `priority` start first, those of the same priority in their order.
    """
    queue = _queue(request)
    solver = solver_class(body.solver)
    params = params_of(parse_params(solver, body.params))
    frozen = _frozen(database, settings, body)
    with database.transaction() as session:
        if store.num_waiting(session) >= settings.max_queued:
            raise ServiceError(
                "queue_full",
                f"{settings.max_queued} jobs are waiting.",
                headers={"Retry-After": str(_QUEUE_FULL_S)},
            )
        scenario_id = _scenario_id(session, audit, body, frozen)
        spec = _spec(body, settings, caller, scenario_id, params)
        job = store.submit(session, queue, spec)
        audit.record(session, "create", "job", job.id)
        answer = _shown(session, job)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    _describe(response, job)
    return answer


@router.get("")
def list_jobs(
    database: DatabaseDep,
    caller: CallerDep,
    paging: PagingDep,
    state: Annotated[JobState | None, Query(description="Only jobs in this state.")] = None,
    solver: Annotated[str | None, Query(description="Only jobs of this solver.")] = None,
    scenario_id: Annotated[str | None, Query(description="Only jobs of this scenario.")] = None,
    label: Annotated[str | None, Query(description="Only jobs with exactly this label.")] = None,
) -> Listed[JobOut]:
    """List the jobs of the key's owner, newest first; all jobs for the scope `admin`."""
    query = store.matching(
        state=state,
        solver=solver,
        scenario_id=scenario_id,
        label=label,
        tenant=caller.visible_owner,
    )
    with database.reading() as session:
        page = newest_first(session, query, JobRow.id, paging)
        hashes = store.scenario_hashes(session, page.rows)
    return Listed(items=[shown(job, hashes[job.scenario_id]) for job in page.rows], next=page.next)


@router.get("/{job_id}", response_model=JobOut, responses=problem_responses(404))
async def get_job(
    job_id: str,
    database: DatabaseDep,
    request: Request,
    response: Response,
    wait: Annotated[
        float,
        Query(ge=0, le=LONGEST_WAIT_S, description="Hold so many seconds for a change."),
    ] = 0.0,
) -> JobOut | Response:
    """Return one job.

    With `wait` the answer is held until the job changes: from what `If-None-Match` names, or
    else from what it is now. A finished job is answered at once.
    """
    known = request.headers.get("if-none-match")
    job, sha256 = await wait_for_change(database, job_id, known, wait, request.is_disconnected)
    if matches(known, etag_of_job(job)):
        return Response(status_code=304, headers={"ETag": etag_of_job(job)})
    _describe(response, job)
    return shown(job, sha256)


@router.post("/{job_id}/cancel", status_code=202, responses=problem_responses(404, 409))
def cancel_job(
    job_id: str, database: DatabaseDep, audit: AuditDep, request: Request, response: Response
) -> JobOut:
    """Cancel a job: at once where it waits; a running one stops and keeps its best plan so far."""
    with database.transaction() as session:
        job = _find(session, job_id)
        was_waiting = job.state == "queued"
        if not lease.request_cancel(session, job_id):
            raise ServiceError(
                "invalid_transition",
                f"The job is {job.state}, which is final: no transition is allowed from there. "
                "Only queued and running jobs can be cancelled.",
            )
        audit.record(session, "cancel", "job", job_id)
        session.refresh(job)
        answer = _shown(session, job)
    if was_waiting:
        _forget(_queue(request), job)
    _describe(response, job)
    return answer


@router.get(
    "/{job_id}/timeline",
    responses={
        200: {"content": {"application/json": {}}, "description": "The timeline document."},
        **problem_responses(404, 406, 409),
    },
)
def get_timeline(job_id: str, database: DatabaseDep, request: Request) -> Response:
    """Return the plan, judged: actions, resources, totals, violations."""
    return _timeline(job_id, database, request, acceptable=_accepts_json(request))


@router.get(
    "/{job_id}/timeline.{suffix}",
    responses={
        200: {"content": {"application/json": {}}, "description": "The timeline document."},
        **problem_responses(404, 406, 409),
    },
)
def get_timeline_as(
    job_id: str, suffix: Suffix, database: DatabaseDep, request: Request
) -> Response:
    """Return the plan in the form that the suffix names, whatever `Accept` says."""
    return _timeline(job_id, database, request, acceptable=suffix == "json")


@router.get(
    "/{job_id}/proof",
    responses={
        200: {"content": {"application/json": {}}, "description": "The proof document."},
        **problem_responses(404, 409),
    },
)
def get_proof(job_id: str, database: DatabaseDep, request: Request) -> Response:
    """Return what proves the bound of the timeline, or `null` where it has none.

    `proof` names the argument and `value` the bound. `prices` holds a multiplier for each
    target, in the order of the scenario: the dual function at these prices is the bound.
    """
    etag = f'"{job_id}"'
    with database.reading() as session:
        job = _find(session, job_id)
        if store.timeline_of(session, job_id) is None:
            raise _not_ready(job)
        proof = store.proof_of(session, job_id)
    if matches(request.headers.get("if-none-match"), etag):
        return Response(status_code=304, headers={"ETag": etag})
    return Response(proof or "null", media_type="application/json", headers={"ETag": etag})


@router.get("/{job_id}/targets", responses=problem_responses(404, 409))
def list_targets(
    job_id: str,
    database: DatabaseDep,
    paging: PagingDep,
    outcome: Annotated[Outcome | None, Query(description="Only this outcome.")] = None,
    reason: Annotated[str | None, Query(description="Only this code of a reason.")] = None,
) -> Listed[TargetItem]:
    """List every target of the scenario once, with its outcome and why it was left out."""
    with database.reading() as session:
        job = _find(session, job_id)
        targets = store.targets_of(session, job_id)
    if targets is None:
        raise _not_ready(job)
    found = [
        (position, target)
        for position, target in enumerate(json.loads(targets))
        if position > paging.after_number()
        and outcome in (None, target["outcome"])
        and reason in (None, (target["reason"] or {}).get("code"))
    ]
    page = paging.answer(found[: paging.limit + 1], lambda row: row[0])
    return Listed(items=[TargetItem(**target) for _, target in page.rows], next=page.next)


def _queue(request: Request) -> JobQueue:
    queue: JobQueue | None = request.app.state.queue
    if queue is None:
        raise ServiceError("not_live", "This server takes no jobs: it has no queue.")
    return queue


def _find(session: Session, job_id: str) -> JobRow:
    job = store.find(session, job_id)
    if job is None:
        raise ServiceError("not_found", f"There is no job {job_id!r}.")
    return job


def _shown(session: Session, job: JobRow) -> JobOut:
    return shown(job, store.scenario_hashes(session, [job])[job.scenario_id])


def _describe(response: Response, job: JobRow) -> None:
    response.headers["ETag"] = etag_of_job(job)
    if job.state in lease.ACTIVE:
        response.headers["Retry-After"] = str(_ASK_AGAIN_S)


def _frozen(
    database: Database, settings: Settings, body: JobIn
) -> scenario_store.FrozenScenario | None:
    """Return the inline scenario of a job, ready to be stored."""
    scenario, days = body.scenario, settings.max_horizon_days
    if (scenario is None) == (body.scenario_id is None):
        detail = "Give either scenario_id or scenario."
        if scenario is None:
            raise refuse([Fault(code="missing_field", detail=detail, pointer="/scenario_id")])
        raise refuse([Fault(code="invalid_value", detail=detail, pointer="/scenario")])
    with inside("/scenario"):
        if isinstance(scenario, ScenarioIn):
            return scenario_store.freeze(database, scenario, max_horizon_days=days)
        if isinstance(scenario, ScenarioFile):
            file = read_file(scenario.model_dump(mode="json"))
            return scenario_store.freeze_file(file, max_horizon_days=days)
    return None


def _scenario_id(
    session: Session, audit: Audit, body: JobIn, frozen: scenario_store.FrozenScenario | None
) -> str:
    if frozen is not None:
        row, is_new = scenario_store.save(session, frozen)
        if is_new:
            audit.record(session, "create", "scenario", row.id)
        return row.id
    assert body.scenario_id is not None
    if store.has_scenario(session, body.scenario_id):
        return body.scenario_id
    detail = f"There is no scenario {body.scenario_id!r}."
    raise refuse([Fault(code="unknown_scenario", detail=detail, pointer="/scenario_id")])


def _spec(
    body: JobIn, settings: Settings, caller: Caller, scenario_id: str, params: dict[str, Any]
) -> store.JobSpec:
    limits = body.limits
    time_s = settings.default_time_s if limits.time_s is None else limits.time_s
    if time_s > settings.max_time_s:
        detail = f"{time_s:g} s is more than the {settings.max_time_s:g} s that a job may take."
        raise refuse([Fault(code="value_out_of_range", detail=detail, pointer="/limits/time_s")])
    return store.JobSpec(
        scenario_id=scenario_id,
        solver=body.solver,
        params=params,
        seed=body.seed,
        time_s=time_s,
        memory_mb=settings.default_memory_mb if limits.memory_mb is None else limits.memory_mb,
        priority=body.priority,
        label=body.label,
        owner=caller.owner,
    )


def _forget(queue: JobQueue, job: JobRow) -> None:
    try:
        queue.cancel(job.id, job.dispatch)
    except OperationalError:
        # A worker that takes it will find the job cancelled.
        log.warning("a cancelled job is still in the queue", extra={"job_id": job.id})


def _accepts_json(request: Request) -> bool:
    accepted = request.headers.get("accept", "*/*").split(",")
    types = {part.partition(";")[0].strip().lower() for part in accepted}
    return not types.isdisjoint({"*/*", "application/*", "application/json"})


def _timeline(
    job_id: str, database: DatabaseDep, request: Request, *, acceptable: bool
) -> Response:
    etag = f'"{job_id}"'  # a timeline never changes
    with database.reading() as session:
        job = _find(session, job_id)
        if not acceptable:
            raise ServiceError("not_acceptable", "The timeline is offered as application/json.")
        timeline = store.timeline_of(session, job_id)
    if timeline is None:
        raise _not_ready(job)
    if matches(request.headers.get("if-none-match"), etag):
        return Response(status_code=304, headers={"ETag": etag})
    return Response(timeline, media_type="application/json", headers={"ETag": etag})


def _not_ready(job: JobRow) -> ServiceError:
    if job.state in lease.ACTIVE:
        headers = {"Retry-After": str(_ASK_AGAIN_S)}
        return ServiceError("not_ready", f"The job is {job.state}.", headers=headers)
    why = job.error["code"] if job.error else "it was stopped before it had a plan"
    return ServiceError("not_ready", f"The job is {job.state} and left no answer: {why}.")
