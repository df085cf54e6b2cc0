"""Clocks that jump under a worker and under the database: jobs end once, and none is lost."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Final

import pytest
import sqlalchemy as sa

from service.db.rows import WorkerRow
from tests.service.jobs.conftest import SERVER_URL, Jobs, Workers

SERVER_CONTROL: Final = shlex.split(os.environ.get("SLEWLINE_TEST_SERVER_CONTROL", ""))
SOURCE: Final = Path(__file__).parent / "jumping_clock.c"
COMPILER: Final = shutil.which("cc")
JUMPS_S: Final = (3600, -7200, 86400, 0)
NUM_JOBS: Final = 3

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler is on this machine")


class Clock:
    """A clock that is set while processes read it. Their monotonic time runs on evenly."""

    def __init__(self, folder: Path):
        self._file = folder / "clock"
        self._library = folder / "jumping_clock.so"
        command = [str(COMPILER), "-shared", "-fPIC", "-O2", str(SOURCE), "-o", str(self._library)]
        subprocess.run(command, check=True)
        self.jump(0)

    @property
    def environment(self) -> dict[str, str]:
        """The environment in which a process reads this clock."""
        return {"LD_PRELOAD": str(self._library), "SLEWLINE_TEST_CLOCK": str(self._file)}

    def jump(self, seconds: int) -> None:
        """Show this many seconds more than the true time."""
        new = self._file.with_suffix(".new")
        new.write_text(f"{seconds:+d}")
        new.chmod(0o644)
        new.replace(self._file)


def _beats(jobs: Jobs) -> set[tuple[str, object]]:
    """Return when each worker was last seen."""
    with jobs.database.reading() as session:
        return {(row.id, row.seen_at) for row in session.scalars(sa.select(WorkerRow))}


def _all_seen_since(jobs: Jobs, before: set[tuple[str, object]]) -> bool:
    return not before & _beats(jobs)


@contextmanager
def _server_under(clock: Clock) -> Iterator[None]:
    """Make the server, if there is one, read this clock."""
    if not SERVER_CONTROL:
        yield
        return
    try:
        _restart(clock.environment)
        yield
    finally:
        _restart({})


def _restart(environment: dict[str, str]) -> None:
    # Only the server must read the clock, not the shell that first becomes another user.
    become, control = SERVER_CONTROL[:-7], SERVER_CONTROL[-7:]
    assert control[1] == "-D"
    # If it did not start before, there is nothing to stop.
    subprocess.run([*SERVER_CONTROL, "-m", "fast", "stop"], cwd="/", check=False)
    names = [f"{name}={value}" for name, value in environment.items()]
    subprocess.run([*become, "env", *names, *control, "start"], cwd="/", check=True)


@pytest.fixture
def clock() -> Iterator[Clock]:
    # The server reads it as another user, who may not open the tests' folders.
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Clock(Path(folder))


def let_clocks_jump(jobs: Jobs, clock: Clock) -> None:
    """Set the clock forward and back while jobs run, and check that each ends once."""
    ids = [jobs.submit("search") for _ in range(NUM_JOBS)]
    jobs.until(lambda: len(jobs.starts()) >= 2)
    for jump_s in JUMPS_S:
        clock.jump(jump_s)
        jobs.until(partial(_all_seen_since, jobs, _beats(jobs)))
    jobs.end_searches()
    for job_id in ids:
        job = jobs.until_state(job_id, "succeeded", "failed", "cancelled")
        assert job.state == "succeeded"
        assert jobs.result(job_id) is not None
    jobs.until(lambda: jobs.queue.claims() == [])
    assert {line.split()[0] for line in jobs.starts()} == set(ids)


def test_a_clock_that_jumps_under_one_of_two_workers(
    jobs: Jobs, workers: Workers, clock: Clock
) -> None:
    workers.start()
    workers.start(clock.environment)
    let_clocks_jump(jobs, clock)
    if SERVER_URL:
        # Only the server's clock decides about leases.
        assert len(jobs.starts()) == NUM_JOBS


def test_a_clock_that_jumps_under_the_database(jobs: Jobs, workers: Workers, clock: Clock) -> None:
    """A server's machine; or the one machine of a SQLite file, whose clock all workers read."""
    with _server_under(clock):
        for _ in range(2):
            workers.start({} if SERVER_URL else clock.environment)
        let_clocks_jump(jobs, clock)
