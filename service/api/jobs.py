"""Jobs: send one, watch it, cancel it, run it again."""

from __future__ import annotations

import logging
from typing import Annotated, Final

import sqlalchemy as sa
from fastapi import APIRouter, Depends, Query, Response
from sqlalchemy.exc import SQLAlchemyError

from service.api import job_intake as intake
from service.api.conditional import known_as, readable, require_match
from service.api.deps import CallDep, own_job_only
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.job_events import wait_for_change
from service.api.job_shapes import etag_of_job, headers_of, shown
from service.api.paging import (
    PagingDep,
    SatelliteQuery,
    StationQuery,
    StoredDep,
    newest_first,
    size_of,
)
from service.db.rows import JobRow
from service.jobs import lease, submission
from service.jobs.queue import JobQueue
from service.problems.kinds import ServiceError
from service.stores import deletion, scenario_store
from service.stores import job_store as store
from service.stores.finding import with_values
from service.wire.base import Listed
from service.wire.jobs import JobIn, JobOut, JobState

router = APIRouter(prefix="/v1/jobs", tags=["jobs"], dependencies=[Depends(own_job_only)])
log = logging.getLogger(__name__)

LONGEST_WAIT_S: Final = 30.0


@router.post("", status_code=202, responses=problem_responses(503))
def create_job(body: JobIn, call: CallDep, once: OnceDep) -> JobOut:
    """Queue a job; the answer's `Location` is where to follow it.

    Jobs with a higher `priority` start first, those of the same priority in order of arrival.
    """
    asked = intake.asked_for(body, call)
    inline = intake.frozen(call, body)
    queue = intake.queue_with_room(call)
    with once.transaction() as session:
        intake.require_room(session, call)
        spec = asked(scenario_id=intake.stored_scenario(session, call, body, inline))
        return intake.queued(session, call, once, queue, spec)


@router.get("")
def list_jobs(
    call: CallDep,
    paging: PagingDep,
    stored: StoredDep,
    state: Annotated[JobState | None, Query(description="Only jobs in this state.")] = None,
    solver: Annotated[str | None, Query(description="Only jobs of this solver.")] = None,
    scenario_id: Annotated[str | None, Query(description="Only jobs of this scenario.")] = None,
    label: Annotated[str | None, Query(description="Only jobs with exactly this label.")] = None,
    satellite_id: SatelliteQuery = None,
    station_id: StationQuery = None,
) -> Listed[JobOut]:
    """List the jobs of the key's owner, newest first; all jobs for the scope `admin`."""
    own = {"state": state, "solver": solver, "scenario_id": scenario_id, "label": label}
    query = sa.select(JobRow).where(
        *with_values(JobRow, tenant=call.caller.visible_owner, **own),
        *scenario_store.with_parts(JobRow.scenario_id, satellite_id, station_id),
    )
    query = stored.narrow(query, JobRow.created_at)
    with call.database.reading() as session:
        page = newest_first(session, query, JobRow.id, paging, size_of(JobRow.change))
        hashes = store.scenario_hashes(session, page.rows)
    return Listed(items=[shown(job, hashes[job.scenario_id]) for job in page.rows], next=page.next)


@router.get("/{job_id}", response_model=JobOut, responses=readable())
async def get_job(
    job_id: str,
    call: CallDep,
    wait: Annotated[
        float, Query(ge=0, le=LONGEST_WAIT_S, description="Seconds to wait for a change.")
    ] = 0.0,
) -> JobOut | Response:
    """Return one job.

    With `wait` the answer is delayed until the job changes: from the state that `If-None-Match`
    names, or else from the present one. A finished job is returned at once.
    """
    known = call.request.headers.get("if-none-match")
    job, sha256 = await wait_for_change(
        call.questions, job_id, known, wait, call.request.is_disconnected
    )
    call.response.headers.update(headers_of(job))
    return known_as(call, etag_of_job(job)) or shown(job, sha256)


@router.post("/{job_id}/cancel", status_code=202, responses=problem_responses(404, 409, 503))
def cancel_job(job_id: str, call: CallDep) -> JobOut:
    """Cancel a job: at once if it is queued; a running one stops and keeps its best plan so far."""
    with call.noted("cancel", "job", job_id) as session:
        job = intake.find_job(session, job_id)
        was_waiting = job.state == "queued"
        if not lease.request_cancel(session, job_id):
            raise ServiceError(
                "invalid_transition",
                f"The job is {job.state}, which is final: no transition is allowed from there. "
                "Only queued and running jobs can be cancelled.",
            )
        session.refresh(job)
        answer = intake.shown_job(session, job)
    if was_waiting:
        _forget(intake.queue_of(call.request), job)
    call.response.headers.update(headers_of(job))
    return answer


@router.delete("/{job_id}", status_code=204, responses=problem_responses(404, 409, 412))
def delete_job(job_id: str, call: CallDep) -> None:
    """Delete a finished job and its answer permanently, unless a plan or a comparison uses it."""
    with call.noted("delete", "job", job_id) as session:
        job = intake.find_job(session, job_id)
        require_match(call, etag_of_job(job))
        deletion.delete_job(session, job)


@router.post("/{job_id}/rerun", status_code=202, responses=problem_responses(404, 503))
def rerun_job(job_id: str, call: CallDep, once: OnceDep) -> JobOut:
    """Queue the same question again as a new job, whatever the outcome of the first.

    Scenario, solver, params, seed, limits, priority and label are those of the first job, which
    `links.rerun_of` names. The same seed and version of the service give the same plan.
    """
    queue = intake.queue_with_room(call)
    with once.transaction() as session:
        spec = submission.spec_again(intake.find_job(session, job_id), call.caller.owner)
        intake.require_room(session, call)
        scenario_store.let_see_too(session, spec.scenario_id, call.caller.owner)
        return intake.queued(session, call, once, queue, spec)


def _forget(queue: JobQueue, job: JobRow) -> None:
    try:
        queue.cancel(job.id, job.dispatch)
    except SQLAlchemyError:
        # A worker that takes it will find the job cancelled.
        log.warning("a cancelled job is still in the queue", extra={"job_id": job.id})
