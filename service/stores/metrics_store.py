"""Figures about the service as a whole from the database, for operators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, get_args

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import now, seconds_between, utc_now
from service.db.rows import JobRow, SatelliteRow, ScenarioRow, WebhookDeliveryRow, WorkerRow
from service.stores import satellite_store
from service.stores.finding import alive
from service.wire.jobs import ACTIVE, JobState
from service.wire.timelines import Validity
from service.wire.webhooks import DeliveryState

ORBITS_OF_LAST_S: Final = 7 * 86400.0
"""A satellite is in use if an active job, or one younger than this, plans it."""


def num_jobs(session: Session) -> Mapping[str, float]:
    """Return the number of jobs by state, including states without jobs."""
    return _counted(session, JobRow.state, get_args(JobState))


def num_plans(session: Session) -> Mapping[str, float]:
    """Return the number of plans found by jobs, by validity."""
    return _counted(session, JobRow.validity, get_args(Validity))


def num_deliveries(session: Session) -> Mapping[str, float]:
    """Return the number of webhook messages by state; ended ones only of the last 30 days."""
    return _counted(session, WebhookDeliveryRow.state, get_args(DeliveryState))


def num_leases_lost(session: Session) -> int:
    """Return how many runs have lost their worker."""
    return session.scalar(sa.select(sa.func.sum(JobRow.lost_runs))) or 0


def oldest_waiting_s(session: Session) -> float:
    """Return how long the oldest waiting job has waited; 0 if none waits."""
    waiting_s = sa.select(sa.func.max(seconds_between(JobRow.created_at, utc_now())))
    return session.scalar(waiting_s.where(JobRow.state == "queued")) or 0.0


def heartbeat_age_s(session: Session) -> Mapping[str, float]:
    """Return the age of each worker's last sign of life, including dead ones of the last day."""
    seen_s = sa.select(WorkerRow.id, seconds_between(WorkerRow.seen_at, utc_now()))
    return dict(session.execute(seen_s).all())


def _counted(
    session: Session, column: sa.SQLColumnExpression[Any], values: Sequence[str]
) -> dict[str, float]:
    """Return the number of rows with each of these values, which may be 0."""
    counted = sa.select(column, sa.func.count()).where(column.is_not(None)).group_by(column)
    found: dict[str, int] = dict(session.execute(counted).all())
    return {value: found.get(value, 0) for value in values}


def job_times(session: Session) -> Iterator[tuple[Sequence[str], int, float]]:
    """Yield solver, state and termination, the number of jobs that ended so, and their run time.

    The run time is their total from first start to end, in seconds.
    """
    termination = sa.func.coalesce(JobRow.termination, "none")
    total_s = sa.func.sum(seconds_between(JobRow.started_at, JobRow.finished_at))
    wanted = (
        sa.select(JobRow.solver, JobRow.state, termination, sa.func.count(), total_s)
        .where(JobRow.started_at.is_not(None), JobRow.finished_at.is_not(None))
        .group_by(JobRow.solver, JobRow.state, termination)
        .order_by(JobRow.solver, JobRow.state, termination)
    )
    for *how, number, seconds in session.execute(wanted):
        yield how, number, seconds


def orbit_ages(session: Session) -> Iterator[tuple[tuple[str, str], float]]:
    """Yield id and name of each satellite in use, and the seconds since its orbit's epoch.

    They are negative if the epoch lies in the future.
    """
    is_in_use = sa.or_(JobRow.state.in_(ACTIVE), JobRow.created_at >= utc_now(-ORBITS_OF_LAST_S))
    planned = sa.select(JobRow.scenario_id).where(is_in_use)
    summaries = session.scalars(
        sa.select(ScenarioRow.summary).where(ScenarioRow.id.in_(planned)),
        execution_options={"yield_per": 20},
    )
    ids = {own_id for summary in summaries for own_id in summary.get("satellite_ids", ())}
    used = alive(SatelliteRow).where(SatelliteRow.id.in_(ids))
    names = {row.id: row.name for row in session.scalars(used)}
    at = now(session)
    for own_id, elements in sorted(satellite_store.in_force(session, names).items()):
        yield (own_id, names[own_id]), (at - elements.epoch).total_seconds()
