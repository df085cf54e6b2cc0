"""``GET /metrics``: the service as Prometheus reads it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import get_args

import httpx
import pytest
import sqlalchemy as sa
from prometheus_client.parser import text_string_to_metric_families

import planner_core
from service.db.clock import seconds_between, utc_now
from service.db.columns import UtcDateTime
from service.db.rows import JobRow, WorkerRow
from service.db.session import Database
from service.jobs.lease import Outcome
from service.wire.timelines import Validity
from tests.service.conftest import Service
from tests.service.factories import EPOCH, post, satellite, target
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import finish, posted

Sample = tuple[str, frozenset[tuple[str, str]]]


def read(client: httpx.Client) -> dict[Sample, float]:
    answer = client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=")
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def sample(name: str, /, **labels: str) -> Sample:
    return name, frozenset(labels.items())


def test_jobs_are_counted_by_state_and_their_time_by_solver(
    client: httpx.Client, jobs: Jobs
) -> None:
    before = read(client)
    assert before[sample("slewline_database_up")] == 1.0
    assert before[sample("slewline_build_info", version=planner_core.__version__)] == 1.0
    for state in ("queued", "running", "succeeded", "expired"):
        assert before[sample("slewline_jobs", state=state)] == 0.0
    assert before[sample("slewline_queue_oldest_seconds")] == 0.0
    ids = [posted(client, jobs) for _ in range(4)]
    finish(jobs, ids[0])
    finish(jobs, ids[1])
    finish(jobs, ids[2], Outcome.failed("crashed", "It ended without an answer."))
    with jobs.database.transaction() as session:
        for number, job_id in enumerate(ids):
            at = {"created_at": utc_now(-90.0), "lost_runs": number}
            if number < 3:
                at |= {"started_at": utc_now(-80.0), "finished_at": utc_now(-50.0)}
            session.execute(sa.update(JobRow).where(JobRow.id == job_id).values(**at))
    after = read(client)
    assert after[sample("slewline_jobs", state="queued")] == 1.0
    assert after[sample("slewline_jobs", state="succeeded")] == 2.0
    assert after[sample("slewline_jobs", state="failed")] == 1.0
    good = {"solver": "rule", "state": "succeeded", "termination": "optimal"}
    assert after[sample("slewline_job_seconds_count", **good)] == 2.0
    assert after[sample("slewline_job_seconds_sum", **good)] == pytest.approx(60.0, abs=1.0)
    bad = {"solver": "rule", "state": "failed", "termination": "none"}
    assert after[sample("slewline_job_seconds_count", **bad)] == 1.0
    assert after[sample("slewline_leases_lost_total")] == 6.0
    assert after[sample("slewline_queue_oldest_seconds")] >= 90.0


def test_workers_tell_when_they_were_last_heard_of(client: httpx.Client, jobs: Jobs) -> None:
    with jobs.database.transaction() as session:
        for name, age_s in (("dead", 3600.0), ("alive", 0.0)):
            row = {"id": name, "started_at": utc_now(), "seen_at": utc_now(-age_s)}
            session.execute(sa.insert(WorkerRow).values(**row))
    ages = read(client)
    dead = ages[sample("slewline_worker_heartbeat_age_seconds", worker="dead")]
    alive = ages[sample("slewline_worker_heartbeat_age_seconds", worker="alive")]
    assert dead - alive == pytest.approx(3600.0, abs=1.0)
    assert alive >= 0.0


def test_orbits_in_use_tell_their_age(client: httpx.Client, jobs: Jobs) -> None:
    used = post(client, "/v1/satellites", satellite(name='Eye "1"'))["id"]
    post(client, "/v1/satellites", satellite(name="idle"))
    catalog = post(client, "/v1/target-catalogs", {"name": "C", "targets": [target()]})["id"]
    scenario = {
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T01:00:00Z"},
        "satellite_ids": [used],
        "target_catalog_ids": [catalog],
        "ground_station_ids": [],
    }
    job = post(client, "/v1/jobs", {"scenario": scenario, "solver": "rule"})["id"]
    with jobs.database.reading() as session:
        now = session.execute(sa.select(utc_now())).scalar_one()
    mine = sample("slewline_orbit_age_seconds", satellite_id=used, name='Eye "1"')
    ages = {key: value for key, value in read(client).items() if key[0] == mine[0]}
    assert set(ages) == {mine}
    assert ages[mine] == pytest.approx((now - EPOCH).total_seconds(), abs=60.0)
    # Its horizon is over: no longer in use.
    client.post(f"/v1/jobs/{job}/cancel")
    with jobs.database.transaction() as session:
        old = utc_now(-timedelta(days=8).total_seconds())
        session.execute(sa.update(JobRow).values(created_at=old))
    assert mine not in read(client)


def test_calls_are_counted_by_route_and_never_by_path(service: Service) -> None:
    route = {"method": "GET", "route": "/v1/satellites/{satellite_id}", "status": "404"}
    none = {"method": "GET", "route": "none", "status": "404"}
    before = read(service.client)
    for number in range(3):
        service.client.get(f"/v1/satellites/none-{number}")
        service.client.get(f"/wp-admin/{number}")
    after = read(service.client)
    for labels in (route, none):
        counted = sample("slewline_http_requests_total", **labels)
        assert after[counted] - before.get(counted, 0.0) == 3.0
    timed = sample("slewline_http_request_seconds_count", method="GET", route=route["route"])
    assert after[timed] - before.get(timed, 0.0) == 3.0
    assert not any("none-1" in value for _, labels in after for _, value in labels)


def test_without_its_database_the_service_still_tells_its_own_figures(
    service: Service, tmp_path: Path
) -> None:
    (tmp_path / "broken.db").write_bytes(b"this is no database" * 100)
    service.app.state.database = Database(f"sqlite:///{tmp_path / 'broken.db'}")
    figures = read(service.client)
    assert figures[sample("slewline_database_up")] == 0.0
    assert not any(name == "slewline_jobs" for name, _ in figures)


def test_the_database_measures_the_time_between_two_instants(jobs: Jobs) -> None:
    """In ``tests/service/jobs``, so that it runs on PostgreSQL too."""
    instants = [datetime(2026, 2, 28, 23, 59, 59, 750_000, UTC), datetime(2026, 3, 1, tzinfo=UTC)]
    start, end = (sa.literal(instant, UtcDateTime()) for instant in instants)
    with jobs.database.reading() as session:
        for one, other, expected in ((start, end, 0.25), (end, start, -0.25), (end, end, 0.0)):
            measured = session.scalar(sa.select(seconds_between(one, other)))
            assert measured == pytest.approx(expected, abs=1e-3)


def test_a_poll_that_finds_nothing_new_is_a_call_like_any_other(
    client: httpx.Client, jobs: Jobs
) -> None:
    path = f"/v1/jobs/{posted(client, jobs)}"
    etag = client.get(path).headers["etag"]
    unchanged = client.get(path, headers={"If-None-Match": etag})
    assert (unchanged.status_code, unchanged.headers["etag"]) == (304, etag)
    labels = {"method": "GET", "route": "/v1/jobs/{job_id}"}
    calls = read(client)
    assert calls[sample("slewline_http_requests_total", status="304", **labels)] == 1.0
    assert calls[sample("slewline_http_requests_total", status="200", **labels)] == 1.0


def test_plans_are_counted_by_validity(client: httpx.Client, jobs: Jobs) -> None:
    assert read(client)[sample("slewline_job_plans", validity="violations")] == 0.0
    for validity in ("violations", "violations", "valid"):
        ended = Outcome(state="succeeded", figures={"validity": validity})
        finish(jobs, posted(client, jobs), ended)
    found = read(client)
    counts = {v: found[sample("slewline_job_plans", validity=v)] for v in get_args(Validity)}
    assert counts == {"valid": 1.0, "inherited": 0.0, "violations": 2.0}
