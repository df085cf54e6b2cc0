"""Every change records its event in the same transaction, and the event stays."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.db.rows import AuditEventRow
from tests.service.access.conftest import Door
from tests.service.access.test_keys import operations
from tests.service.factories import ground_station, satellite, send, target, tle
from tests.service.problems import assert_problem

KEYS = {
    "id", "at", "owner", "key_id", "key_name", "request_id", "action", "kind", "object_id",
}  # fmt: skip
HORIZON = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T01:00:00Z"}
READ_ONLY = ("get", "head")


def post(client: httpx.Client, path: str, body: object) -> str:
    response = client.post(path, json=body)
    assert response.is_success, response.text
    return str(response.json()["id"])


def new_satellite(client: httpx.Client) -> str:
    return post(client, "/v1/satellites", satellite(tle=tle()))


def new_station(client: httpx.Client) -> str:
    return post(client, "/v1/ground-stations", ground_station())


def new_outage(client: httpx.Client) -> str:
    span = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T02:00:00Z"}
    return post(client, "/v1/outages", {"station_id": new_station(client), **span})


def new_forecast(client: httpx.Client) -> str:
    rows = "target_id,time,clear_probability\na,2026-03-01T00:00:00Z,0.5\n"
    answer = send(client, "/v1/forecasts?name=Skies", rows, "text/csv")
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def new_spacecraft(client: httpx.Client) -> str:
    return post(client, "/v1/spacecraft", {"name": "Bus"})


def new_catalog(client: httpx.Client) -> str:
    return post(client, "/v1/target-catalogs", {"name": "c", "targets": [target()]})


def question(client: httpx.Client) -> dict[str, Any]:
    return {
        "horizon": HORIZON,
        "satellite_ids": [new_satellite(client)],
        "target_catalog_ids": [new_catalog(client)],
        "ground_station_ids": [],
    }


def new_job(client: httpx.Client) -> str:
    return post(client, "/v1/jobs", {"scenario": question(client), "solver": "rule"})


def import_satellites(client: httpx.Client) -> str:
    lines = "\n".join(tle(90007))
    answer = send(client, "/v1/satellites/import", lines, "text/plain").json()
    return str(answer["items"][0]["id"])


def import_stations(client: httpx.Client) -> str:
    rows = "name,lat_deg,lon_deg\nNorth,78,15\n"
    answer = send(client, "/v1/ground-stations/import", rows, "text/csv").json()
    return str(answer["items"][0]["id"])


def put_elements(client: httpx.Client) -> str:
    own_id = new_satellite(client)
    newer = {"tle": tle(mean_anomaly_deg=5.0)}
    assert client.put(f"/v1/satellites/{own_id}/elements", json=newer).is_success
    return own_id


def delete(make: Callable[[httpx.Client], str], path: str) -> Callable[[httpx.Client], str]:
    def change(client: httpx.Client) -> str:
        own_id = make(client)
        assert client.delete(f"{path}/{own_id}").status_code == 204
        return own_id

    return change


def cancel(client: httpx.Client) -> str:
    own_id = new_job(client)
    assert client.post(f"/v1/jobs/{own_id}/cancel").status_code == 202
    return own_id


def rerun(client: httpx.Client) -> str:
    return post(client, f"/v1/jobs/{new_job(client)}/rerun", None)


def what_if(client: httpx.Client) -> str:
    return post(client, f"/v1/jobs/{new_job(client)}/what-if", {"forbid": ["t1"]})


def compare(client: httpx.Client) -> str:
    return post(
        client, "/v1/comparisons", {"scenario": question(client), "runs": [{"solver": "rule"}]}
    )


def rename(make: Callable[[httpx.Client], str], where: str) -> Callable[[httpx.Client], str]:
    def change(client: httpx.Client) -> str:
        own_id = make(client)
        answer = client.patch(f"{where}/{own_id}", json={"name": "Another name"})
        assert answer.status_code == 200, answer.text
        return own_id

    return change


def new_webhook(client: httpx.Client) -> str:
    return post(client, "/v1/webhooks", {"url": "https://ops.example/"})


def try_webhook(client: httpx.Client) -> str:
    own_id = new_webhook(client)
    post(client, f"/v1/webhooks/{own_id}/test", None)
    return own_id


def redeliver(client: httpx.Client) -> str:
    own_id = new_webhook(client)
    deliveries = f"/v1/webhooks/{own_id}/deliveries"
    post(
        client, f"{deliveries}/{post(client, f'/v1/webhooks/{own_id}/test', None)}/redeliver", None
    )
    return own_id


CHANGES: dict[tuple[str, str], tuple[Callable[[httpx.Client], str], str, str]] = {
    ("post", "/v1/satellites"): (new_satellite, "create", "satellite"),
    ("post", "/v1/satellites/import"): (import_satellites, "create", "satellite"),
    ("put", "/v1/satellites/{satellite_id}/elements"): (put_elements, "add_elements", "satellite"),
    ("patch", "/v1/satellites/{satellite_id}"): (
        rename(new_satellite, "/v1/satellites"), "update", "satellite",
    ),
    ("delete", "/v1/satellites/{satellite_id}"): (
        delete(new_satellite, "/v1/satellites"), "delete", "satellite",
    ),
    ("post", "/v1/spacecraft"): (new_spacecraft, "create", "spacecraft"),
    ("patch", "/v1/spacecraft/{spacecraft_id}"): (
        rename(new_spacecraft, "/v1/spacecraft"), "update", "spacecraft",
    ),
    ("delete", "/v1/spacecraft/{spacecraft_id}"): (
        delete(new_spacecraft, "/v1/spacecraft"), "delete", "spacecraft",
    ),
    ("post", "/v1/outages"): (new_outage, "create", "outage"),
    ("delete", "/v1/outages/{outage_id}"): (delete(new_outage, "/v1/outages"), "delete", "outage"),
    ("post", "/v1/forecasts"): (new_forecast, "create", "forecast"),
    ("delete", "/v1/forecasts/{forecast_id}"): (
        delete(new_forecast, "/v1/forecasts"), "delete", "forecast",
    ),
    ("post", "/v1/ground-stations"): (new_station, "create", "ground_station"),
    ("post", "/v1/ground-stations/import"): (import_stations, "create", "ground_station"),
    ("patch", "/v1/ground-stations/{station_id}"): (
        rename(new_station, "/v1/ground-stations"), "update", "ground_station",
    ),
    ("delete", "/v1/ground-stations/{station_id}"): (
        delete(new_station, "/v1/ground-stations"), "delete", "ground_station",
    ),
    ("post", "/v1/target-catalogs"): (new_catalog, "create", "target_catalog"),
    ("patch", "/v1/target-catalogs/{catalog_id}"): (
        rename(new_catalog, "/v1/target-catalogs"), "update", "target_catalog",
    ),
    ("delete", "/v1/target-catalogs/{catalog_id}"): (
        delete(new_catalog, "/v1/target-catalogs"), "delete", "target_catalog",
    ),
    ("post", "/v1/scenarios"): (
        lambda client: post(client, "/v1/scenarios", question(client)), "create", "scenario",
    ),
    ("delete", "/v1/scenarios/{scenario_id}"): (
        delete(lambda client: post(client, "/v1/scenarios", question(client)), "/v1/scenarios"),
        "delete", "scenario",
    ),
    ("delete", "/v1/jobs/{job_id}"): (delete(cancel, "/v1/jobs"), "delete", "job"),
    ("delete", "/v1/comparisons/{comparison_id}"): (
        delete(compare, "/v1/comparisons"), "delete", "comparison",
    ),
    ("post", "/v1/jobs"): (new_job, "create", "job"),
    ("post", "/v1/jobs/{job_id}/rerun"): (rerun, "create", "job"),
    ("post", "/v1/jobs/{job_id}/what-if"): (what_if, "create", "job"),
    ("post", "/v1/comparisons"): (compare, "create", "comparison"),
    ("post", "/v1/webhooks"): (new_webhook, "create", "webhook"),
    ("delete", "/v1/webhooks/{webhook_id}"): (
        delete(new_webhook, "/v1/webhooks"), "delete", "webhook",
    ),
    ("post", "/v1/webhooks/{webhook_id}/test"): (try_webhook, "test", "webhook"),
    ("post", "/v1/webhooks/{webhook_id}/deliveries/{delivery_id}/redeliver"): (
        redeliver, "redeliver", "webhook",
    ),
    ("post", "/v1/jobs/{job_id}/cancel"): (cancel, "cancel", "job"),
}  # fmt: skip


def events(door: Door, **query: str | int) -> list[dict[str, Any]]:
    answer = door.client.get("/v1/audit-events", params=query, headers=door.key("admin", "boss"))
    assert answer.status_code == 200, answer.text
    items: list[dict[str, Any]] = answer.json()["items"]
    return items


def test_every_call_that_changes_something_is_in_the_table_above(door: Door) -> None:
    changing = {
        (method, path) for method, path, _ in operations(door.client) if method not in READ_ONLY
    }
    # Plans need a job with an answer: tests/service/access/test_plans.py.
    others = {call for call in changing if call[1].startswith("/v1/plans")}
    assert changing - others == set(CHANGES)
    assert len(others) == 6


@pytest.mark.parametrize("call", CHANGES, ids=" ".join)
def test_a_change_leaves_an_event(door: Door, call: tuple[str, str]) -> None:
    change, action, kind = CHANGES[call]
    key = door.key("submit", "ops")
    with httpx.Client(base_url=door.client.base_url, headers=key, timeout=60) as client:
        client.headers["X-Request-ID"] = "of-this-change"
        own_id = change(client)
    newest = events(door)[0]
    assert set(newest) == KEYS
    assert (newest["action"], newest["kind"], newest["object_id"]) == (action, kind, own_id)
    assert (newest["owner"], newest["key_name"]) == ("ops", "ops-submit")
    assert newest["key_id"] in key["Authorization"]
    assert newest["request_id"] == "of-this-change"
    assert newest["at"].endswith("Z")


def test_what_changes_nothing_leaves_none(door: Door) -> None:
    key = door.key("submit")
    with httpx.Client(base_url=door.client.base_url, headers=key, timeout=60) as client:
        import_stations(client)
        same = question(client)
        post(client, "/v1/scenarios", same)
        before = len(events(door))
        import_stations(client)
        post(client, "/v1/scenarios", same)
        client.post("/v1/jobs", json={"scenario_id": "none", "solver": "rule"})
        client.delete("/v1/satellites/none")
    assert len(events(door)) == before


def test_each_object_of_an_import_has_its_event(door: Door) -> None:
    lines = "\n".join(line for number in (90001, 90002, 90003) for line in tle(number))
    headers = door.key("submit") | {"Content-Type": "text/plain"}
    door.client.post("/v1/satellites/import", content=lines, headers=headers)
    newer = "\n".join(tle(90002, epoch=datetime(2026, 3, 2, tzinfo=UTC)))
    door.client.post("/v1/satellites/import", content=newer, headers=headers)
    found = [(event["action"], event["kind"]) for event in events(door)]
    assert found == [("add_elements", "satellite"), *[("create", "satellite")] * 3]


def test_events_are_found_by_object_kind_action_and_owner_and_come_in_pages(door: Door) -> None:
    jobs = [door.submit(door.key("submit", owner)) for owner in ("ops", "science", "ops")]
    door.client.post(f"/v1/jobs/{jobs[0]}/cancel", headers=door.key("admin", "boss"))
    found = events(door, object_id=jobs[0])
    assert [(event["action"], event["owner"]) for event in found] == [
        ("cancel", "boss"),
        ("create", "ops"),
    ]
    assert [event["object_id"] for event in events(door, owner="ops")] == [jobs[2], jobs[0]]
    assert [event["object_id"] for event in events(door, action="cancel")] == [jobs[0]]
    assert events(door, kind="satellite") == []
    admin = door.key("admin")
    seen = []
    path = "/v1/audit-events?limit=3"
    while path:
        answer = door.client.get(path, headers=admin)
        seen += [event["id"] for event in answer.json()["items"]]
        path = answer.links.get("next", {}).get("url", "")
    assert len(seen) == 4
    assert seen == sorted(seen, reverse=True)


def test_a_change_that_cannot_be_recorded_does_not_happen(door: Door) -> None:
    key = door.key("submit")
    with door.jobs.database.transaction() as session:
        session.execute(sa.text("ALTER TABLE audit_event RENAME TO elsewhere"))
    refused = door.client.post("/v1/ground-stations", json=ground_station(), headers=key)
    assert refused.status_code >= 500
    # On a connection of its own: after a failure the server closes the connection.
    listed = httpx.get(f"{door.client.base_url}/v1/ground-stations", headers=key)
    assert listed.json()["items"] == []


@pytest.mark.parametrize("change", [sa.update(AuditEventRow).values(owner="x"), sa.delete])
def test_the_database_refuses_to_rewrite_the_record(door: Door, change: Any) -> None:
    door.submit(door.key("submit"))
    statement = change(AuditEventRow) if callable(change) else change
    refused = pytest.raises(sa.exc.DBAPIError, match="append-only")
    with refused, door.jobs.database.transaction() as session:
        session.execute(statement)
    assert [event["owner"] for event in events(door)] == ["ops"]


def test_the_record_is_no_ones_but_the_admins(door: Door) -> None:
    refused = door.client.get("/v1/audit-events", headers=door.key("submit"))
    assert_problem(refused, 403, "insufficient_scope")
