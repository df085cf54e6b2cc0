"""A database with the queue in it, functions to submit jobs, and real worker processes."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.answers import store as answer_store
from service.db.clock import utc_now
from service.db.ids import new_id
from service.db.migrate import upgrade
from service.db.rows import JobRow, ScenarioRow, WorkerRow
from service.db.session import Database
from service.jobs import supervisor
from service.jobs.queue import DbosQueue, migrate_queue
from service.jobs.supervisor import environment_of
from service.settings import Settings
from tests.missions import Document
from tests.patience import wait_until
from tests.service import prepared
from tests.service.conftest import checked_client, new_app, serve
from tests.service.jobs.mission import Mission, running, small_mission
from tests.service.jobs.work import WORK
from tests.service.prepared import Program

SUMMARY = {
    "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-02T00:00:00Z"},
    **dict.fromkeys(("satellite_ids", "target_catalog_ids", "ground_station_ids"), ()),
    "use_resources": False,
    "dynamics": "physical",
    "collect_spacing_s": None,
    "continuous_starts": False,
    "allow_old_elements": False,
    "counts": {"satellites": 0, "targets": 0, "ground_stations": 0},
    "warnings": (),
}
"""Summary of a scenario without content, which can be listed and shown."""

SERVER_URL = os.environ.get("SLEWLINE_TEST_SERVER_URL")
"""A PostgreSQL server in which these tests may create databases; without it they use SQLite."""

# A SQLite file cannot hang like a server.
collect_ignore = [] if SERVER_URL else ["test_hanging_server.py"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Jobs:
    """One database of jobs."""

    settings: Settings
    database: Database
    queue: DbosQueue
    scenario_id: str
    folder: Path

    def submit(
        self, solver: str, *, job_id: str | None = None, tenant: str = "local", **changes: Any
    ) -> str:
        """Queue a job and return its id."""
        job_id = job_id or new_id()
        values: dict[str, Any] = {
            "params": {"log": str(self.folder / "starts.log"), "until": str(self.folder / "over")},
            "limits": {"time_s": 60.0, "memory_mb": 2048},
            "priority": 5,
        } | changes
        with self.database.transaction() as session:
            session.execute(
                sa.insert(JobRow).values(
                    id=job_id,
                    scenario_id=self.scenario_id,
                    tenant=tenant,
                    state="queued",
                    solver=solver,
                    seed=0,
                    dispatched_at=utc_now(),
                    created_at=utc_now(),
                    **values,
                )
            )
            self.queue.enqueue(session, job_id, 1, priority=values["priority"], tenant=tenant)
        return job_id

    def job(self, job_id: str) -> JobRow:
        """Return the job's current row."""
        with self.database.reading() as session:
            return session.get_one(JobRow, job_id)

    def result(self, job_id: str) -> tuple[str, str] | None:
        """Return timeline and targets of a job."""
        with self.database.reading() as session:
            timeline = answer_store.timeline_of(session, job_id)
            contents = answer_store.contents(session, job_id, "targets")
        texts = answer_store.texts(self.database.reading, job_id, contents)
        targets = "".join(text for _, text in texts)
        return None if timeline is None else (timeline, f"[{targets}]")

    def end_searches(self) -> None:
        """Let current and future searches come to their own end."""
        (self.folder / "over").touch()

    def starts(self) -> list[str]:
        """Return a line for each time a solver began: job, solver, process."""
        log = self.folder / "starts.log"
        return log.read_text().splitlines() if log.exists() else []

    def workers(self) -> list[str]:
        """Return the workers that have enrolled."""
        with self.database.reading() as session:
            return list(session.scalars(sa.select(WorkerRow.id)))

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait for a condition."""
        wait_until(condition)

    def until_state(self, job_id: str, *states: str) -> JobRow:
        """Wait until a job is in one of these states."""
        self.until(lambda: self.job(job_id).state in states)
        return self.job(job_id)


@dataclass(slots=True)
class Workers:
    """Worker processes of one test."""

    jobs: Jobs
    processes: list[Program] = field(default_factory=list)

    def start(self, environment: Mapping[str, str] = MappingProxyType({})) -> Program:
        """Start a worker and return when it is ready to claim jobs."""
        before = len(self.jobs.workers())
        words = ["service.jobs", "--work", WORK.function, "--preload", WORK.preload]
        whole = os.environ | environment_of(self.jobs.settings) | dict(environment)
        process = prepared.start(words, whole, stdout=1)
        self.processes.append(process)
        self.jobs.until(lambda: process.poll() is not None or len(self.jobs.workers()) > before)
        assert process.returncode is None, "the worker ended at once"
        return process


@pytest.fixture(scope="session")
def template_url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A migrated database, to be copied: a SQLite file, or on the given server."""
    folder = tmp_path_factory.mktemp("template")
    url = f"sqlite:///{folder / 'jobs.db'}"
    if SERVER_URL is not None:
        url = create_database(SERVER_URL, "template1")
    upgrade(url)
    migrate_queue(Settings(database_url=url))
    return url


def _copy(template_url: str, folder: Path) -> str:
    if SERVER_URL is not None:
        return create_database(SERVER_URL, str(sa.make_url(template_url).database))
    shutil.copy(str(sa.make_url(template_url).database), folder / "jobs.db")
    return f"sqlite:///{folder / 'jobs.db'}"


def create_database(server_url: str, template: str) -> str:
    """Create a database on a server as a copy of ``template``, and return its URL."""
    name = f"slewline_{new_id().replace('-', '')}"
    engine = sa.create_engine(server_url, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(sa.text(f"CREATE DATABASE {name} TEMPLATE {template}"))
    engine.dispose()
    return sa.make_url(server_url).set(database=name).render_as_string(hide_password=False)


@contextmanager
def stored_jobs(template_url: str, folder: Path) -> Iterator[Jobs]:
    """Yield a copy of the template in a folder, with one scenario and short leases."""
    settings = Settings(
        database_url=_copy(template_url, folder),
        lease_s=2.0,
        heartbeat_s=0.2,
        reconcile_s=0.2,
        workers=1,
    )
    database, queue = Database(settings.database_url), DbosQueue(settings.database_url)
    scenario_id = new_id()
    with database.transaction() as session:
        session.execute(
            sa.insert(ScenarioRow).values(
                id=scenario_id, sha256="0" * 64, summary=SUMMARY, content="{}", created_at=utc_now()
            )
        )
    yield Jobs(
        settings=settings,
        database=database,
        queue=queue,
        scenario_id=scenario_id,
        folder=folder,
    )
    queue.close()
    database.close()


@pytest.fixture
def jobs(template_url: str, tmp_path: Path) -> Iterator[Jobs]:
    """A separate database with jobs."""
    with stored_jobs(template_url, tmp_path) as jobs:
        yield jobs


@pytest.fixture
def client(jobs: Jobs) -> Iterator[httpx.Client]:
    """A client of a server that sends jobs to the queue, without workers."""
    app = new_app(jobs.settings, jobs.queue)
    with serve(app) as address, checked_client(address) as client:
        yield client


@pytest.fixture(autouse=True)
def supervised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make supervisors in this process start their workers as forks too."""

    def start(command: list[str], **options: Any) -> Program:
        _python, _m, *words = command
        return prepared.start(words, **options)

    popen = SimpleNamespace(Popen=start, TimeoutExpired=subprocess.TimeoutExpired)
    monkeypatch.setattr(supervisor, "subprocess", popen)


@pytest.fixture
def workers(jobs: Jobs) -> Iterator[Workers]:
    """A starter of workers; whatever still runs at the end is killed."""
    started = Workers(jobs)
    yield started
    for process in started.processes:
        process.kill()
        process.wait()


@pytest.fixture(scope="package")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mission]:
    """A whole service with a worker, for all tests of these folders."""
    with running(tmp_path_factory.mktemp("mission")) as mission:
        yield mission


@pytest.fixture(scope="package")
def planned(mission: Mission) -> Document:
    """A job that has planned the small mission; no test changes it."""
    return mission.plan(small_mission())
