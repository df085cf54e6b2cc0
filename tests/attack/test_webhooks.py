"""Receivers that never answer, and how long other owners' messages wait."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import httpx
import pytest

from service.db.rows import WebhookRow
from service.webhooks import courier as couriers
from service.webhooks import outbox
from service.wire import webhooks as wire
from tests.patience import PATIENCE_S, wait_until
from tests.service.problems import assert_problem
from tests.service.webhooks.conftest import Post, StartCourier

OTHERS = "ops"
SILENT = "silent"


@pytest.fixture
def silent_url(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A receiver that accepts connections and says nothing; couriers wait long for it."""
    monkeypatch.setattr(couriers, "_ANSWER_WITHIN_S", 10 * PATIENCE_S)
    with socket.create_server(("127.0.0.1", 0), backlog=1000) as listener:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}/"


def make_webhooks(post: Post, url: str, number: int) -> list[str]:
    key = post.door.key("submit", SILENT)
    made = [
        post.door.client.post("/v1/webhooks", json={"url": url}, headers=key) for _ in range(number)
    ]
    return [answer.json()["id"] for answer in made]


def queue_tests(post: Post, webhook_id: str, number: int) -> None:
    with post.jobs.database.transaction() as session:
        row = session.get_one(WebhookRow, webhook_id)
        for _ in range(number):
            data = wire.TestData(message="", webhook_id=webhook_id)
            outbox.queue(session, row, "test", data, job_id=None)


def test_a_silent_receiver_holds_up_no_other_owner(
    post: Post, courier: StartCourier, silent_url: str
) -> None:
    for webhook_id in make_webhooks(post, silent_url, 20):
        queue_tests(post, webhook_id, 30)
    webhook = post.webhook("/mine", OTHERS)
    with courier():
        # Until all slots that the silent receiver can occupy are taken.
        wait_until(lambda: sum(row.attempts for row in post.rows()) >= 4)
        key = post.door.key("submit", OTHERS)
        post.door.client.post(f"{webhook['links']['self']}/test", headers=key)
        wait_until(lambda: post.receiver.of_path("/mine"))
        assert sum(row.attempts for row in post.rows() if row.webhook_id != webhook["id"]) == 4


def test_a_webhook_is_tested_a_few_times_and_no_more(post: Post, silent_url: str) -> None:
    (webhook_id,) = make_webhooks(post, silent_url, 1)
    key = post.door.key("submit", SILENT)

    def test_it() -> httpx.Response:
        return post.door.client.post(f"/v1/webhooks/{webhook_id}/test", headers=key)

    assert [test_it().status_code for _ in range(5)] == [202] * 5
    refused = test_it()
    assert_problem(refused, 429, "too_many_deliveries")
    assert int(refused.headers["retry-after"]) > 0


def test_so_many_messages_wait_for_a_webhook_and_no_more(
    post: Post, silent_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox, "MOST_PENDING", 3)
    (webhook_id,) = make_webhooks(post, silent_url, 1)
    queue_tests(post, webhook_id, 5)
    rows = post.rows()
    assert [row.state for row in rows] == ["pending"] * 3 + ["failed"] * 2
    assert "waiting" in str(rows[-1].last_error)
    assert rows[-1].ended_at is not None
