"""The progress of orders, derived from plans and reports like the progress of targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db import clock
from service.db.rows import OrderRow, PlanActionRow, PlanEventRow, TargetCatalogRow
from service.plans.target_lives import Lives, lives_of, plans_by_catalog
from service.wire.sites import TargetIn
from service.wire.stored import from_store
from service.wire.target_lives import TargetCollectOut, TargetState

Code = Literal["received", "scheduled", "processing", "completed", "expired", "cancelled"]

_ENDS: Final[dict[TargetState, tuple[Code, ...]]] = {
    "open": ("received",),
    "planned": ("received", "scheduled"),
    "collected": ("received", "scheduled", "processing"),
    "delivered": ("received", "scheduled", "processing", "completed"),
    "expired": ("received", "expired"),
    "cancelled": ("received", "cancelled"),
}
"""The steps to each state of a target, as STAPI status codes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A present or past status of an order."""

    code: Code
    at: datetime


def steps_of(session: Session, orders: Sequence[OrderRow]) -> list[list[Step]]:
    """Return the statuses of each order in order of time; the last one is current."""
    now = clock.now(session)
    known: dict[tuple[str, str], tuple[list[str], Lives]] = {}
    found = []
    for order in orders:
        key = order.owner, order.catalog_id
        if key not in known:
            # Plans of others do not count, although anybody may read a catalogue.
            plan_ids = plans_by_catalog(session, order.owner).get(order.catalog_id, [])
            known[key] = plan_ids, lives_of(session, plan_ids)
        found.append(_steps(session, order, *known[key], now))
    return found


def _steps(
    session: Session, order: OrderRow, plan_ids: list[str], lives: Lives, now: datetime
) -> list[Step]:
    target = from_store(TargetIn, order.target)
    deleted_at = session.get_one(TargetCatalogRow, order.catalog_id).deleted_at
    state = lives.state_of(order.id, target.due, is_cancelled=deleted_at is not None, now=now)
    collect = lives.collect_of(order.id)
    at: dict[Code, datetime | None] = {
        "received": order.created_at,
        "expired": target.due,
        "cancelled": deleted_at,
    }
    if collect is not None:
        at |= {
            "scheduled": _published_at(session, collect.plan_id),
            "processing": collect.end,
            "completed": _delivered_at(session, plan_ids, order.id, collect),
        }
    steps: list[Step] = []
    for code in _ENDS[state]:
        # A plan may be published only after its actions were done.
        since = steps[-1].at if steps else order.created_at
        steps.append(Step(code=code, at=max(since, at[code] or since)))
    return steps


def _published_at(session: Session, plan_id: str) -> datetime | None:
    event = PlanEventRow
    wanted = sa.select(event.at).where(event.plan_id == plan_id, event.to_state == "published")
    return session.scalar(wanted.order_by(event.id).limit(1))


def _delivered_at(
    session: Session, plan_ids: list[str], target_id: str, collect: TargetCollectOut
) -> datetime | None:
    action = PlanActionRow
    wanted = sa.select(action.delivered_at).where(
        action.plan_id.in_(plan_ids),
        action.target_id == target_id,
        action.satellite_id == collect.satellite_id,
        action.start == collect.start,
        action.delivered_at.is_not(None),
    )
    return session.scalar(wanted.order_by(action.delivered_at).limit(1))
