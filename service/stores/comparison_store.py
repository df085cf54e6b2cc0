"""Comparisons in the database: several jobs of one scenario, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import ComparisonRow, ComparisonRunRow, JobResultRow, JobRow

_BYTES_OF_A_RUN: Final = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run: the job, and the numbers of its timeline if it has one."""

    job: JobRow
    figures: Mapping[str, Any] | None


def weight() -> sa.ColumnElement[int]:
    """Return the approximate number of bytes of a comparison as shown."""
    own = ComparisonRunRow.comparison_id == ComparisonRow.id
    num_runs = sa.select(sa.func.count()).select_from(ComparisonRunRow).where(own)
    return num_runs.correlate(ComparisonRow).scalar_subquery() * _BYTES_OF_A_RUN


def runs_of(session: Session, comparison_ids: Iterable[str]) -> dict[str, list[Run]]:
    """Return the runs of each of these comparisons, in the order of its request."""
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
