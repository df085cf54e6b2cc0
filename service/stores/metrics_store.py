"""What the database tells about the service as a whole, for its operators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, get_args

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import seconds_between, utc_now
from service.db.rows import JobRow, SatelliteRow, ScenarioRow, WebhookDeliveryRow, WorkerRow
from service.stores import satellite_store
from service.stores.finding import alive
from service.wire.jobs import ACTIVE, JobState
from service.wire.timelines import Validity
from service.wire.webhooks import DeliveryState

ORBITS_OF_LAST_S: Final = 7 * 86400.0
"""A satellite is in use while a job active or newer than this plans it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JobTime:
    """How many jobs of one kind have ended, and how long they ran from first start to end."""

    solver: str
    state: str
    termination: str
    num_jobs: int
    total_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitAge:
    """How long ago the epoch of a satellite's element set in force was; below 0 in the future."""

    satellite_id: str
    name: str
    age_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """The service at one instant of the database's clock.

    Attributes
    ----------
    num_jobs
        By state, states without a job included.
    num_plans
        Those that jobs have found, by validity.
    oldest_waiting_s
        How long the oldest waiting job has waited; 0 where none waits.
    heartbeat_age_s
        By worker, dead ones of the last day included.
    num_deliveries
        Of webhooks, by state; ended ones of the last 30 days.
    """

    num_jobs: Mapping[str, int]
    num_plans: Mapping[str, int]
    oldest_waiting_s: float
    job_times: Sequence[JobTime]
    num_leases_lost: int
    heartbeat_age_s: Mapping[str, float]
    orbits: Sequence[OrbitAge]
    num_deliveries: Mapping[str, int]


def take(session: Session) -> Snapshot:
    """Return how the service stands."""
    now = session.execute(sa.select(utc_now())).scalar_one()
    waiting_s = sa.select(sa.func.max(seconds_between(JobRow.created_at, utc_now())))
    seen_s = sa.select(WorkerRow.id, seconds_between(WorkerRow.seen_at, utc_now()))
    return Snapshot(
        num_jobs=_counted(session, JobRow.state, get_args(JobState)),
        num_plans=_counted(session, JobRow.validity, get_args(Validity)),
        oldest_waiting_s=session.scalar(waiting_s.where(JobRow.state == "queued")) or 0.0,
        job_times=_job_times(session),
        num_leases_lost=session.scalar(sa.select(sa.func.sum(JobRow.lost_runs))) or 0,
        heartbeat_age_s=dict(session.execute(seen_s).all()),
        orbits=_orbits(session, now),
        num_deliveries=_counted(session, WebhookDeliveryRow.state, get_args(DeliveryState)),
    )


def _counted(
    session: Session, column: sa.SQLColumnExpression[Any], values: Sequence[str]
) -> dict[str, int]:
    """Return how many rows have each of these values; those that none has count 0."""
    counted = sa.select(column, sa.func.count()).where(column.is_not(None)).group_by(column)
    found: dict[str, int] = dict(session.execute(counted).all())
    return {value: found.get(value, 0) for value in values}


def _job_times(session: Session) -> list[JobTime]:
    termination = sa.func.coalesce(JobRow.termination, "none")
    total_s = sa.func.sum(seconds_between(JobRow.started_at, JobRow.finished_at))
    wanted = (
        sa.select(JobRow.solver, JobRow.state, termination, sa.func.count(), total_s)
        .where(JobRow.started_at.is_not(None), JobRow.finished_at.is_not(None))
        .group_by(JobRow.solver, JobRow.state, termination)
        .order_by(JobRow.solver, JobRow.state, termination)
    )
    return [
        JobTime(solver=solver, state=state, termination=ended, num_jobs=number, total_s=seconds)
        for solver, state, ended, number, seconds in session.execute(wanted)
    ]


def _orbits(session: Session, now: datetime) -> list[OrbitAge]:
    is_in_use = sa.or_(JobRow.state.in_(ACTIVE), JobRow.created_at >= utc_now(-ORBITS_OF_LAST_S))
    planned = sa.select(JobRow.scenario_id).where(is_in_use)
    summaries = session.scalars(
        sa.select(ScenarioRow.summary).where(ScenarioRow.id.in_(planned)),
        execution_options={"yield_per": 20},
    )
    ids = {own_id for summary in summaries for own_id in summary.get("satellite_ids", ())}
    names = {
        row.id: row.name
        for row in session.scalars(alive(SatelliteRow).where(SatelliteRow.id.in_(ids)))
    }
    return [
        OrbitAge(
            satellite_id=own_id,
            name=names[own_id],
            age_s=(now - elements.epoch).total_seconds(),
        )
        for own_id, elements in sorted(satellite_store.in_force(session, names).items())
    ]
