"""Deleting jobs, comparisons, plans and scenarios for good.

Whatever is referred to stays: a job with a plan or comparison, a scenario with a job. The room
of a deleted job's answer is given back to its owner.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.columns import Row
from service.db.rows import (
    BoundRow,
    ComparisonRow,
    ComparisonRunRow,
    ExecutionRow,
    JobChunkRow,
    JobResultRow,
    JobRow,
    OpportunitySetRow,
    PlanActionRow,
    PlanEventRow,
    PlanRow,
    PlanSatelliteRow,
    PlanStateRow,
    ScenarioOwnerRow,
    ScenarioPartRow,
    ScenarioRow,
)
from service.problems.kinds import ServiceError
from service.stores import usage_store
from service.wire.jobs import FINAL

_AT_ONCE: Final = 50
"""How many of a kind a sweep deletes at most in one transaction, so that it stays short."""
_KEPT_PLANS: Final = ("approved", "published")


def delete_job(session: Session, job: JobRow) -> None:
    """Delete a job and its answer.

    Raises
    ------
    ServiceError
        ``invalid_transition`` while it waits or runs, ``in_use`` if a plan or a comparison
        refers to it.
    """
    if job.state not in FINAL:
        raise ServiceError(
            "invalid_transition", f"The job is {job.state}: cancel it before deleting it."
        )
    made = sa.select(PlanRow.id).where(PlanRow.job_id == job.id)
    _require_none(session, made, "The plan {!r} was made from this job.")
    ran = sa.select(ComparisonRunRow.comparison_id).where(ComparisonRunRow.job_id == job.id)
    _require_none(session, ran, "The comparison {!r} includes this job.")
    _delete_jobs(session, [job.id])


def delete_comparison(session: Session, comparison_id: str) -> None:
    """Delete a comparison. Its runs remain as ordinary jobs."""
    _delete(session, ComparisonRunRow, ComparisonRunRow.comparison_id == comparison_id)
    _delete(session, ComparisonRow, ComparisonRow.id == comparison_id)


def delete_plan(session: Session, plan: PlanRow) -> None:
    """Delete a plan with its history and the reports on it.

    Raises
    ------
    ServiceError
        ``invalid_transition`` while it is approved or published, ``in_use`` if another plan
        continues it.
    """
    if plan.state in _KEPT_PLANS:
        raise ServiceError(
            "invalid_transition", f"The plan is {plan.state}: withdraw it before deleting it."
        )
    changes = sa.select(PlanRow.id).where(PlanRow.parent_id == plan.id)
    _require_none(session, changes, "The plan {!r} is a replan of this one.")
    for row in (ExecutionRow, PlanStateRow, PlanEventRow, PlanActionRow, PlanSatelliteRow):
        _delete(session, row, row.plan_id == plan.id)
    _delete(session, PlanRow, PlanRow.id == plan.id)


def delete_scenario(session: Session, scenario: ScenarioRow) -> None:
    """Delete a scenario, with its opportunities and proven bounds.

    Raises
    ------
    ServiceError
        ``in_use`` if a job or a comparison refers to it.
    """
    tried = sa.select(JobRow.id).where(JobRow.scenario_id == scenario.id)
    _require_none(session, tried, "The job {!r} uses this scenario.")
    compared = sa.select(ComparisonRow.id).where(ComparisonRow.scenario_id == scenario.id)
    _require_none(session, compared, "The comparison {!r} uses this scenario.")
    _delete_scenarios(session, [(scenario.id, scenario.sha256)])


def sweep(session: Session, before: datetime) -> int:
    """Delete some of what is older than an instant; return how much, 0 if nothing is left.

    Deleted are jobs that ended before it, unless a plan or a younger comparison refers to them;
    comparisons made before it, when all their runs have ended; and scenarios stored before it,
    when no job refers to them. Plans stay.
    """
    return (
        _sweep_comparisons(session, before)
        + _sweep_jobs(session, before)
        + _sweep_scenarios(session, before)
    )


def _sweep_comparisons(session: Session, before: datetime) -> int:
    unfinished = (
        sa.select(ComparisonRunRow.job_id)
        .join(JobRow, JobRow.id == ComparisonRunRow.job_id)
        .where(ComparisonRunRow.comparison_id == ComparisonRow.id, JobRow.state.not_in(FINAL))
    )
    old = sa.select(ComparisonRow.id).where(ComparisonRow.created_at < before, ~unfinished.exists())
    ids = session.scalars(old.limit(_AT_ONCE)).all()
    for comparison_id in ids:
        delete_comparison(session, comparison_id)
    return len(ids)


def _sweep_jobs(session: Session, before: datetime) -> int:
    planned = sa.select(PlanRow.id).where(PlanRow.job_id == JobRow.id)
    compared = sa.select(ComparisonRunRow.job_id).where(ComparisonRunRow.job_id == JobRow.id)
    old = sa.select(JobRow.id).where(
        JobRow.state.in_(FINAL),
        JobRow.finished_at < before,
        ~planned.exists(),
        ~compared.exists(),
    )
    ids = session.scalars(old.limit(_AT_ONCE)).all()
    _delete_jobs(session, ids)
    return len(ids)


def _sweep_scenarios(session: Session, before: datetime) -> int:
    tried = sa.select(JobRow.id).where(JobRow.scenario_id == ScenarioRow.id)
    compared = sa.select(ComparisonRow.id).where(ComparisonRow.scenario_id == ScenarioRow.id)
    old = sa.select(ScenarioRow.id, ScenarioRow.sha256).where(
        ScenarioRow.created_at < before, ~tried.exists(), ~compared.exists()
    )
    rows = [(own_id, sha256) for own_id, sha256 in session.execute(old.limit(_AT_ONCE))]
    _delete_scenarios(session, rows)
    return len(rows)


def _delete_jobs(session: Session, ids: Sequence[str]) -> None:
    if not ids:
        return
    num_blocks = sa.func.count(JobChunkRow.job_id)
    num_bytes = sa.func.coalesce(sa.func.sum(sa.func.length(JobChunkRow.text)), 0)
    taken = (
        sa.select(
            JobRow.tenant, num_blocks, num_bytes, sa.func.count(JobResultRow.job_id.distinct())
        )
        .join(JobResultRow, JobResultRow.job_id == JobRow.id)
        .outerjoin(JobChunkRow, JobChunkRow.job_id == JobResultRow.job_id)
        .where(JobRow.id.in_(ids))
        .group_by(JobRow.tenant)
    )
    for owner, chunks, size, answers in session.execute(taken).all():
        usage_store.give_back(session, owner, num_rows=answers + chunks, num_bytes=size)
    _delete(session, JobChunkRow, JobChunkRow.job_id.in_(ids))
    _delete(session, JobResultRow, JobResultRow.job_id.in_(ids))
    _delete(session, JobRow, JobRow.id.in_(ids))


def _delete_scenarios(session: Session, rows: Sequence[tuple[str, str]]) -> None:
    if not rows:
        return
    ids, hashes = zip(*rows, strict=True)
    _delete(session, OpportunitySetRow, OpportunitySetRow.scenario_sha256.in_(hashes))
    _delete(session, BoundRow, BoundRow.scenario_sha256.in_(hashes))
    _delete(session, ScenarioOwnerRow, ScenarioOwnerRow.scenario_id.in_(ids))
    _delete(session, ScenarioPartRow, ScenarioPartRow.scenario_id.in_(ids))
    _delete(session, ScenarioRow, ScenarioRow.id.in_(ids))


def _require_none(session: Session, users: sa.Select[str], detail: str) -> None:
    found = session.scalar(users.limit(1))
    if found is not None:
        raise ServiceError("in_use", detail.format(found))


def _delete(session: Session, row: type[Row], condition: sa.ColumnElement[bool]) -> None:
    session.execute(sa.delete(row).where(condition))
