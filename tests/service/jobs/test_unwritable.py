"""A full or read-only database: reported as such, and nothing is broken afterwards."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager

import httpx
import psycopg
import pytest
import sqlalchemy as sa
from fastapi import FastAPI

from service.db.failures import why_unavailable
from service.db.rows import TargetCatalogRow, TargetRow
from tests.service.conftest import Service, new_app, serve
from tests.service.jobs.conftest import SERVER_URL, Jobs, Workers
from tests.service.jobs.unwritable import no_room_for, read_only_server, sqlite_pragma
from tests.service.problems import assert_problem

MANY_TARGETS = [{"id": f"t{n}", "lat_deg": 0.0, "lon_deg": n / 100} for n in range(2000)]


@pytest.fixture
def app(jobs: Jobs) -> FastAPI:
    return new_app(jobs.settings, jobs.queue)


@pytest.fixture
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
        yield client


def read_only(app: FastAPI) -> AbstractContextManager[None]:
    if SERVER_URL is not None:
        return read_only_server(SERVER_URL)
    return sqlite_pragma(app.state.database.engine, "query_only = 1", "query_only = 0")


def post_job(client: httpx.Client, jobs: Jobs) -> httpx.Response:
    return client.post("/v1/jobs", json={"scenario_id": jobs.scenario_id, "solver": "rule"})


def test_a_read_only_database_is_503_and_serves_again_when_it_can_be_written(
    app: FastAPI, client: httpx.Client, jobs: Jobs
) -> None:
    before = post_job(client, jobs).json()["id"]
    with read_only(app):
        refused = post_job(client, jobs)
        problem = assert_problem(refused, 503, "database_unavailable")
        assert problem["detail"] == "The database cannot be written to at the moment."
        assert int(refused.headers["retry-after"]) > 0
        cancel = client.post(f"/v1/jobs/{before}/cancel")
        assert_problem(cancel, 503, "database_unavailable")
        assert client.get(f"/v1/jobs/{before}").json()["state"] == "queued"
    after = post_job(client, jobs)
    assert after.status_code == 202
    listed = client.get("/v1/jobs").json()["items"]
    assert [job["id"] for job in listed] == [after.json()["id"], before]
    assert jobs.queue.lost([(before, 1), (after.json()["id"], 1)]) == set()


def test_a_full_database_is_503_and_keeps_nothing_of_what_did_not_fit(service: Service) -> None:
    """On SQLite; a full disk of a server cannot be simulated without the server."""
    client, engine = service.client, service.database.engine
    catalog = {"name": "many", "targets": MANY_TARGETS}
    with sqlite_pragma(engine, "max_page_count = 1", "max_page_count = 1073741823"):
        refused = client.post("/v1/target-catalogs", json=catalog)
        problem = assert_problem(refused, 503, "database_unavailable")
        assert problem["detail"] == "The database has no room left."
    with service.database.reading() as session:
        for row in (TargetCatalogRow, TargetRow):
            assert session.scalar(sa.select(sa.func.count()).select_from(row)) == 0
        assert session.scalar(sa.text("PRAGMA integrity_check")) == "ok"
    assert client.post("/v1/target-catalogs", json=catalog).status_code == 201


def test_a_job_that_ends_while_nothing_can_be_written_keeps_its_answer(
    jobs: Jobs, workers: Workers
) -> None:
    worker = workers.start()
    ending = jobs.submit("search", limits={"time_s": 0.5, "memory_mb": 2048})
    waiting = jobs.submit("answer")
    jobs.until(lambda: any(line.startswith(ending) for line in jobs.starts()))
    broken = no_room_for(worker.pid) if SERVER_URL is None else read_only_server(SERVER_URL)
    with broken:
        time.sleep(1.5 * jobs.settings.lease_s)
        assert jobs.job(ending).state == "running"
        assert worker.poll() is None
    for job_id in (ending, waiting):
        assert jobs.until_state(job_id, "succeeded", "failed").state == "succeeded"
        assert jobs.result(job_id) is not None
    jobs.until(lambda: jobs.queue.claims() == [])


def driver_error(kind: type[sa.exc.DBAPIError], error: Exception) -> sa.exc.DBAPIError:
    return kind("SELECT 1", {}, error)


def sqlite_error(code: int) -> sqlite3.OperationalError:
    error = sqlite3.OperationalError("words")
    error.sqlite_errorcode = code
    return error


@pytest.mark.parametrize(
    ("error", "passes"),
    [
        (sa.exc.TimeoutError(), True),
        (driver_error(sa.exc.OperationalError, sqlite_error(sqlite3.SQLITE_IOERR_WRITE)), True),
        (driver_error(sa.exc.OperationalError, sqlite_error(sqlite3.SQLITE_ERROR)), False),
        (driver_error(sa.exc.OperationalError, psycopg.OperationalError("gone")), True),
        (driver_error(sa.exc.OperationalError, psycopg.errors.AdminShutdown()), True),
        (driver_error(sa.exc.OperationalError, psycopg.errors.DiskFull()), True),
        (driver_error(sa.exc.InternalError, psycopg.errors.ReadOnlySqlTransaction()), True),
        (driver_error(sa.exc.ProgrammingError, psycopg.errors.UndefinedTable()), False),
        (driver_error(sa.exc.ProgrammingError, psycopg.ProgrammingError("misused")), False),
        (KeyError("of ours"), False),
    ],
)
def test_what_passes_is_told_from_what_is_a_fault(error: Exception, passes: bool) -> None:
    assert (why_unavailable(error) is not None) is passes
