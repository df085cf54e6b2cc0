"""One owner that stores more and more."""

from __future__ import annotations

import httpx

from service.answers.chunks import Chunk
from service.jobs import lease
from service.jobs.lease import Outcome
from service.stores import usage_store
from tests.attack.conftest import Door, MakeDoor
from tests.service.factories import satellite, target
from tests.service.problems import assert_problem


def used(door: Door, owner: str) -> tuple[int, int]:
    with door.jobs.database.reading() as session:
        return usage_store.used(session, owner)


def test_rows_of_files_are_counted_for_their_owner(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, max_rows_per_tenant=5) as door:
        greedy, other = door.key("submit", "greedy"), door.key("submit", "other")
        body = {"name": "Three", "targets": [target(id=name) for name in "abc"]}

        def send(key: dict[str, str]) -> int:
            return door.client.post("/v1/target-catalogs", json=body, headers=key).status_code

        assert send(greedy) == 201
        refused = door.client.post("/v1/target-catalogs", json=body, headers=greedy)
        assert_problem(refused, 403, "quota_exceeded")
        assert used(door, "greedy")[0] == 3  # refused requests are not stored
        assert len(door.client.get("/v1/target-catalogs", headers=greedy).json()["items"]) == 1
        assert send(other) == 201


def test_orders_are_counted_for_their_owner(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, max_rows_per_tenant=2) as door:
        greedy, other = door.key("submit", "greedy"), door.key("submit", "other")
        made = door.client.post("/v1/satellites", json=satellite(), headers=other)
        assert made.status_code == 201
        order = {
            "datetime": "2026-03-01T00:00:00Z/2026-03-02T00:00:00Z",
            "geometry": {"type": "Point", "coordinates": [8.0, 47.0]},
            "order_parameters": {},
        }

        def send(key: dict[str, str]) -> httpx.Response:
            return door.client.post("/stapi/products/paper/orders", json=order, headers=key)

        assert [send(greedy).status_code for _ in range(2)] == [201, 201]
        assert_problem(send(greedy), 403, "quota_exceeded")
        assert used(door, "greedy")[0] == 2
        orders = door.client.get("/stapi/orders", headers=greedy).json()["features"]
        assert len(orders) == 2
        assert send(other).status_code == 201


def test_what_jobs_find_is_counted_and_who_is_full_sends_no_more(make_door: MakeDoor) -> None:
    with make_door(require_keys=True, max_stored_mb_per_tenant=0.5) as door:
        greedy, other = door.key("submit", "greedy"), door.key("submit", "other")
        job_id = door.submit(greedy)
        chunk = Chunk(kind="head", text="x" * 400_000, first=0, num_items=0)
        found = Outcome(state="succeeded", chunks=(chunk,), num_shared_bytes=200_000)
        with door.jobs.database.transaction() as session:
            held = lease.start(session, job_id, 1, lease_s=60.0)
            assert held is not None
            assert lease.finish(session, held, found)
        assert used(door, "greedy") == (2, 600_000)
        body = {"scenario_id": door.jobs.scenario_id, "solver": "rule"}
        refused = door.client.post("/v1/jobs", json=body, headers=greedy)
        assert_problem(refused, 403, "quota_exceeded")
        door.submit(other)
