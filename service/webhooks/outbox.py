"""Deliveries in the database: written in the transaction of the event, sent afterwards.

A delivery that was taken comes due again by itself after ``TAKEN_S``, in case its sender
died. So each is sent at least once, and in rare cases twice with the same ``webhook-id``.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import now, utc_now
from service.db.ids import new_id
from service.db.rows import JobRow, PlanRow, WebhookDeliveryRow, WebhookRow
from service.db.session import changed
from service.wire.base import dumped
from service.wire.plans import PlanChange
from service.wire.stored import from_row
from service.wire.webhooks import EventOut, JobEnd, TestData

TAKEN_S: Final = 60.0
KEEP_S: Final = 30 * 86400.0
MOST_PENDING: Final = 1000
"""Per webhook. Further messages fail at once, and can be resent by hand."""
_SWEPT_AT_ONCE: Final = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class Parcel:
    """A delivery that was taken, with everything needed to send it.

    Attributes
    ----------
    attempt
        From 1; an outcome is recorded only if it names the current attempt.
    """

    id: str
    webhook_id: str
    owner: str
    attempt: int
    url: str
    secret: str
    payload: str


def tell_end_of(session: Session, job_id: str) -> None:
    """Queue a delivery for each webhook of the job's owner that wants this event.

    The message has enough to decide whether to fetch the rest.
    """
    job = session.get_one(JobRow, job_id, populate_existing=True)
    address = f"/v1/jobs/{job_id}"
    links = {"job": address, "timeline": f"{address}/timeline"}
    data = from_row(JobEnd, job, job_id=job_id, warnings=job.warnings or (), links=links)
    _tell(session, job.tenant, f"job.{job.state}", data, job_id)


def tell_plan(
    session: Session, plan: PlanRow, reason: str | None, effective_from: datetime | None
) -> None:
    """Queue a delivery for each webhook of the plan's owner that wants this transition."""
    links = {"plan": f"/v1/plans/{plan.id}", "job": f"/v1/jobs/{plan.job_id}"}
    told = {"plan_id": plan.id, "reason": reason, "effective_from": effective_from, "links": links}
    data = from_row(PlanChange, plan, **told)
    _tell(session, plan.owner, f"plan.{plan.state}", data, None)


def _tell(
    session: Session, owner: str, event: str, data: JobEnd | PlanChange, job_id: str | None
) -> None:
    wanted = sa.select(WebhookRow).where(
        WebhookRow.owner == owner, WebhookRow.disabled_at.is_(None)
    )
    for webhook in session.scalars(wanted):
        if event in webhook.events:
            queue(session, webhook, event, data, job_id=job_id)


def queue(
    session: Session,
    webhook: WebhookRow,
    event: str,
    data: JobEnd | PlanChange | TestData,
    *,
    job_id: str | None,
) -> str:
    """Queue one delivery and return its id."""
    # Fixed here, so that each attempt signs and sends the same bytes.
    payload = json.dumps(dumped(EventOut(type=event, timestamp=now(session), data=data)))
    return _add(session, webhook, event, payload, job_id)


def repeat(session: Session, webhook: WebhookRow, delivery: WebhookDeliveryRow) -> str:
    """Queue the same message again and return the id of the new delivery."""
    return _add(session, webhook, delivery.event, delivery.payload, delivery.job_id)


def _add(
    session: Session, webhook: WebhookRow, event: str, payload: str, job_id: str | None
) -> str:
    delivery_id = new_id()
    outcome: dict[str, Any] = {"state": "pending", "due_at": utc_now()}
    if num_pending(session, webhook.id) >= MOST_PENDING:
        why = f"{MOST_PENDING} messages were already waiting for this webhook."
        outcome = {"state": "failed", "last_error": why, "ended_at": utc_now()}
    session.execute(
        sa.insert(WebhookDeliveryRow).values(
            id=delivery_id,
            webhook_id=webhook.id,
            job_id=job_id,
            event=event,
            payload=payload,
            created_at=utc_now(),
            **outcome,
        )
    )
    return delivery_id


def num_pending(session: Session, webhook_id: str, event: str | None = None) -> int:
    """Return how many messages wait to be sent to a webhook, for one event or for all."""
    waiting = sa.select(sa.func.count()).where(
        WebhookDeliveryRow.webhook_id == webhook_id, WebhookDeliveryRow.state == "pending"
    )
    if event is not None:
        waiting = waiting.where(WebhookDeliveryRow.event == event)
    return session.execute(waiting).scalar_one()


def is_any_due(connection: sa.Connection) -> bool:
    """Return whether any delivery is due, even to a webhook being sent to."""
    due = sa.select(WebhookDeliveryRow.id).where(
        WebhookDeliveryRow.state == "pending", WebhookDeliveryRow.due_at <= utc_now()
    )
    return connection.execute(due.limit(1)).first() is not None


def take(
    session: Session, *, busy: Mapping[str, str], limit: int, of_an_owner: int
) -> list[Parcel]:
    """Take due deliveries, the oldest of each webhook, and count the attempt.

    Parameters
    ----------
    busy
        Webhooks being sent to, with their owners; they are skipped so as not to delay others.
    limit, of_an_owner
        How many to take at most, and how many of one owner may be under way.
    """
    is_due = sa.and_(
        WebhookDeliveryRow.state == "pending",
        WebhookDeliveryRow.due_at <= utc_now(),
        WebhookDeliveryRow.webhook_id.not_in(busy),
    )
    first = sa.select(sa.func.min(WebhookDeliveryRow.id)).where(is_due)
    first = first.group_by(WebhookDeliveryRow.webhook_id)
    found = session.execute(
        sa.select(WebhookDeliveryRow.id, WebhookDeliveryRow.attempts, WebhookRow)
        .join(WebhookRow, WebhookRow.id == WebhookDeliveryRow.webhook_id)
        .where(WebhookDeliveryRow.id.in_(first))
        .order_by(WebhookDeliveryRow.id)
    ).all()
    parcels: list[Parcel] = []
    under_way = Counter(busy.values())
    for delivery_id, attempts, webhook in found:
        if under_way[webhook.owner] >= of_an_owner:
            continue
        if len(parcels) == limit:
            break
        under_way[webhook.owner] += 1
        attempt = attempts + 1
        # The guard lets only one of several workers have it.
        taken = _update(session, delivery_id, attempts, due_at=utc_now(TAKEN_S), attempts=attempt)
        if taken is not None:
            parcels.append(
                Parcel(
                    id=delivery_id,
                    webhook_id=webhook.id,
                    owner=webhook.owner,
                    attempt=attempt,
                    url=webhook.url,
                    secret=webhook.secret,
                    payload=taken.payload,
                )
            )
    return parcels


def arrived(session: Session, parcel: Parcel, status: int) -> None:
    """Record that the receiver has it."""
    _update(
        session, parcel.id, parcel.attempt,
        state="delivered", due_at=None, last_status=status, last_error=None, ended_at=utc_now(),
    )  # fmt: skip


def failed(
    session: Session, parcel: Parcel, why: str, status: int | None, *, again_s: float | None
) -> None:
    """Record a failed attempt.

    Parameters
    ----------
    again_s
        Seconds until the next attempt; None to give up.
    """
    told: dict[str, Any] = {"last_status": status, "last_error": why}
    if again_s is None:
        told |= {"state": "failed", "due_at": None, "ended_at": utc_now()}
    else:
        told |= {"due_at": utc_now(again_s)}
    _update(session, parcel.id, parcel.attempt, **told)


def disable(session: Session, webhook_id: str, why: str) -> None:
    """Stop sending to this webhook, including pending messages."""
    session.execute(
        sa.update(WebhookRow)
        .where(WebhookRow.id == webhook_id, WebhookRow.disabled_at.is_(None))
        .values(disabled_at=utc_now(), disabled_because=why)
    )
    session.execute(
        sa.update(WebhookDeliveryRow)
        .where(WebhookDeliveryRow.webhook_id == webhook_id, WebhookDeliveryRow.state == "pending")
        .values(state="failed", due_at=None, last_error=why, ended_at=utc_now())
    )


def sweep(session: Session) -> None:
    """Delete some deliveries that ended long ago."""
    old = sa.select(WebhookDeliveryRow.id).where(WebhookDeliveryRow.ended_at < utc_now(-KEEP_S))
    ids = session.scalars(old.limit(_SWEPT_AT_ONCE)).all()
    if ids:
        session.execute(sa.delete(WebhookDeliveryRow).where(WebhookDeliveryRow.id.in_(ids)))


def _update(session: Session, delivery_id: str, attempt: int, **values: Any) -> sa.Row[Any] | None:
    """Change a delivery if it is still at this attempt; return its payload, otherwise None."""
    row = WebhookDeliveryRow
    is_own = sa.and_(row.id == delivery_id, row.attempts == attempt, row.state == "pending")
    return changed(session, row, is_own, row.payload, **values)
