"""Webhooks: addresses that get events of jobs and plans, and the messages sent to them."""

from __future__ import annotations

import base64
import secrets
from typing import Final

import sqlalchemy as sa
from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from service.api.conditional import matched, readable, unless_known
from service.api.deps import Call, CallDep
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.paging import PagingDep, newest_first
from service.db import clock
from service.db.rows import WebhookDeliveryRow, WebhookRow
from service.problems.faults import refuse_one
from service.problems.kinds import ServiceError
from service.stores.finding import no_such, of_owner
from service.webhooks import outbox
from service.webhooks.addresses import AddressRefused, require_good_url
from service.wire.base import Listed
from service.wire.stored import from_row
from service.wire.webhooks import (
    EVENTS,
    CreatedWebhook,
    DeliveryOut,
    TestData,
    WebhookIn,
    WebhookOut,
)

router = APIRouter(prefix="/v1/webhooks", tags=["webhooks"])

MOST_OF_AN_OWNER: Final = 20
_TEST: Final = "test"
_MOST_TESTS: Final = 5
_TEST_AGAIN_S: Final = 60
_SECRET_BYTES: Final = 32


@router.post("", status_code=201)
def create_webhook(body: WebhookIn, call: CallDep, once: OnceDep) -> CreatedWebhook:
    """Send events of the owner's jobs and plans to a URL; the answer has the signing secret."""
    try:
        require_good_url(body.url, private=call.settings.webhook_private_addresses)
    except AddressRefused as error:
        raise refuse_one("webhook_address_refused", str(error), "/url") from None
    with once.transaction() as session:
        _require_room(session, call.caller.owner)
        row = WebhookRow(
            owner=call.caller.owner,
            name=body.name,
            url=body.url,
            events=[event for event in EVENTS if event in body.events],
            secret="whsec_" + base64.b64encode(secrets.token_bytes(_SECRET_BYTES)).decode(),
            created_at=clock.now(session),
        )
        session.add(row)
        session.flush()
        shown = CreatedWebhook(**_shown(row).model_dump(), secret=row.secret)
        return once.created(session, "webhook", row.id, shown, shown_once={"secret"})


@router.get("")
def list_webhooks(call: CallDep, paging: PagingDep) -> Listed[WebhookOut]:
    """List the webhooks of the key's owner, newest first; all for the scope `admin`."""
    query = sa.select(WebhookRow).where(of_owner(WebhookRow.owner, call.caller.visible_owner))
    with call.database.reading() as session:
        return newest_first(session, query, WebhookRow.id, paging).listed(_shown)


@router.get("/{webhook_id}", response_model=WebhookOut, responses=readable())
def get_webhook(webhook_id: str, call: CallDep) -> WebhookOut | Response:
    """Return one webhook."""
    with call.database.reading() as session:
        return unless_known(call, _shown(_find(session, webhook_id, call)))


@router.delete("/{webhook_id}", status_code=204, responses=problem_responses(404, 412))
def delete_webhook(webhook_id: str, call: CallDep) -> None:
    """Delete a webhook and all its deliveries, including those still to be sent."""
    with call.noted("delete", "webhook", webhook_id) as session:
        row = matched(call, _find(session, webhook_id, call, to_change=True), _shown)
        sent = WebhookDeliveryRow.webhook_id == webhook_id
        session.execute(sa.delete(WebhookDeliveryRow).where(sent))
        session.delete(row)


@router.post("/{webhook_id}/test", status_code=202, responses=problem_responses(404, 409))
def test_webhook(webhook_id: str, once: OnceDep, call: CallDep) -> DeliveryOut:
    """Send an event of type `test`; the list of deliveries shows the result."""
    with once.transaction() as session:
        row = _find(session, webhook_id, call)
        _require_enabled(row)
        if outbox.num_pending(session, row.id, _TEST) >= _MOST_TESTS:
            raise ServiceError(
                "too_many_deliveries",
                f"{_MOST_TESTS} tests of this webhook are already waiting to be sent.",
                headers={"Retry-After": str(_TEST_AGAIN_S)},
            )
        data = TestData(message="This is a test of the webhook.", webhook_id=row.id)
        delivery_id = outbox.queue(session, row, _TEST, data, job_id=None)
        call.audit.record(session, "test", "webhook", row.id)
        return once.keep(session, _accepted(session, call.response, row, delivery_id))


@router.get("/{webhook_id}/deliveries", responses=problem_responses(404))
def list_deliveries(webhook_id: str, call: CallDep, paging: PagingDep) -> Listed[DeliveryOut]:
    """List the deliveries, newest first. They are deleted 30 days after they have ended."""
    query = sa.select(WebhookDeliveryRow).where(WebhookDeliveryRow.webhook_id == webhook_id)
    with call.database.reading() as session:
        _find(session, webhook_id, call)
        page = newest_first(session, query, WebhookDeliveryRow.id, paging)
        return page.listed(lambda row: from_row(DeliveryOut, row))


@router.post(
    "/{webhook_id}/deliveries/{delivery_id}/redeliver",
    status_code=202,
    responses=problem_responses(404, 409),
)
def redeliver(webhook_id: str, delivery_id: str, once: OnceDep, call: CallDep) -> DeliveryOut:
    """Send a message again, under a new `webhook-id`, whatever the result of the first."""
    with once.transaction() as session:
        row = _find(session, webhook_id, call)
        _require_enabled(row)
        delivery = session.get(WebhookDeliveryRow, delivery_id)
        if delivery is None or delivery.webhook_id != webhook_id:
            raise no_such("delivery", delivery_id)
        again = outbox.repeat(session, row, delivery)
        call.audit.record(session, "redeliver", "webhook", row.id)
        return once.keep(session, _accepted(session, call.response, row, again))


def _accepted(
    session: Session, response: Response, row: WebhookRow, delivery_id: str
) -> DeliveryOut:
    response.headers["Location"] = f"/v1/webhooks/{row.id}/deliveries"
    return from_row(DeliveryOut, session.get_one(WebhookDeliveryRow, delivery_id))


def _require_room(session: Session, owner: str) -> None:
    own = sa.select(sa.func.count()).select_from(WebhookRow).where(WebhookRow.owner == owner)
    if session.execute(own).scalar_one() >= MOST_OF_AN_OWNER:
        raise ServiceError(
            "too_many_webhooks",
            f"An owner may have at most {MOST_OF_AN_OWNER} webhooks; delete one.",
        )


def _require_enabled(row: WebhookRow) -> None:
    if row.disabled_at is not None:
        raise ServiceError(
            "webhook_disabled", f"{row.disabled_because} Create a new webhook to continue."
        )


def _find(session: Session, webhook_id: str, call: Call, *, to_change: bool = False) -> WebhookRow:
    return call.own(session, WebhookRow, "webhook", webhook_id, to_change=to_change)


def _shown(row: WebhookRow) -> WebhookOut:
    address = f"/v1/webhooks/{row.id}"
    links = {"self": address, "deliveries": f"{address}/deliveries"}
    return from_row(WebhookOut, row, links=links)
