"""Creating webhooks, reading them, and what is refused."""

from __future__ import annotations

import pytest

from tests.service.access.conftest import MakeDoor
from tests.service.access.test_keys import operations
from tests.service.problems import assert_problem
from tests.service.webhooks.conftest import Post, StartCourier

SECRET = "whsec_"


def test_a_webhook_shows_its_secret_once(post: Post) -> None:
    made = post.webhook("/here", name="ops room", events=["job.failed", "job.succeeded"])
    assert made["secret"].startswith(SECRET)
    assert made["events"] == ["job.succeeded", "job.failed"]
    assert (made["name"], made["owner"], made["disabled_at"]) == ("ops room", "ops", None)
    key = post.door.key("read")
    shown = post.door.client.get(made["links"]["self"], headers=key)
    (listed,) = post.door.client.get("/v1/webhooks", headers=key).json()["items"]
    assert shown.json() == listed == {k: v for k, v in made.items() if k != "secret"}
    known = post.door.client.get(
        made["links"]["self"], headers=key | {"If-None-Match": shown.headers["etag"]}
    )
    assert known.status_code == 304
    other = post.webhook()
    assert other["secret"] != made["secret"]
    assert other["events"] == ["job.succeeded", "job.failed", "job.cancelled", "job.expired"]


def test_a_deleted_webhook_hears_nothing_more(post: Post, courier: StartCourier) -> None:
    made = post.webhook()
    key = post.door.key("submit")
    post.door.client.post(f"{made['links']['self']}/test", headers=key)
    assert len(post.rows()) == 1
    assert post.door.client.delete(made["links"]["self"], headers=key).status_code == 204
    assert post.rows() == []
    gone = post.door.client.get(made["links"]["self"], headers=key)
    assert_problem(gone, 404, "not_found")


def test_a_test_event_arrives(post: Post, courier: StartCourier) -> None:
    made = post.webhook("/test-me")
    sent = post.door.client.post(f"{made['links']['self']}/test", headers=post.door.key("submit"))
    assert sent.status_code == 202
    assert (sent.json()["event"], sent.json()["state"]) == ("test", "pending")
    with courier():
        post.until_ended()
    (one,) = post.receiver.received
    assert (one.path, one.id, one.event["type"]) == ("/test-me", sent.json()["id"], "test")
    assert one.is_signed_with(made["secret"])


def test_webhooks_belong_to_an_owner(post: Post) -> None:
    made = post.webhook()
    stranger = post.door.key("submit", "science")
    assert post.door.client.get("/v1/webhooks", headers=stranger).json()["items"] == []
    calls = [
        (method, path.replace("{webhook_id}", made["id"]))
        for method, path, _ in operations(post.door.client)
        if "{webhook_id}" in path
    ]
    assert len(calls) == 5
    for method, path in calls:
        hidden = post.door.client.request(method, path, headers=stranger)
        assert_problem(hidden, 404, "not_found")
    boss = post.door.key("admin", "boss")
    assert len(post.door.client.get("/v1/webhooks", headers=boss).json()["items"]) == 1


def test_an_owner_may_not_have_very_many(post: Post) -> None:
    for _ in range(20):
        post.webhook()
    refused = post.door.client.post(
        "/v1/webhooks", json={"url": post.receiver.url}, headers=post.door.key("submit")
    )
    assert_problem(refused, 422, "too_many_webhooks")
    post.webhook(owner="science")


@pytest.mark.parametrize(
    "url",
    [
        "http://ops.example/",  # without TLS
        "https://127.0.0.1/",
        "https://10.1.2.3:8443/",
        "https://169.254.169.254/latest/meta-data/",
        "https://[::1]/",
        "https://[::ffff:10.0.0.1]/",
        "https://[64:ff9b::7f00:1]/",
        "https://[fe80::1]/",
        "https://localhost/",
        "https://user:password@ops.example/",
        "https://ops.example/#part",
        "https:///path",
        "https://ops.example:70000/",
        "https://[::1/",
        "ftp://ops.example/",
        "https://ops.example/a b",
        "https://ops.example/\r\nX: y",
        "https://öps.example/",
        "ops.example",
    ],
)
def test_addresses_that_may_not_be_called_are_refused(make_door: MakeDoor, url: str) -> None:
    with make_door() as door:
        refused = door.client.post("/v1/webhooks", json={"url": url})
        problem = assert_problem(refused, 422, "webhook_address_refused")
        assert problem["errors"][0]["pointer"] == "/url"
        assert door.client.get("/v1/webhooks").json()["items"] == []


def test_public_addresses_are_taken(make_door: MakeDoor) -> None:
    with make_door() as door:
        for url in ("https://ops.example/slewline?x=1", "https://9.9.9.9:8443/"):
            assert door.client.post("/v1/webhooks", json={"url": url}).status_code == 201


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({}, "/url"),
        ({"url": "https://x.example/", "events": []}, "/events"),
        ({"url": "https://x.example/", "events": ["job.started"]}, "/events/0"),
        ({"url": "https://x.example/", "secret": "mine"}, "/secret"),
        ({"url": 7}, "/url"),
    ],
)
def test_a_wrong_body_is_told_where(
    make_door: MakeDoor, body: dict[str, object], pointer: str
) -> None:
    with make_door() as door:
        refused = door.client.post("/v1/webhooks", json=body)
        assert refused.status_code == 422
        assert [error["pointer"] for error in refused.json()["errors"]] == [pointer]
