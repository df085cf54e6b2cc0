"""Every end of a job is delivered to its subscribers: signed, with retries, and to no one else."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
import sqlalchemy as sa
from sqlalchemy.orm import Session
from standardwebhooks.webhooks import Webhook

from service.db.clock import utc_now
from service.db.rows import WebhookDeliveryRow, WebhookRow
from service.jobs import lease
from service.jobs.lease import Outcome
from service.jobs.reconcile import Reconciler
from service.webhooks import outbox
from tests.patience import PATIENCE_S
from tests.service.answers import chunks_of_timeline
from tests.service.jobs.conftest import Jobs, Workers
from tests.service.jobs.work import EMPTY
from tests.service.webhooks.conftest import Post, StartCourier


def end(jobs: Jobs, outcome: Outcome | None, *, tenant: str = "ops") -> str:
    """Start a job and end it; None cancels it before it starts."""
    job_id = jobs.submit("rule", tenant=tenant)
    with jobs.database.transaction() as session:
        if outcome is None:
            assert lease.request_cancel(session, job_id)
        else:
            held = lease.start(session, job_id, 1, lease_s=60.0)
            assert held is not None
            assert lease.finish(session, held, outcome)
    return job_id


SUCCEEDED = Outcome(state="succeeded", termination="optimal")


def test_each_end_of_a_job_is_told_once_and_signed(post: Post, courier: StartCourier) -> None:
    webhook = post.webhook("/ends")
    ends = {
        end(post.jobs, SUCCEEDED): "job.succeeded",
        end(post.jobs, Outcome.failed("no_such_orbit", "The orbit is not one.")): "job.failed",
        end(post.jobs, None): "job.cancelled",
    }
    with courier():
        post.until_ended(3)
    told = {one.event["data"]["job_id"]: one.event for one in post.receiver.received}
    assert {job_id: event["type"] for job_id, event in told.items()} == ends
    assert len(post.receiver.received) == 3
    for one in post.receiver.received:
        assert one.is_signed_with(webhook["secret"])
        assert Webhook(webhook["secret"]).verify(one.body, one.headers) == one.event
        assert not one.is_signed_with("whsec_" + "A" * 43 + "=")
        data = one.event["data"]
        job = post.jobs.job(data["job_id"])
        assert (data["state"], data["termination"]) == (job.state, job.termination)
        assert data["error"] == job.error
        assert data["links"]["job"] == f"/v1/jobs/{job.id}"
        assert one.event["timestamp"].endswith("Z")
    found = post.deliveries(webhook)
    assert {(row["state"], row["attempts"], row["last_status"]) for row in found} == {
        ("delivered", 1, 204)
    }
    assert {row["id"] for row in found} == {one.id for one in post.receiver.received}


def test_a_job_that_the_reconciler_ends_is_told_as_well(post: Post) -> None:
    post.webhook()
    job_id = post.jobs.submit("rule", tenant="ops")
    with post.jobs.database.transaction() as session:
        assert lease.start(session, job_id, 1, lease_s=-1.0)
    Reconciler(post.jobs.database, post.jobs.queue, lease_s=1.0, max_attempts=1).run()
    assert post.jobs.job(job_id).state == "failed"
    assert [(row.event, row.job_id) for row in post.rows()] == [("job.failed", job_id)]


def test_what_is_handed_back_has_not_ended_unless_it_was_cancelled(post: Post) -> None:
    post.webhook()
    for cancels in (False, True):
        job_id = post.jobs.submit("rule", tenant="ops")
        with post.jobs.database.transaction() as session:
            held = lease.start(session, job_id, 1, lease_s=60.0)
            assert held is not None
            if cancels:
                assert lease.request_cancel(session, job_id)
            lease.hand_back(session, post.jobs.queue, held)
        assert [row.event for row in post.rows()] == (["job.cancelled"] if cancels else [])


def test_an_end_that_is_not_committed_is_not_told(post: Post) -> None:
    post.webhook()
    job_id = post.jobs.submit("rule", tenant="ops")
    with Session(post.jobs.database.engine) as session:
        assert lease.request_cancel(session, job_id)
        assert session.scalar(sa.select(sa.func.count(WebhookDeliveryRow.id))) == 1
        session.rollback()
    assert post.rows() == []


def test_only_the_owners_webhooks_hear_and_only_what_they_asked_for(
    post: Post, courier: StartCourier
) -> None:
    post.webhook("/failures", events=["job.failed"])
    post.webhook("/all")
    post.webhook("/science", owner="science")
    end(post.jobs, SUCCEEDED)
    end(post.jobs, SUCCEEDED, tenant="nobody-listens")
    failed = end(post.jobs, Outcome.failed("x", "y"))
    with courier():
        post.until_ended(3)
    paths = [one.path for one in post.receiver.received]
    assert sorted(paths) == ["/all", "/all", "/failures"]
    (only,) = post.receiver.of_path("/failures")
    assert only.event["data"]["job_id"] == failed


def test_it_is_sent_again_until_it_is_taken(post: Post, courier: StartCourier) -> None:
    post.receiver.answers = [(500, {}), (302, {"Location": "/elsewhere"}), (200, {})]
    webhook = post.webhook()
    end(post.jobs, SUCCEEDED)
    with courier():
        post.until_ended()
    first, *others = post.receiver.received
    assert [one.path for one in others] == ["/", "/"]
    for one in others:
        assert (one.id, one.body) == (first.id, first.body)
        assert one.is_signed_with(webhook["secret"])
    (row,) = post.deliveries(webhook)
    assert (row["state"], row["attempts"], row["last_error"]) == ("delivered", 3, None)


def test_a_receiver_may_ask_for_time(post: Post, courier: StartCourier) -> None:
    post.receiver.answers = [(503, {"Retry-After": "2"})]
    post.webhook()
    end(post.jobs, SUCCEEDED)
    with courier():
        post.until_ended()
    first, second = post.receiver.received
    assert second.at_s - first.at_s > 1.9


def test_it_fails_in_the_end_and_can_be_sent_again_by_hand(
    post: Post, courier: StartCourier
) -> None:
    post.receiver.answers = [(500, {})] * 4
    webhook = post.webhook()
    end(post.jobs, SUCCEEDED)
    with courier():
        post.until_ended()
        (row,) = post.deliveries(webhook)
        assert (row["state"], row["attempts"], row["due_at"]) == ("failed", 4, None)
        assert row["last_error"] == "The receiver answered 500."
        address = f"{webhook['links']['deliveries']}/{row['id']}/redeliver"
        again = post.door.client.post(address, headers=post.door.key("submit"))
        assert again.status_code == 202
        post.until_ended(2)
    assert again.json()["id"] == post.receiver.received[-1].id != row["id"]
    assert post.receiver.received[-1].body == post.receiver.received[0].body
    assert [row["state"] for row in post.deliveries(webhook)] == ["delivered", "failed"]


def test_a_receiver_that_is_gone_for_good_is_left_alone(post: Post, courier: StartCourier) -> None:
    post.receiver.answers = [(410, {})]
    webhook = post.webhook()
    end(post.jobs, SUCCEEDED)
    end(post.jobs, SUCCEEDED)
    with courier():
        post.until_ended(2)
        end(post.jobs, SUCCEEDED)
    assert len(post.receiver.received) == 1
    assert len(post.rows()) == 2
    key = post.door.key("submit")
    shown = post.door.client.get(webhook["links"]["self"], headers=key).json()
    assert shown["disabled_at"] is not None
    assert shown["disabled_because"] == "The receiver answered 410."
    refused = post.door.client.post(f"{webhook['links']['self']}/test", headers=key)
    assert refused.status_code == 409


def test_nobody_waits_for_somebody_elses_slow_receiver(post: Post, courier: StartCourier) -> None:
    post.webhook("/slow")
    post.webhook("/quick")
    with courier():
        for _ in range(3):
            end(post.jobs, SUCCEEDED)
        post.jobs.until(lambda: len(post.receiver.of_path("/quick")) == 3)
        assert len(post.receiver.of_path("/slow")) == 1
        post.receiver.hold.set()
        post.until_ended(6)
    assert len(post.receiver.of_path("/slow")) == 3


def test_no_receiver_at_all_is_told_in_the_delivery(post: Post, courier: StartCourier) -> None:
    nowhere = post.webhook()
    with post.jobs.database.transaction() as session:
        session.execute(sa.update(WebhookRow).values(url="http://127.0.0.1:9/"))
    end(post.jobs, SUCCEEDED)
    with courier():
        post.until_ended()
    (row,) = post.deliveries(nowhere)
    assert (row["state"], row["last_status"]) == ("failed", None)
    assert "ConnectError" in row["last_error"]


# Each of these is looked up as a name; the system reads it as 127.0.0.1 or as ::1.
@pytest.mark.parametrize("host", ["2130706433", "0x7f000001", "127.1", "localhost", "[::1]"])
def test_private_addresses_are_refused_when_it_comes_to_sending(
    post: Post, courier: StartCourier, host: str
) -> None:
    webhook = post.webhook()
    port = post.receiver.url.rpartition(":")[2]
    with post.jobs.database.transaction() as session:
        session.execute(sa.update(WebhookRow).values(url=f"http://{host}:{port}/"))
    end(post.jobs, SUCCEEDED)
    with courier(private=False):
        post.until_ended()
    assert post.receiver.received == []
    (row,) = post.deliveries(webhook)
    assert row["state"] == "failed"
    assert "not on the public internet" in row["last_error"]


def test_two_couriers_send_each_once(post: Post, courier: StartCourier) -> None:
    for number in range(4):
        post.webhook(f"/{number}")
    with courier(look_every_s=0.01), courier(look_every_s=0.01):
        for _ in range(5):
            end(post.jobs, SUCCEEDED)
        post.until_ended(20)
    assert len({one.id for one in post.receiver.received}) == len(post.receiver.received) == 20


def test_what_a_dead_courier_had_taken_comes_due_again(post: Post, courier: StartCourier) -> None:
    post.webhook()
    end(post.jobs, SUCCEEDED)
    with post.jobs.database.transaction() as session:
        (taken,) = outbox.take(session, busy={}, limit=5, of_an_owner=5)
        assert outbox.take(session, busy={}, limit=5, of_an_owner=5) == []
        overdue = sa.update(WebhookDeliveryRow).values(due_at=post.rows()[0].created_at)
        session.execute(overdue)
    with courier():
        post.until_ended()
    with post.jobs.database.transaction() as session:
        # It was not dead, only slow: its report no longer counts.
        outbox.failed(session, taken, "too late", None, again_s=None)
    assert [(row.state, row.attempts) for row in post.rows()] == [("delivered", 2)]


def test_old_deliveries_are_forgotten(post: Post, courier: StartCourier) -> None:
    post.webhook()
    end(post.jobs, SUCCEEDED)
    with courier():
        post.until_ended()
    with post.jobs.database.transaction() as session:
        outbox.sweep(session)
    assert len(post.rows()) == 1
    old: Any = sa.update(WebhookDeliveryRow).values(ended_at=utc_now(-outbox.KEEP_S - 60.0))
    with post.jobs.database.transaction() as session:
        session.execute(old)
        outbox.sweep(session)
    assert post.rows() == []


def test_workers_are_couriers(post: Post) -> None:
    """A real job, run by a real worker, reports its end to a real receiver."""
    webhook = post.webhook()
    settings = post.jobs.settings.model_copy(update={"webhook_private_addresses": True})
    workers = Workers(dataclasses.replace(post.jobs, settings=settings))
    worker = workers.start()
    try:
        job_id = post.jobs.submit("answer", tenant="ops")
        post.until_ended()
    finally:
        worker.terminate()
        assert worker.wait(PATIENCE_S) == 0
    (one,) = post.receiver.received
    assert one.is_signed_with(webhook["secret"])
    assert one.event["data"]["job_id"] == job_id
    assert one.event["type"] == "job.succeeded"


def test_an_end_tells_whether_the_plan_breaks_limits(post: Post, courier: StartCourier) -> None:
    post.webhook()
    outcome = Outcome(
        state="succeeded",
        chunks=tuple(chunks_of_timeline(EMPTY)),
        figures={"validity": "violations"},
        warnings=("Elements are old.",),
    )
    end(post.jobs, outcome)
    with courier():
        post.until_ended(1)
    data = post.receiver.received[0].event["data"]
    assert (data["state"], data["validity"]) == ("succeeded", "violations")
    assert data["warnings"] == ["Elements are old."]
