"""Jobs in the database, as the API writes and reads them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service import tracing
from service.db.clock import utc_now
from service.db.rows import JobRow, ScenarioRow
from service.ids import new_id
from service.jobs.queue import JobQueue
from service.logs import request_id

# Made once: to make and compile it takes longer than to run it.
_VERSION: Final = sa.select(JobRow.version).where(JobRow.id == sa.bindparam("job_id"))


@dataclass(frozen=True, slots=True, kw_only=True)
class JobSpec:
    """What one job is to do, all defaults filled in."""

    scenario_id: str
    solver: str
    params: Mapping[str, Any]
    seed: int
    time_s: float
    memory_mb: int
    priority: int
    label: str | None
    owner: str
    rerun_of: str | None = None
    what_if_of: str | None = None
    change: Mapping[str, Any] | None = None


def spec_again(job: JobRow, owner: str) -> JobSpec:
    """Return the spec of the same frozen question once more, for whoever asks it now."""
    return JobSpec(
        scenario_id=job.scenario_id,
        solver=job.solver,
        params=job.params,
        seed=job.seed,
        time_s=job.limits["time_s"],
        memory_mb=job.limits["memory_mb"],
        priority=job.priority,
        label=job.label,
        owner=owner,
        rerun_of=job.id,
    )


def submit(session: Session, queue: JobQueue, spec: JobSpec) -> JobRow:
    """Store a job and queue it, both or neither."""
    job_id = new_id()
    session.execute(
        sa.insert(JobRow).values(
            id=job_id,
            scenario_id=spec.scenario_id,
            tenant=spec.owner,
            state="queued",
            solver=spec.solver,
            params=dict(spec.params),
            seed=spec.seed,
            limits={"time_s": spec.time_s, "memory_mb": spec.memory_mb},
            priority=spec.priority,
            label=spec.label,
            rerun_of=spec.rerun_of,
            what_if_of=spec.what_if_of,
            change=sa.null() if spec.change is None else dict(spec.change),
            request_id=request_id.get(),
            traceparent=tracing.note_queued(job_id),
            created_at=utc_now(),
            dispatched_at=utc_now(),
        )
    )
    queue.enqueue(session, job_id, 1, priority=spec.priority, tenant=spec.owner)
    return session.get_one(JobRow, job_id)


def has_scenario(session: Session, scenario_id: str) -> bool:
    """Return whether there is a scenario of this id."""
    wanted = sa.select(ScenarioRow.id).where(ScenarioRow.id == scenario_id)
    return session.scalar(wanted) is not None


def num_waiting(session: Session) -> int:
    """Return how many jobs wait for a worker."""
    waiting = sa.select(sa.func.count()).select_from(JobRow).where(JobRow.state == "queued")
    return session.execute(waiting).scalar_one()


def find(session: Session, job_id: str) -> JobRow | None:
    """Return a job, or None."""
    return session.get(JobRow, job_id)


def owner_of(session: Session, job_id: str) -> str | None:
    """Return whose job this is, or None for no job."""
    return session.scalar(sa.select(JobRow.tenant).where(JobRow.id == job_id))


def version_of(connection: sa.Connection, job_id: str) -> int | None:
    """Return the number that grows with every visible change of a job, or None for no job."""
    return connection.scalar(_VERSION, {"job_id": job_id})


def matching(**wanted: str | None) -> sa.Select[JobRow]:
    """Return the query of all jobs whose columns have these values; None stands for any."""
    conditions = [
        getattr(JobRow, column) == value for column, value in wanted.items() if value is not None
    ]
    return sa.select(JobRow).where(*conditions)


def scenario_hashes(session: Session, jobs: Iterable[JobRow]) -> dict[str, str]:
    """Return the SHA-256 of each scenario that these jobs plan, by its id."""
    return hashes_of(session, {job.scenario_id for job in jobs})


def hashes_of(session: Session, ids: Collection[str]) -> dict[str, str]:
    """Return the SHA-256 of each of these scenarios, by its id."""
    wanted = sa.select(ScenarioRow.id, ScenarioRow.sha256).where(ScenarioRow.id.in_(ids))
    return {row.id: row.sha256 for row in session.execute(wanted)}


def content_of(session: Session, job_id: str) -> str:
    """Return the scenario file that a job plans."""
    wanted = (
        sa.select(ScenarioRow.content)
        .join(JobRow, JobRow.scenario_id == ScenarioRow.id)
        .where(JobRow.id == job_id)
    )
    return session.execute(wanted).scalar_one()
