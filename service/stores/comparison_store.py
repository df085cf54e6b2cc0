"""Comparisons in the database: several jobs of one scenario, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import ComparisonRunRow, JobResultRow, JobRow


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One line: the job, and the numbers of its timeline where it has one."""

    job: JobRow
    figures: Mapping[str, Any] | None


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
