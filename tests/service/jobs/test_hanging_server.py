"""A PostgreSQL server that accepts connections and says nothing more: nothing waits for ever."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import httpx
import psutil
import psycopg
import pytest
import sqlalchemy as sa

from service.db.postgresql import make_postgresql_engine
from service.jobs import lease
from service.jobs.queue import DbosQueue
from service.main import create_app
from tests.patience import PATIENCE_S
from tests.service.conftest import serve
from tests.service.jobs.conftest import Jobs, Workers
from tests.service.jobs.proxy import FreezingProxy
from tests.service.jobs.test_worker import solver_pid
from tests.service.problems import assert_problem

TIMEOUT_S = 1.0


@pytest.fixture
def proxy(jobs: Jobs) -> Iterator[FreezingProxy]:
    with FreezingProxy(jobs.settings.database_url) as proxy:
        yield proxy


def through(proxy: FreezingProxy, jobs: Jobs) -> Jobs:
    """Return the same jobs with settings that reach the server through the proxy."""
    url = {"database_url": proxy.url, "database_timeout_s": TIMEOUT_S}
    return Jobs(
        settings=jobs.settings.model_copy(update=url),
        database=jobs.database,
        queue=jobs.queue,
        scenario_id=jobs.scenario_id,
        folder=jobs.folder,
    )


def test_calls_of_a_server_that_hangs_end(proxy: FreezingProxy) -> None:
    """With an open connection, and if one must be opened first."""
    engine = make_postgresql_engine(proxy.url, TIMEOUT_S)
    with engine.connect() as connection:
        connection.execute(sa.text("SELECT 1"))
        proxy.freeze()
        with pytest.raises(sa.exc.OperationalError, match="has not answered for 3 s") as caught:
            connection.execute(sa.text("SELECT 1"))
        assert caught.value.connection_invalidated
    with pytest.raises(sa.exc.OperationalError, match="connection timeout expired"):
        engine.connect()
    proxy.thaw()
    with engine.connect() as connection:
        assert connection.scalar(sa.text("SELECT 1")) == 1
    engine.dispose()


def test_the_server_ends_what_takes_too_long_and_knows_that_we_may_vanish(jobs: Jobs) -> None:
    engine = make_postgresql_engine(jobs.settings.database_url, TIMEOUT_S)
    with engine.connect() as connection:
        with pytest.raises(sa.exc.OperationalError) as caught:
            connection.execute(sa.text("SELECT pg_sleep(20)"))
        assert isinstance(caught.value.orig, psycopg.errors.QueryCanceled)
        connection.rollback()
        for name, value in (
            ("idle_in_transaction_session_timeout", "1min"),
            ("tcp_keepalives_idle", "5"),
            ("tcp_user_timeout", "15000"),
        ):
            assert connection.scalar(sa.text(f"SHOW {name}")) == value
    engine.dispose()


def test_what_the_url_says_goes_before(jobs: Jobs) -> None:
    url = sa.make_url(jobs.settings.database_url).update_query_dict(
        {"options": "-c statement_timeout=7s", "application_name": "mine"}
    )
    engine = make_postgresql_engine(url.render_as_string(hide_password=False), TIMEOUT_S)
    with engine.connect() as connection:
        assert connection.scalar(sa.text("SHOW statement_timeout")) == "7s"
        assert connection.scalar(sa.text("SHOW application_name")) == "mine"
    engine.dispose()


def test_silence_between_notifications_is_none_of_the_server(jobs: Jobs) -> None:
    engine = make_postgresql_engine(jobs.settings.database_url, 0.1)
    heard: list[str] = []
    connection = engine.raw_connection()
    listener = connection.driver_connection
    assert isinstance(listener, psycopg.Connection)
    listener.autocommit = True
    listener.execute("LISTEN news")

    def listen() -> None:
        heard.extend(notify.payload for notify in listener.notifies(stop_after=1))

    thread = threading.Thread(target=listen)
    thread.start()
    thread.join(4.0)  # longer than an answer may take
    assert thread.is_alive()
    with engine.begin() as speaker:
        speaker.execute(sa.text("NOTIFY news, 'peace'"))
    thread.join(30.0)
    assert heard == ["peace"]
    connection.close()
    engine.dispose()


def test_the_api_answers_503_while_the_server_hangs(
    proxy: FreezingProxy, jobs: Jobs, caplog: pytest.LogCaptureFixture
) -> None:
    """More calls at once than there are threads, and an open stream of events."""
    settings = through(proxy, jobs).settings
    queue = DbosQueue(settings.database_url, settings.database_timeout_s)
    app = create_app(settings, queue)
    job_id = jobs.submit("search")
    with serve(app) as address, httpx.Client(base_url=address, timeout=120) as client:
        with client.stream("GET", f"/v1/jobs/{job_id}/events") as stream:
            lines = stream.iter_lines()
            assert next(lines) == "id: 1"
            proxy.freeze()
            answers: list[httpx.Response] = []
            threads = [
                threading.Thread(target=lambda: answers.append(client.get("/v1/jobs")))
                for _ in range(60)
            ]
            for thread in threads:
                thread.start()
            assert client.get("/health/live").status_code == 200
            assert_problem(client.get("/health/ready"), 503, "not_live")
            for thread in threads:
                thread.join()
            for answer in answers:
                assert_problem(answer, 503, "database_unavailable")
            with caplog.at_level(logging.WARNING):
                assert not any(line.startswith("id:") for line in lines), "the stream went on"
        ended = [r for r in caplog.records if r.name == "service.api.job_events"]
        assert len(ended) == 1
        assert not [record for record in caplog.records if record.levelno >= logging.ERROR]
        proxy.thaw()
        with jobs.database.transaction() as session:
            lease.request_cancel(session, job_id)
        # What happened meanwhile comes with the next stream.
        again = client.get(f"/v1/jobs/{job_id}/events", headers={"Last-Event-ID": "1"})
        (data,) = [line for line in again.text.splitlines() if line.startswith("data:")]
        assert json.loads(data[5:])["state"] == "cancelled"
    queue.close()


def test_polls_outlive_their_connections(client: httpx.Client, jobs: Jobs) -> None:
    path = f"/v1/jobs/{jobs.submit('search')}"
    known = {"If-None-Match": client.get(path).headers["etag"]}
    end_others = sa.text(
        "SELECT count(pg_terminate_backend(pid, 5000)) FROM pg_stat_activity "
        "WHERE datname = current_database() AND pid <> pg_backend_pid()"
    )
    for _ in range(3):
        assert client.get(path, headers=known).status_code == 304
        with jobs.database.engine.connect() as connection:
            assert connection.execute(end_others).scalar_one() > 0
        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(lambda _: client.get(path, headers=known), range(8)))
        assert {answer.status_code for answer in answers} == {304}
        assert client.get(path).status_code == 200


def test_a_worker_cut_off_from_a_hanging_server_loses_its_job_and_goes_on(
    proxy: FreezingProxy, jobs: Jobs
) -> None:
    cut_off, others = Workers(through(proxy, jobs)), Workers(jobs)
    try:
        worker = cut_off.start()
        job_id = jobs.submit("search", limits={"time_s": 300.0, "memory_mb": 2048})
        solver = solver_pid(jobs, job_id)
        proxy.freeze()
        others.start()
        jobs.until(lambda: jobs.job(job_id).run == 2)
        proxy.thaw()
        jobs.until(lambda: not psutil.pid_exists(solver))
        assert worker.poll() is None
        job = jobs.job(job_id)
        assert (job.state, job.run, job.lost_runs) == ("running", 2, 1)
        with jobs.database.transaction() as session:
            assert lease.request_cancel(session, job_id)
        jobs.until_state(job_id, "cancelled")
        result = jobs.result(job_id)
        assert result is not None
        assert json.loads(result[0])["run"] == 2
        # It claims jobs again, once its queue has found the server.
        others.processes[0].terminate()
        assert others.processes[0].wait(PATIENCE_S) == 0
        assert jobs.until_state(jobs.submit("answer"), "succeeded").run == 1
    finally:
        for process in (*cut_off.processes, *others.processes):
            process.kill()
            process.wait()


def test_limits_hold_and_a_worker_ends_while_the_server_hangs(
    proxy: FreezingProxy, jobs: Jobs
) -> None:
    workers = Workers(through(proxy, jobs))
    try:
        worker = workers.start()
        deaf = jobs.submit("deaf", limits={"time_s": 1.0, "memory_mb": 2048})
        solver = solver_pid(jobs, deaf)
        proxy.freeze()
        jobs.until(lambda: not psutil.pid_exists(solver))
        worker.terminate()
        assert worker.wait(PATIENCE_S) == 0
    finally:
        for process in workers.processes:
            process.kill()
            process.wait()
    # Its last messages may or may not have arrived: the lease decides.
    proxy.thaw()
    assert jobs.job(deaf).state in ("running", "failed")
