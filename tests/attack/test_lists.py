"""Lists that everybody reads, filled with data that hardly anybody needs."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.api.paging import MOST_BYTES
from service.db.clock import utc_now
from service.db.ids import new_id
from service.db.rows import ScenarioRow
from tests.service.factories import post, satellite, send
from tests.service.jobs.conftest import SUMMARY, Jobs
from tests.service.problems import assert_problem

HORIZON = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T02:00:00Z"}
NUM_PINS = 3000


@pytest.fixture
def question(client: httpx.Client) -> dict[str, Any]:
    """Return a scenario with many targets whose ids have the maximum length."""
    ids = [f"{'x' * 190}{number:05d}" for number in range(NUM_PINS)]
    lines = [f"{own_id},{1 + i * 0.001},8.0" for i, own_id in enumerate(ids)]
    text = "\n".join(["id,lat_deg,lon_deg", *lines])
    answer = send(client, "/v1/target-catalogs", text, "text/csv")
    assert answer.status_code == 201, answer.text
    return {
        "horizon": HORIZON,
        "satellite_ids": [post(client, "/v1/satellites", satellite())["id"]],
        "target_catalog_ids": [answer.json()["id"]],
        "pins": {"forbid": ids},
    }


def test_pins_stand_in_the_scenario_and_in_no_list(
    client: httpx.Client, question: dict[str, Any]
) -> None:
    made = [
        post(client, "/v1/scenarios", question | {"horizon": HORIZON | {"end": end}})
        for end in ("2026-03-01T02:00:00Z", "2026-03-01T03:00:00Z", "2026-03-01T04:00:00Z")
    ]
    assert len(json.dumps(made[0])) > 100 * NUM_PINS
    listed = client.get("/v1/scenarios")
    assert len(listed.json()["items"]) == 1 + len(made)
    assert len(listed.content) < 10_000
    assert client.get(f"/v1/scenarios/{made[0]['id']}").json() == made[0]
    assert made[0]["pins"]["forbid"] == question["pins"]["forbid"]


def test_a_pin_that_is_listed_twice_is_refused(
    client: httpx.Client, question: dict[str, Any]
) -> None:
    own_id = question["pins"]["forbid"][0]
    block = {"satellite_id": question["satellite_ids"][0]} | HORIZON
    for pins, pointer in (
        ({"forbid": [own_id, own_id]}, "/pins/forbid/1"),
        ({"skip": [{"target_id": own_id}, {"target_id": own_id}]}, "/pins/skip/1"),
        ({"block": [block, block]}, "/pins/block/1"),
    ):
        answer = client.post("/v1/scenarios", json=question | {"pins": pins})
        problem = assert_problem(answer, 422, "duplicate_pin")
        assert problem["errors"][0]["pointer"] == pointer


def test_a_page_of_large_items_ends_early_and_leads_to_the_rest(
    jobs: Jobs, client: httpx.Client
) -> None:
    # As the first release stored them, pins and all.
    pins = {"forbid": ["x" * 200] * (MOST_BYTES // 500)}
    ids = [new_id() for _ in range(5)]
    with jobs.database.transaction() as session:
        for own_id in ids:
            row = {"id": own_id, "sha256": own_id, "summary": SUMMARY | {"pins": pins}}
            session.execute(
                sa.insert(ScenarioRow).values(content="{}", created_at=utc_now(), **row)
            )
    found, path = [], "/v1/scenarios"
    while path:
        answer = client.get(path)
        found += [item["id"] for item in answer.json()["items"]]
        path = answer.links["next"]["url"] if "next" in answer.links else ""
    assert found == [*reversed(ids), jobs.scenario_id]
    first = client.get("/v1/scenarios", params={"limit": 500}).json()
    assert 1 <= len(first["items"]) < len(ids)
