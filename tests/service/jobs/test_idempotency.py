"""``Idempotency-Key``: however often a request is sent, it creates one thing."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.db.clock import utc_now
from service.db.rows import IdempotencyKeyRow, JobRow
from tests.service.conftest import Service, new_app, serve
from tests.service.factories import ground_station, satellite, target, tle
from tests.service.factories import post as post_to
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import finish, post, posted
from tests.service.problems import assert_problem

KEY = {"Idempotency-Key": "key-1"}


def send(client: httpx.Client, jobs: Jobs, key: str = "key-1", **fields: Any) -> httpx.Response:
    body = {"scenario_id": jobs.scenario_id, "solver": "rule"} | fields
    return client.post("/v1/jobs", json=body, headers={"Idempotency-Key": key})


def num_jobs(jobs: Jobs) -> int:
    with jobs.database.reading() as session:
        return session.execute(sa.select(sa.func.count()).select_from(JobRow)).scalar_one()


def keys(jobs: Jobs) -> list[str]:
    with jobs.database.reading() as session:
        return sorted(session.scalars(sa.select(IdempotencyKeyRow.key)))


def make_older(jobs: Jobs, hours: float) -> None:
    with jobs.database.transaction() as session:
        session.execute(sa.update(IdempotencyKeyRow).values(created_at=utc_now(-hours * 3600.0)))


def test_the_same_key_and_body_get_the_first_answer_again(client: httpx.Client, jobs: Jobs) -> None:
    first = send(client, jobs, label="a")
    assert first.status_code == 202
    assert "idempotency-replayed" not in first.headers
    finish(jobs, first.json()["id"])
    again = send(client, jobs, label="a")
    assert again.status_code == 202
    assert again.headers["idempotency-replayed"] == "true"
    assert again.json() == first.json()
    for name in ("location", "etag", "retry-after", "content-type"):
        assert again.headers[name] == first.headers[name]
    assert again.headers["x-request-id"] != first.headers["x-request-id"]
    assert num_jobs(jobs) == 1


def test_two_spellings_of_one_document_are_the_same_request(
    client: httpx.Client, jobs: Jobs
) -> None:
    headers = KEY | {"Content-Type": "application/json"}
    for content in (
        f'{{"solver": "rule", "scenario_id": "{jobs.scenario_id}"}}',
        f'{{"scenario_id":"{jobs.scenario_id}","solver":"rule"}}',
    ):
        assert client.post("/v1/jobs", content=content, headers=headers).status_code == 202
    assert num_jobs(jobs) == 1


def test_a_key_is_of_one_request_alone(client: httpx.Client, jobs: Jobs) -> None:
    job_id = send(client, jobs).json()["id"]
    assert_problem(send(client, jobs, seed=1), 422, "idempotency_key_reused")
    rerun = client.post(f"/v1/jobs/{job_id}/rerun", headers=KEY)
    assert_problem(rerun, 422, "idempotency_key_reused")
    assert num_jobs(jobs) == 1
    assert send(client, jobs, key="key-2").headers.get("idempotency-replayed") is None
    assert num_jobs(jobs) == 2


def test_without_a_key_each_request_creates_a_job(client: httpx.Client, jobs: Jobs) -> None:
    assert posted(client, jobs) != posted(client, jobs)
    assert keys(jobs) == []


def test_requests_with_one_key_at_the_same_moment_create_one_job(
    client: httpx.Client, jobs: Jobs
) -> None:
    together = threading.Barrier(8)

    def send_together(_: int) -> httpx.Response:
        together.wait()
        return send(client, jobs)

    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(send_together, range(8)))
    assert {answer.status_code for answer in answers} == {202}
    assert len({answer.json()["id"] for answer in answers}) == 1
    assert sum("idempotency-replayed" not in answer.headers for answer in answers) == 1
    assert num_jobs(jobs) == 1


def test_a_refused_request_does_not_use_up_its_key(jobs: Jobs) -> None:
    settings = jobs.settings.model_copy(update={"max_queued": 1})
    app = new_app(settings, jobs.queue)
    with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
        blocking = posted(client, jobs)
        assert_problem(send(client, jobs), 503, "queue_full")
        assert_problem(send(client, jobs, solver="magic"), 422, "unknown_solver")
        assert keys(jobs) == []
        client.post(f"/v1/jobs/{blocking}/cancel")
        assert send(client, jobs).status_code == 202
        # A full queue does not prevent repeating an earlier answer.
        assert send(client, jobs).headers["idempotency-replayed"] == "true"


def test_a_key_is_forgotten_after_its_time(client: httpx.Client, jobs: Jobs) -> None:
    hours = jobs.settings.idempotency_hours
    first, other = send(client, jobs), send(client, jobs, key="key-2")
    make_older(jobs, hours - 0.1)
    assert send(client, jobs).json() == first.json()
    make_older(jobs, hours + 0.1)
    assert send(client, jobs, seed=5).status_code == 202
    assert keys(jobs) == ["key-1"]  # the other one was swept up
    assert send(client, jobs, key="key-2").json()["id"] != other.json()["id"]
    assert num_jobs(jobs) == 4


@pytest.mark.parametrize("key", ["", "a b", "x" * 256])
def test_an_unusable_key_is_refused(client: httpx.Client, jobs: Jobs, key: str) -> None:
    assert send(client, jobs, key=key).status_code == 422
    assert num_jobs(jobs) == 0


def test_a_rerun_with_a_key_is_one_job(client: httpx.Client, jobs: Jobs) -> None:
    path = f"/v1/jobs/{posted(client, jobs)}/rerun"
    again = [client.post(path, headers=KEY).json()["id"] for _ in range(3)]
    assert len(set(again)) == 1
    assert num_jobs(jobs) == 2


def test_every_other_call_that_creates_takes_a_key(service: Service) -> None:
    client = service.client
    catalog = b"id,lat_deg,lon_deg\nt1,47,8\n"
    stations = b"name,lat_deg,lon_deg\nS,47,8\n"
    files = {"headers": {"Content-Type": "text/csv"}}
    requests: dict[str, dict[str, Any]] = {
        "/v1/satellites": {"json": satellite()},
        "/v1/ground-stations": {"json": ground_station()},
        "/v1/target-catalogs": {"content": catalog, **files},
        "/v1/ground-stations/import": {"content": stations, **files},
        "/v1/satellites/import": {
            "content": "\n".join(tle(90002)),
            "headers": {"Content-Type": "text/plain"},
        },
    }
    for number, (path, request) in enumerate(requests.items()):
        headers = request.pop("headers", {}) | {"Idempotency-Key": f"k{number}"}
        first = client.post(path, headers=headers, **request)
        assert first.is_success, first.text
        again = client.post(path, headers=headers, **request)
        assert again.headers["idempotency-replayed"] == "true"
        assert (again.status_code, again.json()) == (first.status_code, first.json())
        assert again.headers.get("location") == first.headers.get("location")
    assert len(client.get("/v1/satellites").json()["items"]) == 2
    assert len(client.get("/v1/target-catalogs").json()["items"]) == 1


def test_a_repeated_request_is_answered_though_what_it_names_is_gone(
    client: httpx.Client, jobs: Jobs
) -> None:
    own = client.post("/v1/satellites", json=satellite()).json()["id"]
    catalog = post_to(client, "/v1/target-catalogs", {"name": "C", "targets": [target()]})
    scenario = {
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T01:00:00Z"},
        "satellite_ids": [own],
        "target_catalog_ids": [catalog["id"]],
        "ground_station_ids": [],
    }
    body = {"scenario": scenario, "solver": "rule"}
    first = client.post("/v1/jobs", json=body, headers=KEY)
    assert first.status_code == 202, first.text
    client.delete(f"/v1/satellites/{own}")
    assert_problem(client.post("/v1/jobs", json=body), 422, "unknown_satellite")
    assert client.post("/v1/jobs", json=body, headers=KEY).json() == first.json()
    assert post(client, jobs).status_code == 202
