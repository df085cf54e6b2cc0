"""Comparisons in the database: several jobs of one scenario, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import utc_now
from service.db.rows import ComparisonRow, ComparisonRunRow, JobResultRow, JobRow
from service.ids import new_id
from service.jobs.queue import JobQueue
from service.stores import job_store
from service.stores.job_store import JobSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One line: the job, and the numbers of its timeline where it has one."""

    job: JobRow
    figures: Mapping[str, Any] | None


def submit(
    session: Session, queue: JobQueue, specs: Sequence[JobSpec], *, label: str | None
) -> ComparisonRow:
    """Store a comparison and queue a job for each spec, all or none. All plan one scenario."""
    own_id = new_id()
    row = {
        "id": own_id,
        "scenario_id": specs[0].scenario_id,
        "tenant": specs[0].owner,
        "label": label,
        "created_at": utc_now(),
    }
    session.execute(sa.insert(ComparisonRow).values(**row))
    jobs = [job_store.submit(session, queue, spec) for spec in specs]
    runs = [
        {"comparison_id": own_id, "position": position, "job_id": job.id}
        for position, job in enumerate(jobs)
    ]
    session.execute(sa.insert(ComparisonRunRow), runs)
    return session.get_one(ComparisonRow, own_id)


def runs_of(session: Session, comparison_ids: Iterable[str]) -> dict[str, list[Run]]:
    """Return the lines of each of these comparisons, in the order of its request."""
    ids = list(comparison_ids)
    wanted = (
        sa.select(ComparisonRunRow.comparison_id, JobRow, JobResultRow.figures)
        .join(JobRow, JobRow.id == ComparisonRunRow.job_id)
        .outerjoin(JobResultRow, JobResultRow.job_id == JobRow.id)
        .where(ComparisonRunRow.comparison_id.in_(ids))
        .order_by(ComparisonRunRow.comparison_id, ComparisonRunRow.position)
    )
    found: dict[str, list[Run]] = {own_id: [] for own_id in ids}
    for comparison_id, job, figures in session.execute(wanted):
        found[comparison_id].append(Run(job=job, figures=figures))
    return found
