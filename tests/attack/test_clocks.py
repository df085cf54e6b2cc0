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
    """A clock that is set while processes read it. Time since their start goes on evenly."""

    def __init__(self, folder: Path):
        self._file = folder / "clock"
        self._library = folder / "jumping_clock.so"
        command = [str(COMPILER), "-shared", "-fPIC", "-O2", str(SOURCE), "-o", str(self._library)]
        subprocess.run(command, check=True)
        self.jump(0)

    @property
    def environment(self) -> dict[str, str]:
        """What a process reads this clock by."""
        return {"LD_PRELOAD": str(self._library), "SLEWLINE_TEST_CLOCK": str(self._file)}

    def jump(self, seconds: int) -> None:
        """Show so many seconds more than it is."""
        new = self._file.with_suffix(".new")
        new.write_text(f"{seconds:+d}")
        new.chmod(0o644)
        new.replace(self._file)


def _beats(jobs: Jobs) -> set[tuple[str, object]]:
    """Return when each worker was seen last."""
    with jobs.database.reading() as session:
        return {(row.id, row.seen_at) for row in session.scalars(sa.select(WorkerRow))}


def _all_seen_since(jobs: Jobs, before: set[tuple[str, object]]) -> bool:
    return not before & _beats(jobs)


@contextmanager
def _server_under(clock: Clock) -> Iterator[None]:
    """Have the server, where there is one, read this clock."""
    if not SERVER_CONTROL:
        yield
        return
    try:
        _restart(clock.environment)
        yield
    finally:
        _restart({})


def _restart(environment: dict[str, str]) -> None:
    # The server alone is to read the clock, not the shell that becomes another user before.
    become, control = SERVER_CONTROL[:-7], SERVER_CONTROL[-7:]
    assert control[1] == "-D"
    # Where it did not come up before, there is nothing to stop.
    subprocess.run([*SERVER_CONTROL, "-m", "fast", "stop"], cwd="/", check=False)
    names = [f"{name}={value}" for name, value in environment.items()]
    subprocess.run([*become, "env", *names, *control, "start"], cwd="/", check=True)


@pytest.fixture
def clock() -> Iterator[Clock]:
    # A server reads it as another user, who may not look into the folders of tests.
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Clock(Path(folder))


def let_clocks_jump(jobs: Jobs, clock: Clock) -> None:
    """Set the clock forth and back under jobs that run, and see them end, each once."""
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
        # Leases are judged by the server's clock alone.
        assert len(jobs.starts()) == NUM_JOBS


def test_a_clock_that_jumps_under_the_database(jobs: Jobs, workers: Workers, clock: Clock) -> None:
    """A server's machine; or the one machine of a SQLite file, whose clock all workers read."""
    with _server_under(clock):
        for _ in range(2):
            workers.start({} if SERVER_URL else clock.environment)
        let_clocks_jump(jobs, clock)
