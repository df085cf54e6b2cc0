"""Jobs in the database, as the API writes and reads them."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import JobRow, ScenarioRow

# Built once, since building and compiling them takes longer than running them.
_THESE: Final = JobRow.id.in_(sa.bindparam("job_ids", expanding=True))
_VERSIONS: Final = sa.select(JobRow.id, JobRow.version).where(_THESE)
_OWNERS: Final = sa.select(JobRow.id, JobRow.tenant).where(_THESE)
_WITH_HASHES: Final = (
    sa.select(JobRow, ScenarioRow.sha256)
    .join(ScenarioRow, ScenarioRow.id == JobRow.scenario_id)
    .where(_THESE)
)


def num_waiting(session: Session, owner: str) -> tuple[int, int]:
    """Return how many jobs wait for a worker, and how many of those are this owner's."""
    own = sa.func.count().filter(JobRow.tenant == owner)
    waiting = sa.select(sa.func.count(), own).where(JobRow.state == "queued")
    in_all, of_owner = session.execute(waiting).one()
    return in_all, of_owner


def owner_of(session: Session, job_id: str) -> str | None:
    """Return the owner of a job, or None if there is no such job."""
    return owners_of(session.connection(), [job_id]).get(job_id)


def owners_of(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, str]:
    """Return the owners of those of these jobs that exist."""
    rows = connection.execute(_OWNERS, {"job_ids": list(job_ids)})
    return {row.id: row.tenant for row in rows}


def with_hashes(session: Session, job_ids: Collection[str]) -> dict[str, tuple[JobRow, str]]:
    """Return those of these jobs that exist, each with its scenario's SHA-256."""
    rows = session.execute(_WITH_HASHES, {"job_ids": list(job_ids)})
    return {job.id: (job, sha256) for job, sha256 in rows}


def versions_of(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, int]:
    """Return the version of each of these jobs, which grows with every visible change."""
    rows = connection.execute(_VERSIONS, {"job_ids": list(job_ids)})
    return {row.id: row.version for row in rows}


def scenario_hashes(session: Session, jobs: Iterable[JobRow]) -> dict[str, str]:
    """Return the SHA-256 of each scenario of these jobs, by scenario id."""
    return hashes_of(session, {job.scenario_id for job in jobs})


def hashes_of(session: Session, ids: Collection[str]) -> dict[str, str]:
    """Return the SHA-256 of each of these scenarios, by id."""
    wanted = sa.select(ScenarioRow.id, ScenarioRow.sha256).where(ScenarioRow.id.in_(ids))
    return {row.id: row.sha256 for row in session.execute(wanted)}


def content_of(session: Session, job_id: str) -> str:
    """Return a job's scenario file."""
    wanted = (
        sa.select(ScenarioRow.content)
        .join(JobRow, JobRow.scenario_id == ScenarioRow.id)
        .where(JobRow.id == job_id)
    )
    return session.execute(wanted).scalar_one()
