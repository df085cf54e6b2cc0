"""Plans in the database: made from jobs, moved from state to state, and reported on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import TypeVar

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.access.callers import Caller
from service.db.clock import now
from service.db.columns import Reported
from service.db.ids import new_id
from service.db.rows import (
    ExecutionRow,
    PlanActionRow,
    PlanEventRow,
    PlanRow,
    PlanSatelliteRow,
    PlanStateRow,
    PublisherRow,
)
from service.db.session import inserted
from service.stores.finding import with_values
from service.wire.base import Json, dumped
from service.wire.pins import StateIn
from service.wire.plans import ExecutionIn, PlanState, WaiverIn
from service.wire.stored import from_store
from service.wire.timelines import IDLE_MODES, TimelineOut

R = TypeVar("R", bound=Reported)


def add(
    session: Session, caller: Caller, owner: str, job_id: str, name: str | None,
    timeline: TimelineOut, parent_id: str | None = None, plan_id: str | None = None,
) -> PlanRow:  # fmt: skip
    """Store a job's plan as a draft, with its actions as rows."""
    plan = PlanRow(
        id=plan_id or new_id(), owner=owner, name=name, job_id=job_id, parent_id=parent_id,
        state="draft",
        plan_sha256=timeline.plan_sha256, horizon_start=timeline.horizon.start,
        horizon_end=timeline.horizon.end, validity=timeline.validity,
        violations=[dumped(each) for each in timeline.violations if each.code != "duplicate"],
        created_at=now(session),
    )  # fmt: skip
    session.add(plan)
    session.flush()
    session.add_all(
        PlanSatelliteRow(plan_id=plan.id, satellite_id=each.id, satellite_name=each.name)
        for each in timeline.satellites
    )
    actions = [
        (satellite, action)
        for satellite in timeline.satellites
        for action in satellite.actions
        if action.mode not in IDLE_MODES
    ]
    rows = [
        {
            "plan_id": plan.id, "position": position, "action_id": action.id,
            "satellite_id": satellite.id, "mode": action.mode, "start": action.start,
            "end": action.end, "target_id": action.target_id, "station_id": action.station_id,
            "delivered_at": action.delivered_at, "satellite_name": satellite.name,
            "station_name": action.station_name, "target_name": action.target_name,
        }
        for position, (satellite, action) in enumerate(actions)
    ]  # fmt: skip
    if rows:
        session.execute(sa.insert(PlanActionRow), rows)
    note(session, caller, plan, None)
    return plan


def note(
    session: Session, caller: Caller, plan: PlanRow, from_state: str | None,
    reason: str | None = None, effective_from: datetime | None = None,
    waivers: Sequence[WaiverIn] = (),
) -> None:  # fmt: skip
    """Record a transition in the plan's history."""
    session.add(
        PlanEventRow(
            id=new_id(), plan_id=plan.id, at=now(session), from_state=from_state,
            to_state=plan.state, owner=caller.owner, key_name=caller.key_name, reason=reason,
            effective_from=effective_from, waivers=[dumped(each) for each in waivers],
        )
    )  # fmt: skip
    session.flush()


def history(session: Session, plan_id: str) -> Sequence[PlanEventRow]:
    """Return the transitions of a plan, in order."""
    wanted = sa.select(PlanEventRow).where(PlanEventRow.plan_id == plan_id)
    return session.scalars(wanted.order_by(PlanEventRow.id)).all()


def satellites(session: Session, plan_ids: Iterable[str]) -> dict[str, list[PlanSatelliteRow]]:
    """Return the satellites of each of these plans."""
    ids = list(plan_ids)
    found: dict[str, list[PlanSatelliteRow]] = {own_id: [] for own_id in ids}
    wanted = sa.select(PlanSatelliteRow).where(PlanSatelliteRow.plan_id.in_(ids))
    for row in session.scalars(wanted.order_by(PlanSatelliteRow.satellite_id)):
        found[row.plan_id].append(row)
    return found


def matching(
    *, owner: str | None, state: PlanState | None, satellite_id: str | None, job_id: str | None,
    parent_id: str | None, at: datetime | None,
) -> sa.Select[PlanRow]:  # fmt: skip
    """Return the query of plans by their properties and the instant at which they are in force.

    Given an instant, `published` means in force at that instant, as far as is known now.
    """
    own = with_values(PlanRow, owner=owner, job_id=job_id, parent_id=parent_id)
    query = sa.select(PlanRow).where(*own)
    if at is not None and state == "published":
        query = query.where(PlanRow.state.in_(("published", "superseded")))
    elif state is not None:
        query = query.where(PlanRow.state == state)
    of = [PlanSatelliteRow.plan_id == PlanRow.id]
    if satellite_id is not None:
        of.append(PlanSatelliteRow.satellite_id == satellite_id)
    if at is not None:
        of.append(PlanRow.horizon_end > at)
        of.append(PlanSatelliteRow.in_force_from <= at)
        ends = PlanSatelliteRow.in_force_until
        of.append(sa.or_(ends.is_(None), ends > at))
    if len(of) > 1:
        query = query.where(sa.exists().where(*of))
    return query


def lock_publishing(session: Session, owner: str) -> None:
    """Prevent others from publishing for this owner until the transaction ends."""
    inserted(session, PublisherRow, owner=owner)
    session.execute(sa.select(PublisherRow).where(PublisherRow.owner == owner).with_for_update())


def in_force(session: Session, plan: PlanRow, effective_from: datetime) -> list[PlanSatelliteRow]:
    """Return rows of other plans in force for this plan's satellites from an instant on.

    Only plans of the same owner that begin before this plan's horizon ends.
    """
    own = sa.select(PlanSatelliteRow.satellite_id).where(PlanSatelliteRow.plan_id == plan.id)
    ends = PlanSatelliteRow.in_force_until
    wanted = (
        sa.select(PlanSatelliteRow)
        .join(PlanRow, PlanRow.id == PlanSatelliteRow.plan_id)
        .where(
            PlanRow.owner == plan.owner,
            PlanRow.id != plan.id,
            PlanRow.state == "published",
            PlanSatelliteRow.satellite_id.in_(own),
            PlanRow.horizon_end > effective_from,
            PlanRow.horizon_start < plan.horizon_end,
            sa.or_(ends.is_(None), ends > effective_from),
        )
        .order_by(PlanSatelliteRow.plan_id)
    )
    return list(session.scalars(wanted))


def actions(
    session: Session, plan_id: str, after: int, limit: int, satellite_id: str | None
) -> list[tuple[PlanActionRow, str | None]]:
    """Return a page of a plan's actions, each with its last reported outcome."""
    wanted = sa.select(PlanActionRow).where(
        PlanActionRow.plan_id == plan_id, PlanActionRow.position > after
    )
    if satellite_id is not None:
        wanted = wanted.where(PlanActionRow.satellite_id == satellite_id)
    rows = session.scalars(wanted.order_by(PlanActionRow.position).limit(limit)).all()
    reports = (
        sa.select(ExecutionRow.action_id, ExecutionRow.outcome)
        .where(
            ExecutionRow.plan_id == plan_id,
            ExecutionRow.action_id.in_([row.action_id for row in rows]),
        )
        .order_by(ExecutionRow.id)
    )
    last: dict[str, str] = {each.action_id: each.outcome for each in session.execute(reports)}
    return [(row, last.get(row.action_id)) for row in rows]


def unknown_actions(session: Session, plan_id: str, action_ids: Sequence[str]) -> set[str]:
    """Return the given ids that no action of the plan has."""
    wanted = sa.select(PlanActionRow.action_id).where(PlanActionRow.plan_id == plan_id)
    return set(action_ids) - set(session.scalars(wanted))


def report(
    session: Session, caller: Caller, plan_id: str, reports: Sequence[ExecutionIn]
) -> list[ExecutionRow]:
    """Store the reported outcomes of some actions."""
    told = (each.model_dump() for each in reports)
    return _take_down(session, caller, plan_id, ExecutionRow, told)


def report_states(
    session: Session, caller: Caller, plan_id: str, states: Sequence[StateIn]
) -> list[PlanStateRow]:
    """Store telemetry."""
    told = (
        {"satellite_id": each.satellite_id, "at": each.at, "body": dumped(each)} for each in states
    )
    return _take_down(session, caller, plan_id, PlanStateRow, told)


def _take_down(
    session: Session, caller: Caller, plan_id: str, table: type[R], told: Iterable[Json]
) -> list[R]:
    shared: Json = {"plan_id": plan_id, "owner": caller.owner, "key_name": caller.key_name}
    shared["reported_at"] = now(session)
    rows = [table(id=new_id(), **shared, **own) for own in told]
    session.add_all(rows)
    session.flush()
    return rows


def states(plan_id: str) -> sa.Select[PlanStateRow]:
    """Return the query of all telemetry of a plan."""
    return sa.select(PlanStateRow).where(PlanStateRow.plan_id == plan_id)


def last_states(session: Session, plan_id: str, until: datetime) -> dict[str, StateIn]:
    """Return each satellite's newest state up to an instant; of equally new ones, the last sent."""
    wanted = states(plan_id).where(PlanStateRow.at <= until)
    found: dict[str, StateIn] = {}
    for row in session.scalars(wanted.order_by(PlanStateRow.at, PlanStateRow.id)):
        found[row.satellite_id] = from_store(StateIn, row.body)
    return found


def last_reports(session: Session, plan_id: str) -> dict[str, ExecutionRow]:
    """Return the last report on each action."""
    return {
        row.action_id: row for row in session.scalars(executions(plan_id).order_by(ExecutionRow.id))
    }


def executions(plan_id: str) -> sa.Select[ExecutionRow]:
    """Return the query of all reports on actions of a plan."""
    return sa.select(ExecutionRow).where(ExecutionRow.plan_id == plan_id)
