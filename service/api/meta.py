"""Audit events, the caller, health, version, and explanations of problem codes."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Annotated

import sqlalchemy as sa
from fastapi import APIRouter, Depends, Path, Query

import planner_core
from service.api.deps import CallDep, admin_only, found
from service.api.errors import problem_responses
from service.api.paging import PagingDep, newest_first
from service.db.rows import AuditEventRow, WorkerRow
from service.db.session import Database
from service.jobs.queue import JobQueue
from service.problems.kinds import KINDS, ServiceError
from service.stores.finding import with_values
from service.wire.base import Listed
from service.wire.operations import AuditEventOut, CallerOut, Live, ProblemExplained, Ready, Version
from service.wire.stored import from_row

router = APIRouter(tags=["operations"])

WORKER_SILENCE = timedelta(seconds=30)


@router.get("/v1/audit-events", dependencies=[Depends(admin_only)])
def list_audit_events(
    call: CallDep,
    paging: PagingDep,
    object_id: Annotated[str | None, Query(description="Only events of this object.")] = None,
    kind: Annotated[str | None, Query(description="Only events of this kind of object.")] = None,
    action: Annotated[str | None, Query(description="Only events with this action.")] = None,
    owner: Annotated[str | None, Query(description="Only events by keys of this owner.")] = None,
) -> Listed[AuditEventOut]:
    """List who changed what, newest first. Needs the scope `admin`."""
    wanted = {"object_id": object_id, "kind": kind, "action": action, "owner": owner}
    query = sa.select(AuditEventRow).where(*with_values(AuditEventRow, **wanted))
    with call.database.reading() as session:
        page = newest_first(session, query, AuditEventRow.id, paging)
        return page.listed(lambda row: from_row(AuditEventOut, row))


@router.get("/v1/me")
def who_am_i(call: CallDep) -> CallerOut:
    """Return the owner of the key and what it allows."""
    return from_row(CallerOut, call.caller, scope=call.caller.scope.value)


@router.get("/health/live")
async def live() -> Live:
    """Return that the process answers. Nothing else is checked."""
    # Not in a thread: all threads may be waiting for a database that hangs.
    return Live()


@router.get("/health/ready", responses=problem_responses(503))
def ready(call: CallDep) -> Ready:
    """Check that database and queue answer and that a worker reported in the last 30 seconds."""
    workers = _recent_workers(call.database)
    _ask_queue(call.request.app.state.queue)
    if not workers:
        raise ServiceError("not_live", "No worker has reported in the last 30 seconds.")
    return Ready(workers=len(workers), last_heartbeat=max(workers))


def _recent_workers(database: Database) -> list[datetime]:
    oldest = datetime.now(UTC) - WORKER_SILENCE
    try:
        with database.reading() as session:
            recent = sa.select(WorkerRow.seen_at).where(WorkerRow.seen_at >= oldest)
            return list(session.scalars(recent))
    except sa.exc.SQLAlchemyError as error:
        raise ServiceError("not_live", "The database does not answer.") from error


def _ask_queue(queue: JobQueue | None) -> None:
    try:
        if queue is not None:
            queue.claims()
    except sa.exc.DatabaseError as error:
        raise ServiceError("not_live", "The queue does not answer.") from error


@router.get("/version")
def version() -> Version:
    """Return the version of the service."""
    return Version(version=planner_core.__version__)


@router.get("/problems/{code}", responses=problem_responses(404))
def explain_problem(code: Annotated[str, Path(examples=["tle-checksum"])]) -> ProblemExplained:
    """Explain a problem code, written with hyphens or underscores."""
    name = code.replace("-", "_")
    return from_row(ProblemExplained, found(KINDS.get(name), "problem code", code), code=name)
