"""A backup taken while jobs run, restored elsewhere: every job in it ends once, none is lost."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import sqlalchemy as sa

from service.db.backup import back_up
from service.db.rows import JobRow
from service.db.session import Database
from service.jobs import lease
from service.jobs.queue import DbosQueue
from service.jobs.supervisor import Supervisor
from service.server import prepare_database
from service.wire.jobs import FINAL
from tests.service.jobs.chaos import ledger
from tests.service.jobs.conftest import SERVER_URL, Jobs, create_database
from tests.service.jobs.work import WORK

LONG = {"time_s": 300.0, "memory_mb": 2048}
SHORT = {"time_s": 1.0, "memory_mb": 2048}


def states(jobs: Jobs) -> dict[str, str]:
    with jobs.database.reading() as session:
        return {row.id: row.state for row in session.execute(sa.select(JobRow.id, JobRow.state))}


def pg(program: str, url: str, *options: str) -> None:
    """Run a PostgreSQL program on a database: from the server under test, if one is given."""
    control = shlex.split(os.environ.get("SLEWLINE_TEST_SERVER_CONTROL", ""))
    folders = [str(Path(word).parent) for word in control if Path(word).name == "pg_ctl"]
    found = shutil.which(program, path=os.pathsep.join([*folders, os.environ["PATH"]]))
    assert found is not None, f"there is no {program}"
    address = sa.make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)
    subprocess.run([found, *options, "--dbname", address], check=True)


def dump(jobs: Jobs, file: Path) -> None:
    if SERVER_URL is None:
        back_up(jobs.settings.database_url, file)
    else:
        pg("pg_dump", jobs.settings.database_url, "--format=custom", f"--file={file}")


@contextmanager
def restored(jobs: Jobs, file: Path) -> Iterator[Jobs]:
    """Yield the jobs of a backup in a new database."""
    folder = jobs.folder / "restored"
    folder.mkdir()
    if SERVER_URL is None:
        url = f"sqlite:///{folder / 'jobs.db'}"
        shutil.copy(file, folder / "jobs.db")
    else:
        url = create_database(SERVER_URL, "template0")
        pg("pg_restore", url, "--exit-on-error", "--no-owner", str(file))
    settings = jobs.settings.model_copy(update={"database_url": url})
    prepare_database(settings)  # as every start does
    database, queue = Database(url), DbosQueue(url)
    yield Jobs(
        settings=settings,
        database=database,
        queue=queue,
        scenario_id=jobs.scenario_id,
        folder=folder,
    )
    queue.close()
    database.close()


@contextmanager
def busy(jobs: Jobs) -> Iterator[None]:
    """Submit and finish jobs all the time."""
    over = threading.Event()

    def keep_on() -> None:
        while not over.wait(0.05):
            jobs.submit("answer", tenant="busy")

    thread = threading.Thread(target=keep_on)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def test_a_backup_of_a_busy_service_restores_to_one_that_ends_every_job(jobs: Jobs) -> None:
    """One job in the backup is running, others wait or have ended; all its workers are gone."""
    ledger.open_ledger(jobs)
    file = jobs.folder / "backup"
    supervisor = Supervisor(jobs.settings.model_copy(update={"workers": 2}), work=WORK)
    running = jobs.submit("search", priority=9, limits=LONG)
    for _ in range(6):
        jobs.submit("search", priority=0, limits=SHORT)
    gone = jobs.submit("answer", priority=0)
    with jobs.database.transaction() as session:
        assert lease.request_cancel(session, gone)
    supervisor.start()
    try:
        jobs.until_state(running, "running")
        done = jobs.submit("answer", priority=9)
        jobs.until_state(done, "succeeded")
        with busy(jobs):
            jobs.until(lambda: sum(state == "succeeded" for state in states(jobs).values()) > 10)
            before = set(states(jobs))
            dump(jobs, file)
    finally:
        supervisor.stop()

    with restored(jobs, file) as again:
        kept = states(again)
        assert before <= set(kept)
        assert kept[running] == "running"
        assert (kept[done], kept[gone]) == ("succeeded", "cancelled")
        assert "queued" in kept.values()
        supervisor = Supervisor(again.settings, work=WORK)
        supervisor.start()
        try:
            again.until(lambda: again.job(running).run == 2)
            with again.database.transaction() as session:
                assert lease.request_cancel(session, running)
            new = again.submit("answer")
            again.until(lambda: all(state in FINAL for state in states(again).values()))
            promised = dict.fromkeys([*kept, new], "succeeded")
            promised |= {running: "cancelled", gone: "cancelled"}
            ledger.check(again, ledger.read_ledger(again), promised)
        finally:
            supervisor.stop()
