"""Whatever dies, freezes or is unreachable: every job ends once, with its last run's answer.

Not among the ordinary tests: ``make chaos`` runs it on SQLite and PostgreSQL with
SLEWLINE_TEST_CHAOS_JOBS jobs; ``.ci/run`` includes it with the smaller default number.
"""

from __future__ import annotations

import os
import threading
import time

import pytest
from sqlalchemy.exc import SQLAlchemyError

from service.jobs.supervisor import Supervisor
from tests.patience import wait_for_the_end_of
from tests.service.jobs.chaos import ledger
from tests.service.jobs.chaos.api import Api
from tests.service.jobs.chaos.load import GIANT, Load
from tests.service.jobs.chaos.mischief import Mischief
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.work import WORK

NUM_JOBS = int(os.environ.get("SLEWLINE_TEST_CHAOS_JOBS", "60"))
SEED = int(os.environ.get("SLEWLINE_TEST_CHAOS_SEED", "1"))
JOBS_A_ROUND = 30
PATIENCE_S = 120.0 + 3.0 * NUM_JOBS


def test_nothing_is_lost(jobs: Jobs, capsys: pytest.CaptureFixture[str]) -> None:
    settings = jobs.settings.model_copy(
        # A job may lose its worker many times here, and is not to blame.
        update={"workers": 3, "max_running_per_tenant": 2, "max_attempts": 1000}
    )
    ledger.open_ledger(jobs)
    supervisor = Supervisor(settings, work=WORK)
    began_s = time.monotonic()
    with Api(settings) as api:
        load = Load(jobs, api, SEED)
        mischief = Mischief(jobs, api, supervisor, SEED)
        rounds = max(1, NUM_JOBS // JOBS_A_ROUND)
        harm = threading.Thread(target=mischief.run, args=(rounds, 2.0))
        load.submit(NUM_JOBS // 2)
        supervisor.start()
        try:
            jobs.until(lambda: len(jobs.workers()) == settings.workers)
            harm.start()
            # The later jobs arrive while the first faults occur.
            load.submit(NUM_JOBS - NUM_JOBS // 2)
            harm.join()
            wait_for_the_end(jobs)
            ended = ledger.read_ledger(jobs)
            took_s = time.monotonic() - began_s
            with capsys.disabled():
                print("\n" + ledger.figures(ended, mischief.done, took_s))
            ledger.check(jobs, ended, load.promised)
            ledger.check_shares(ended, GIANT)
        finally:
            harm.join()
            supervisor.stop()
    assert sum(mischief.done.values()) >= 5 * rounds
    for line in jobs.starts():
        wait_for_the_end_of(int(line.split()[-1]))  # no solver outlives its worker


def wait_for_the_end(jobs: Jobs) -> None:
    """Wait until no job is left; the database may still be recovering."""
    deadline_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline_s:
        try:
            if ledger.num_unfinished(jobs) == 0:
                return
        except SQLAlchemyError:
            pass
        time.sleep(0.2)
    pytest.fail("some jobs have not ended: " + unfinished(jobs))


def unfinished(jobs: Jobs) -> str:
    return ", ".join(
        f"{entry.job.id} {entry.job.state} dispatch {entry.job.dispatch} run {entry.job.run}"
        for entry in ledger.read_ledger(jobs)
        if entry.job.finished_at is None
    )
