"""A job's life: start, renew, finish, hand back, cancel.

Every change is one guarded update of the job's row. ``run`` is the fencing token: only the
holder of the current run can renew or finish, however late a worker wakes up. All times come
from the database's clock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.answers import store as answer_store
from service.answers.chunks import Chunk
from service.db.clock import utc_now
from service.db.rows import JobRow
from service.db.session import changed
from service.jobs.queue import JobQueue
from service.plans import replans
from service.stores import usage_store
from service.webhooks import outbox
from service.wire.base import read
from service.wire.jobs import JobState
from service.wire.timelines import TimelineOut


@dataclass(frozen=True, slots=True, kw_only=True)
class Lease:
    """The right to run a job, until another run begins."""

    job_id: str
    dispatch: int
    run: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a run ended. ``chunks`` hold the documents of its answer, if it has one.

    ``progress`` is the last report; None keeps the job's. ``figures`` are the timeline's numbers
    for tables, ``warnings`` its messages for people. ``num_shared_bytes`` counts the data stored
    for all jobs of the scenario.
    """

    state: JobState
    termination: str | None = None
    error: Mapping[str, str] | None = None
    progress: Mapping[str, Any] | None = None
    chunks: Sequence[Chunk] = ()
    figures: Mapping[str, Any] | None = None
    num_shared_bytes: int = 0
    warnings: Sequence[str] = ()

    @classmethod
    def failed(cls, code: str, detail: str) -> Outcome:
        """Return the outcome of a job that could not be done."""
        return cls(state="failed", error={"code": code, "detail": detail})


def start(session: Session, job_id: str, dispatch: int, *, lease_s: float) -> Lease | None:
    """Begin a run, or return None if this dispatch is obsolete.

    A job in state ``running`` may be started again only after its lease has lapsed.
    """
    may_start = sa.or_(
        JobRow.state == "queued",
        sa.and_(JobRow.state == "running", JobRow.lease_until < utc_now()),
    )
    found = changed(
        session,
        JobRow,
        sa.and_(JobRow.id == job_id, JobRow.dispatch == dispatch, may_start),
        JobRow.run,
        state="running",
        run=JobRow.run + 1,
        lease_until=utc_now(lease_s),
        started_at=sa.func.coalesce(JobRow.started_at, utc_now()),
        progress=sa.null(),
        version=JobRow.version + 1,
    )
    return None if found is None else Lease(job_id=job_id, dispatch=dispatch, run=found.run)


def renew(
    session: Session, lease: Lease, *, lease_s: float, progress: Mapping[str, Any] | None
) -> JobState | None:
    """Keep the job for another ``lease_s``.

    Parameters
    ----------
    progress
        The newest report, or None if there is nothing new.

    Returns
    -------
    The job's state (``running`` or ``cancelling``), or None if the lease is lost.
    """
    changes: dict[str, Any] = {"lease_until": utc_now(lease_s)}
    if progress is not None:
        changes |= {"progress": dict(progress), "version": JobRow.version + 1}
    found = changed(session, JobRow, _held(lease), JobRow.state, **changes)
    return None if found is None else cast(JobState, found.state)


def finish(session: Session, lease: Lease, outcome: Outcome) -> bool:
    """Write how the job ended, with its result; return False if the lease is lost.

    A job that is being cancelled ends as cancelled, even if its plan is ready first.
    """
    state: Any = outcome.state
    if state == "succeeded":
        state = sa.case((JobRow.state == "cancelling", "cancelled"), else_="succeeded")
    is_ended = end(
        session,
        lease.job_id,
        _held(lease),
        state=state,
        termination=outcome.termination,
        error=sa.null() if outcome.error is None else dict(outcome.error),
        progress=JobRow.progress if outcome.progress is None else dict(outcome.progress),
        validity=None if outcome.figures is None else outcome.figures["validity"],
        warnings=list(outcome.warnings) or None,
    )
    if is_ended and outcome.chunks:
        answer_store.save(session, lease.job_id, outcome.chunks, outcome.figures)
        _adopt_replan(session, lease.job_id)
        owner = session.scalars(sa.select(JobRow.tenant).where(JobRow.id == lease.job_id)).one()
        num_bytes = outcome.num_shared_bytes + sum(len(chunk.text) for chunk in outcome.chunks)
        usage_store.add(session, owner, num_rows=1 + len(outcome.chunks), num_bytes=num_bytes)
    return is_ended


def _adopt_replan(session: Session, job_id: str) -> None:
    """If the job is a replan, make a draft of its plan."""
    job = session.get_one(JobRow, job_id, populate_existing=True)
    text = answer_store.timeline_of(session, job_id) if replans.is_replan(job.change) else None
    if text is not None:
        replans.adopt(session, job, read(TimelineOut, text))


def hand_back(session: Session, queue: JobQueue, lease: Lease) -> None:
    """Give a running job back to the queue; it does not count as an attempt."""
    cancelled = _held(lease) & (JobRow.state == "cancelling")
    if end(session, lease.job_id, cancelled, state="cancelled"):
        return
    redispatch(session, queue, _held(lease), lease.job_id)


def let_go(session: Session, lease: Lease) -> None:
    """Let a lease lapse now, so that the next reconciler finds a lost run."""
    _update(session, _held(lease), lease_until=utc_now())


def return_unstarted(session: Session, queue: JobQueue, job_id: str, dispatch: int) -> bool:
    """Put back a job whose dispatch was taken from the queue but will never be started."""
    waiting = sa.and_(JobRow.dispatch == dispatch, JobRow.state == "queued")
    return redispatch(session, queue, waiting, job_id)


def redispatch(
    session: Session, queue: JobQueue, guard: sa.ColumnElement[bool], job_id: str, **changes: Any
) -> bool:
    """Queue a job again under its next dispatch number, if ``guard`` still holds."""
    found = changed(
        session,
        JobRow,
        sa.and_(JobRow.id == job_id, guard),
        *(JobRow.dispatch, JobRow.priority, JobRow.tenant),
        state="queued",
        dispatch=JobRow.dispatch + 1,
        dispatched_at=utc_now(),
        lease_until=None,
        progress=sa.null(),
        version=JobRow.version + 1,
        **changes,
    )
    if found is None:
        return False
    dispatch, priority, tenant = found
    queue.enqueue(session, job_id, dispatch, priority=priority, tenant=tenant)
    return True


def request_cancel(session: Session, job_id: str) -> bool:
    """Cancel a job: at once if it is queued, otherwise by asking its worker.

    Returns
    -------
    Whether the job was active, which includes a job that is already being cancelled.
    """
    if end(session, job_id, JobRow.state == "queued", state="cancelled", cancel_requested=True):
        return True
    runs = sa.and_(JobRow.id == job_id, JobRow.state == "running")
    asked = {"state": "cancelling", "cancel_requested": True, "version": JobRow.version + 1}
    if _update(session, runs, **asked):
        return True
    return session.scalar(sa.select(JobRow.state).where(JobRow.id == job_id)) == "cancelling"


def _held(lease: Lease) -> sa.ColumnElement[bool]:
    return sa.and_(
        JobRow.id == lease.job_id,
        JobRow.run == lease.run,
        JobRow.state.in_(("running", "cancelling")),
    )


def end(session: Session, job_id: str, guard: sa.ColumnElement[bool], **values: Any) -> bool:
    """Give a job its final state if ``guard`` still holds, and queue its webhook deliveries."""
    ended = {"finished_at": utc_now(), "lease_until": None, "version": JobRow.version + 1}
    if not _update(session, guard & (JobRow.id == job_id), **ended, **values):
        return False
    outbox.tell_end_of(session, job_id)
    return True


def _update(session: Session, guard: sa.ColumnElement[bool], **values: Any) -> bool:
    return changed(session, JobRow, guard, JobRow.id, **values) is not None
