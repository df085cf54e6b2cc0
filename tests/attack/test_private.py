"""One owner's data, and how much of it another owner sees."""

from __future__ import annotations

from typing import Any

import httpx

from service.access import key_store
from service.access.tokens import key_id_of
from service.scenarios import freezing
from service.scenarios.freezing import FrozenScenario
from tests.missions import Document, drawn_targets, paper_mission
from tests.service.access.conftest import Door
from tests.service.jobs.conftest import SUMMARY
from tests.service.problems import assert_problem
from tests.service.webhooks.conftest import Post

Key = dict[str, str]


def seen(door: Door, key: Key) -> set[str]:
    """Return the scenarios that are listed."""
    answer = door.client.get("/v1/scenarios?limit=500", headers=key)
    return {item["id"] for item in answer.json()["items"]}


def post_job(door: Door, key: Key, file: Document) -> Document:
    answer = door.client.post("/v1/jobs", json={"scenario": file, "solver": "rule"}, headers=key)
    assert answer.status_code == 202, answer.text
    job: Document = answer.json()
    return job


def test_a_scenario_that_came_with_a_job_is_its_owners(door: Door) -> None:
    mine, other, admin = door.key("submit", "a"), door.key("submit", "b"), door.key("admin", "c")
    file = paper_mission(drawn_targets(5))
    scenario = post_job(door, mine, file)["scenario"]["id"]
    where = f"/v1/scenarios/{scenario}"
    assert scenario in seen(door, mine) & seen(door, admin)
    assert scenario not in seen(door, other)
    for path in (where, f"{where}?expand=true", f"{where}/opportunities"):
        assert_problem(door.client.get(path, headers=other), 404, "not_found")
        assert door.client.get(path, headers=mine).status_code in (200, 503)
    body = {"scenario_id": scenario, "solver": "rule"}
    for path, asked in (
        ("/v1/jobs", body),
        ("/v1/comparisons", {"scenario_id": scenario, "runs": [{"solver": "rule"}]}),
    ):
        assert_problem(door.client.post(path, json=asked, headers=other), 422, "unknown_scenario")
        assert door.client.post(path, json=asked, headers=mine).status_code == 202
    # An equal scenario has the same id for both owners, and shows nothing more than that.
    assert post_job(door, other, file)["scenario"]["id"] == scenario
    assert scenario in seen(door, other) & seen(door, mine)
    assert scenario not in seen(door, door.key("read", "d"))


def test_a_scenario_stored_for_all_is_new_to_who_stores_it(door: Door) -> None:
    frozen = FrozenScenario(name=None, content="{}", sha256="a" * 64, summary=SUMMARY)
    found = []
    for owner in ("a", "a", None, "b"):
        with door.jobs.database.transaction() as session:
            row, is_new = freezing.save(session, frozen, owner)
            found.append(is_new)
    assert found == [True, False, True, False]
    assert row.id in seen(door, door.key("read", "d"))


def test_who_runs_a_job_again_sees_its_scenario(door: Door) -> None:
    job = post_job(door, door.key("submit", "a"), paper_mission(drawn_targets(5)))
    answer = door.client.post(f"{job['links']['self']}/rerun", headers=door.key("admin", "c"))
    assert answer.status_code == 202
    assert job["scenario"]["id"] in seen(door, door.key("read", "c"))


def test_a_revoked_key_hears_no_more(door: Door) -> None:
    token = door.token("submit")
    key = {"Authorization": f"Bearer {token}"}
    job_id = door.submit(key)
    heard: list[str] = []
    with door.client.stream("GET", f"/v1/jobs/{job_id}/events", headers=key) as answer:
        for line in answer.iter_lines():
            if not heard:
                key_id = key_id_of(token)
                assert key_id is not None
                with door.jobs.database.transaction() as session:
                    assert key_store.revoke(session, key_id)
            heard.append(line)
    # The job still waits: only the key has ended the stream.
    assert door.jobs.job(job_id).state == "queued"
    assert sum(line == ": nothing new" for line in heard) <= 1


def test_a_webhooks_secret_is_not_shown_again(post: Post) -> None:
    key = post.door.key("submit") | {"Idempotency-Key": "once"}
    made = [create_webhook(post, key) for _ in range(2)]
    assert [answer.status_code for answer in made] == [201, 201]
    first, second = (answer.json() for answer in made)
    assert first.pop("secret").startswith("whsec_")
    assert second == first | {"secret": None}


def create_webhook(post: Post, key: Key) -> httpx.Response:
    body: dict[str, Any] = {"url": post.receiver.url}
    return post.door.client.post("/v1/webhooks", json=body, headers=key)
