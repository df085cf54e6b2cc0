"""Submitting jobs: a row and its first dispatch, both or neither."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import utc_now
from service.db.ids import new_id
from service.db.rows import ComparisonRow, ComparisonRunRow, JobRow
from service.jobs.queue import JobQueue
from service.process import tracing
from service.process.logs import request_id


@dataclass(frozen=True, slots=True, kw_only=True)
class JobSpec:
    """What one job is to do, with defaults filled in."""

    scenario_id: str
    solver: str
    params: Mapping[str, Any]
    seed: int
    limits: Mapping[str, float]
    priority: int
    label: str | None
    owner: str
    rerun_of: str | None = None
    what_if_of: str | None = None
    change: Mapping[str, Any] | None = None


def spec_again(job: JobRow, owner: str) -> JobSpec:
    """Return the spec for running a job again with the same input, for a new owner."""
    names = ("scenario_id", "solver", "params", "seed", "limits", "priority", "label")
    same = {name: getattr(job, name) for name in names}
    return JobSpec(**same, owner=owner, rerun_of=job.id)


def submit(session: Session, queue: JobQueue, spec: JobSpec) -> JobRow:
    """Store a job and queue it, both or neither."""
    job_id = new_id()
    asked = asdict(spec)
    del asked["owner"]
    if spec.change is None:
        asked["change"] = sa.null()
    session.execute(
        sa.insert(JobRow).values(
            **asked,
            id=job_id,
            tenant=spec.owner,
            state="queued",
            request_id=request_id.get(),
            traceparent=tracing.note_queued(job_id),
            created_at=utc_now(),
            dispatched_at=utc_now(),
        )
    )
    queue.enqueue(session, job_id, 1, priority=spec.priority, tenant=spec.owner)
    return session.get_one(JobRow, job_id)


def submit_comparison(
    session: Session, queue: JobQueue, specs: Sequence[JobSpec], *, label: str | None
) -> ComparisonRow:
    """Store a comparison and queue a job for each spec, all or none. All share one scenario."""
    comparison = ComparisonRow(
        scenario_id=specs[0].scenario_id,
        tenant=specs[0].owner,
        label=label,
        created_at=utc_now(),
    )
    session.add(comparison)
    session.flush()
    for position, spec in enumerate(specs):
        job = submit(session, queue, spec)
        run = ComparisonRunRow(comparison_id=comparison.id, position=position, job_id=job.id)
        session.add(run)
    session.flush()
    return comparison
