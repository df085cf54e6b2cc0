"""Real workers: what survives kills, stops and cancels."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import sqlalchemy as sa

from service.db.rows import OpportunitySetRow
from service.jobs import lease
from service.jobs.supervisor import Supervisor
from tests.patience import PATIENCE_S, wait_for_the_end_of, wait_until
from tests.service.jobs.conftest import Jobs, Workers
from tests.service.jobs.work import WORK
from tests.service.prepared import Program


def solver_pid(jobs: Jobs, job_id: str) -> int:
    """Wait until a job's solver has begun and return its process id."""
    jobs.until(lambda: any(line.startswith(job_id) for line in jobs.starts()))
    return int(next(line for line in jobs.starts() if line.startswith(job_id)).split()[-1])


def cancel(jobs: Jobs, job_id: str) -> None:
    with jobs.database.transaction() as session:
        assert lease.request_cancel(session, job_id)


def freeze(jobs: Jobs, process: Program) -> None:
    """Stop a process, but not in the middle of a write: SQLite has one lock for all."""
    while True:
        process.send_signal(signal.SIGSTOP)
        wait_until(lambda: _is_stopped(process.pid))
        if jobs.database.engine.dialect.name != "sqlite":
            return
        try:
            with closing(sqlite3.connect(jobs.folder / "jobs.db", timeout=1.0)) as connection:
                connection.execute("BEGIN IMMEDIATE")
                return
        except sqlite3.OperationalError:
            process.send_signal(signal.SIGCONT)
            time.sleep(0.05)


def _is_stopped(pid: int) -> bool:
    """Return whether all threads have stopped, which takes a while on a busy machine."""
    stats = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/stat")]
    return all(stat.rpartition(")")[2].split()[0] == "T" for stat in stats)


def test_a_job_survives_its_worker_and_finishes_once(jobs: Jobs) -> None:
    """SIGKILL in the middle of a job: the supervisor's next worker does it, and all end cleanly."""
    supervisor = Supervisor(jobs.settings, work=WORK)
    supervisor.start()
    try:
        job_id = jobs.submit("search")
        orphan = solver_pid(jobs, job_id)
        (first,) = supervisor.pids()
        os.kill(first, signal.SIGKILL)
        jobs.until(lambda: len(jobs.starts()) == 2)
        jobs.end_searches()
        job = jobs.until_state(job_id, "succeeded", "failed", "cancelled")
        assert (job.state, job.dispatch, job.run, job.lost_runs) == ("succeeded", 2, 2, 1)
        assert jobs.result(job_id) is not None
        assert len(jobs.starts()) == 2
        wait_for_the_end_of(orphan)
        jobs.until(lambda: jobs.queue.claims() == [])
        (second,) = supervisor.pids()
        assert second != first
    finally:
        supervisor.stop()
    assert supervisor.pids() == []
    wait_for_the_end_of(second)


def test_workers_take_over_from_a_frozen_and_from_a_stopped_one(
    jobs: Jobs, workers: Workers
) -> None:
    """SIGSTOP past the lease: the new owner's result counts, and the old worker survives.

    SIGTERM: the job is handed back at once, and loses nothing.
    """
    frozen = workers.start()
    job_id = jobs.submit("search")
    solver_pid(jobs, job_id)
    freeze(jobs, frozen)
    owner = workers.start()
    jobs.until(lambda: jobs.job(job_id).run == 2)
    cancel(jobs, job_id)
    job = jobs.until_state(job_id, "succeeded", "failed", "cancelled")
    assert (job.state, job.dispatch, job.termination) == ("cancelled", 2, "cancelled")

    handed_back = jobs.submit("search")
    solver = solver_pid(jobs, handed_back)
    owner.terminate()
    assert owner.wait(PATIENCE_S) == 0
    wait_for_the_end_of(solver)
    waiting = jobs.job(handed_back)
    assert (waiting.state, waiting.dispatch, waiting.lost_runs) == ("queued", 2, 0)

    jobs.end_searches()
    frozen.send_signal(signal.SIGCONT)
    assert jobs.until_state(handed_back, "succeeded", "failed").state == "succeeded"
    unchanged = jobs.job(job_id)
    assert (unchanged.version, unchanged.run) == (job.version, 2)


def test_one_worker_serves_cancels_and_failures_by_priority(jobs: Jobs, workers: Workers) -> None:
    jobs_in_order = [jobs.submit("answer", priority=priority) for priority in (0, 5, 9, 5)]
    low, middle, high, later = jobs_in_order
    worker = workers.start()
    for job_id in jobs_in_order:
        jobs.until_state(job_id, "succeeded")
    began = [line.split()[0] for line in jobs.starts()]
    assert began[0] == high
    assert set(began[1:3]) == {middle, later}
    assert began[3] == low
    with jobs.database.reading() as session:
        assert session.scalars(sa.select(OpportunitySetRow.block)).all() == [b"block"]

    searching = jobs.submit("search")
    jobs.until(lambda: (jobs.job(searching).progress or {}).get("phase") == "solve")
    cancel(jobs, searching)
    job = jobs.until_state(searching, "cancelled")
    assert job.termination == "cancelled"
    result = jobs.result(searching)
    assert result is not None
    assert json.loads(result[0])["validity"] == "valid"

    deaf = jobs.submit("deaf")
    solver_pid(jobs, deaf)
    cancel(jobs, deaf)
    assert jobs.until_state(deaf, "cancelled").termination is None
    assert jobs.result(deaf) is None

    refused = jobs.until_state(jobs.submit("refuse"), "failed")
    assert refused.error == {"code": "no_such_orbit", "detail": "The orbit is not one."}

    # The queue offers a finished job once more: nothing happens.
    with jobs.database.transaction() as session:
        jobs.queue.enqueue(session, low, 7, priority=9, tenant="local")
    after = jobs.submit("answer")
    jobs.until_state(after, "succeeded")
    assert jobs.job(low).run == 1

    worker.terminate()
    assert worker.wait(PATIENCE_S) == 0
    assert jobs.workers() == []


def test_a_tenant_leaves_room_for_others(jobs: Jobs, workers: Workers) -> None:
    """Two workers, one slot per tenant: one of them stays free for other tenants."""
    jobs.queue.configure(tenant_limit=1, poll_s=0.05)
    giants = [jobs.submit("search", tenant="giant", priority=9) for _ in range(3)]
    for _ in range(2):
        workers.start()
    jobs.until(lambda: any(jobs.job(job_id).state == "running" for job_id in giants))
    for _ in range(6):
        jobs.until_state(jobs.submit("answer", tenant="small", priority=0), "succeeded")
    states = sorted(jobs.job(job_id).state for job_id in giants)
    assert states == ["queued", "queued", "running"]


def test_jobs_that_go_too_far_fail_with_their_reason_and_others_live_on(jobs: Jobs) -> None:
    """Too much memory, too much time, and a job that kills its worker."""
    settings = jobs.settings.model_copy(update={"max_attempts": 2})
    supervisor = Supervisor(settings, work=WORK)
    supervisor.start()
    try:
        greedy = jobs.submit("hog", limits={"time_s": 60.0, "memory_mb": 300}, priority=9)
        slow = jobs.submit("no_plan", limits={"time_s": 0.1, "memory_mb": 2048}, priority=8)
        poison = jobs.submit("kill_worker", priority=7)
        harmless = jobs.submit("answer", priority=0)
        reasons = {greedy: "memory_limit", slow: "time_limit", poison: "too_many_attempts"}
        for job_id, code in reasons.items():
            job = jobs.until_state(job_id, "failed", "succeeded")
            assert job.error is not None
            assert job.error["code"] == code
            assert jobs.result(job_id) is None
        assert "2 times" in (jobs.job(poison).error or {})["detail"]
        assert sum(line.startswith(poison) for line in jobs.starts()) == 2
        assert jobs.until_state(harmless, "failed", "succeeded").state == "succeeded"
        jobs.until(lambda: jobs.queue.claims() == [])
    finally:
        supervisor.stop()


def test_a_worker_ends_however_many_signals_come(jobs: Jobs, workers: Workers) -> None:
    """A signal during the handling of another one must not cause a deadlock."""
    for _ in range(2):
        process = workers.start()
        for _ in range(300):
            process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE_S) == 0
