"""Jobs belong to the owner of the key that submitted them; other owners do not see them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import sqlalchemy as sa

from service.db.rows import JobRow
from tests.service.access.conftest import Door
from tests.service.access.test_keys import operations
from tests.service.factories import satellite
from tests.service.problems import assert_problem


def listed(door: Door, key: dict[str, str], **query: str | int) -> list[str]:
    answer = door.client.get("/v1/jobs", params=query, headers=key)
    return [job["id"] for job in answer.json()["items"]]


def test_an_owner_lists_its_own_jobs_and_an_admin_all(door: Door) -> None:
    ops, science = door.key("submit", "ops"), door.key("submit", "science")
    first, second, third = (door.submit(key) for key in (ops, science, ops))
    assert listed(door, ops) == [third, first]
    assert listed(door, door.key("read", "ops")) == [third, first]
    assert listed(door, science) == [second]
    assert listed(door, door.key("read", "nobody-yet")) == []
    assert listed(door, door.key("admin", "boss")) == [third, second, first]
    page = door.client.get("/v1/jobs", params={"limit": 1}, headers=ops).json()
    assert listed(door, ops, limit=1, cursor=page["next"]) == [first]


def test_the_queue_counts_a_job_to_its_owner(door: Door) -> None:
    job = door.submit(door.key("submit", "science"))
    assert door.jobs.job(job).tenant == "science"
    queued = sa.text("SELECT queue_partition_key FROM workflow_status WHERE workflow_uuid = :name")
    if door.jobs.database.engine.dialect.name == "postgresql":
        queued = sa.text(
            "SELECT queue_partition_key FROM dbos.workflow_status WHERE workflow_uuid = :name"
        )
    with door.jobs.database.reading() as session:
        assert session.scalar(queued, {"name": f"{job}:1"}) == "science"


def test_every_call_on_the_job_of_another_owner_finds_nothing(door: Door) -> None:
    job = door.submit(door.key("submit", "ops"))
    stranger = door.key("submit", "science")
    calls = [
        (method, path.replace("{job_id}", job).replace("{suffix}", "json"))
        for method, path, _ in operations(door.client)
        if "{job_id}" in path
    ]
    assert len(calls) >= 7
    for method, path in calls:
        hidden = door.client.request(method, path, headers=stranger)
        problem = assert_problem(hidden, 404, "not_found")
        missing = door.client.request(method, path.replace(job, "none"), headers=stranger)
        assert problem["detail"] == missing.json()["detail"].replace("none", job)
    assert door.jobs.job(job).state == "queued"


def test_a_job_is_compared_with_none_of_another_owner(door: Door) -> None:
    ops, stranger = door.key("submit", "ops"), door.key("submit", "science")
    own, foreign = door.submit(ops), door.submit(stranger)
    hidden = door.client.get(f"/v1/jobs/{own}/diff/{foreign}", headers=ops)
    problem = assert_problem(hidden, 404, "not_found")
    missing = door.client.get(f"/v1/jobs/{own}/diff/none", headers=ops)
    assert problem["detail"] == missing.json()["detail"].replace("none", foreign)
    boss = door.key("admin", "boss")
    seen = door.client.get(f"/v1/jobs/{own}/diff/{foreign}", headers=boss)
    assert_problem(seen, 409, "not_ready")


def test_comparisons_belong_to_an_owner_as_jobs_do(door: Door) -> None:
    ops, stranger = door.key("submit", "ops"), door.key("submit", "science")
    boss = door.key("admin", "boss")
    body = {"scenario_id": door.jobs.scenario_id, "runs": [{"solver": "rule"}]}
    made = door.client.post("/v1/comparisons", json=body, headers=ops).json()
    address = made["links"]["self"]
    assert_problem(door.client.get(address, headers=stranger), 404, "not_found")
    assert door.client.get("/v1/comparisons", headers=stranger).json()["items"] == []
    assert listed(door, ops) == [made["runs"][0]["job_id"]]
    assert listed(door, stranger) == []
    for key in (ops, boss):
        assert door.client.get(address, headers=key).json()["id"] == made["id"]
        assert len(door.client.get("/v1/comparisons", headers=key).json()["items"]) == 1


def test_a_rerun_belongs_to_who_asked_for_it(door: Door) -> None:
    job = door.submit(door.key("submit", "ops"))
    again = door.client.post(f"/v1/jobs/{job}/rerun", headers=door.key("admin", "boss")).json()
    assert door.jobs.job(again["id"]).tenant == "boss"


def test_two_owners_may_choose_the_same_idempotency_key(door: Door) -> None:
    body = {"scenario_id": door.jobs.scenario_id, "solver": "rule"}
    made = [
        door.client.post(
            "/v1/jobs", json=body, headers=door.key("submit", owner) | {"Idempotency-Key": "k"}
        ).json()["id"]
        for owner in ("ops", "science", "ops")
    ]
    assert made[0] == made[2] != made[1]


def test_owner_and_admin_may_cancel_it(door: Door) -> None:
    ops = door.key("submit", "ops")
    for key in (ops, door.key("admin", "boss")):
        job = door.submit(ops)
        assert door.client.get(f"/v1/jobs/{job}", headers=key).status_code == 200
        assert door.client.post(f"/v1/jobs/{job}/cancel", headers=key).status_code == 202
    with door.jobs.database.reading() as session:
        assert set(session.scalars(sa.select(JobRow.state))) == {"cancelled"}


def test_a_job_of_another_owner_is_not_unchanged_either(door: Door) -> None:
    own, stranger = door.key("submit", "ops"), door.key("submit", "science")
    path = f"/v1/jobs/{door.submit(own)}"
    for etag in (door.client.get(path, headers=own).headers["etag"], "*"):
        known = {"If-None-Match": etag}
        assert door.client.get(path, headers=own | known).status_code == 304
        assert_problem(door.client.get(path, headers=stranger | known), 404, "not_found")
        assert door.client.get(path, headers=known).status_code == 401


def test_polls_at_once_are_answered_to_each_owner_for_itself(door: Door) -> None:
    """Their polls share a query and, for the same job, an answer."""
    keys = {owner: door.key("submit", owner) for owner in ("ops", "science")}
    paths = {owner: f"/v1/jobs/{door.submit(key)}" for owner, key in keys.items()}
    calls = [
        (key | known, path, caller == owner)
        for owner, path in paths.items()
        for caller, key in keys.items()
        for known in ({}, {"If-None-Match": '"1"'})
    ] * 10
    with ThreadPoolExecutor(20) as pool:
        answers = list(pool.map(lambda call: door.client.get(call[1], headers=call[0]), calls))
    for (headers, path, is_own), answer in zip(calls, answers, strict=True):
        if is_own:
            assert answer.status_code == (304 if "If-None-Match" in headers else 200)
            assert answer.headers["etag"] == '"1"'
        else:
            assert_problem(answer, 404, "not_found")
            assert path.rpartition("/")[2] in answer.json()["detail"]


def test_orders_belong_to_an_owner_and_are_recorded(door: Door) -> None:
    ops, stranger, boss = door.key("submit", "ops"), door.key("submit", "x"), door.key("admin", "a")
    made = door.client.post("/v1/satellites", json=satellite(), headers=ops)
    assert made.status_code == 201, made.text
    body = {
        "datetime": "2026-11-23T00:00:00Z/2026-11-24T00:00:00Z",
        "geometry": {"type": "Point", "coordinates": [8.5, 47.4]},
        "order_parameters": {},
    }
    calls = "/stapi/products/paper/orders"
    reader = door.client.post(calls, json=body, headers=door.key("read", "ops"))
    assert_problem(reader, 403, "insufficient_scope")
    for path in ("/stapi/", "/stapi/products", "/stapi/orders"):
        assert_problem(door.client.get(path), 401, "authentication_required")
    placed = [door.client.post(calls, json=body, headers=key) for key in (ops, ops, stranger)]
    assert [answer.status_code for answer in placed] == [201, 201, 201]
    first, second, foreign = (answer.json() for answer in placed)
    catalogs = [one["properties"]["target_catalog_id"] for one in (first, second, foreign)]
    assert catalogs[0] == catalogs[1] != catalogs[2]

    def listed(key: dict[str, str]) -> list[str]:
        return [
            one["id"] for one in door.client.get("/stapi/orders", headers=key).json()["features"]
        ]

    assert listed(ops) == [second["id"], first["id"]]
    assert listed(stranger) == [foreign["id"]]
    assert listed(boss) == [foreign["id"], second["id"], first["id"]]
    for path in (f"/stapi/orders/{foreign['id']}", f"/stapi/orders/{foreign['id']}/statuses"):
        assert_problem(door.client.get(path, headers=ops), 404, "not_found")
        assert door.client.get(path, headers=stranger).status_code == 200
    events = door.client.get("/v1/audit-events", headers=boss).json()["items"]
    orders = [(one["owner"], one["object_id"]) for one in events if one["kind"] == "order"]
    assert orders == [("x", foreign["id"]), ("ops", second["id"]), ("ops", first["id"])]
