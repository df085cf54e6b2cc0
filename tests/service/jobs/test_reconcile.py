"""Every worker repairs what dead workers leave behind."""

from __future__ import annotations

import time

import sqlalchemy as sa

from service.db.clock import utc_now
from service.db.rows import JobRow
from service.jobs import lease
from service.jobs.queue import dispatch_name
from service.jobs.reconcile import Reconciler
from tests.service.jobs.conftest import Jobs


def reconcile(jobs: Jobs, *, max_attempts: int = 3) -> None:
    Reconciler(jobs.database, jobs.queue, lease_s=2.0, max_attempts=max_attempts).run()


def start_and_vanish(jobs: Jobs, job_id: str) -> None:
    """Run a job's current dispatch on a worker that dies: its lease lapses."""
    claim(jobs, job_id)
    with jobs.database.transaction() as session:
        assert lease.start(session, job_id, jobs.job(job_id).dispatch, lease_s=-1.0)


def claim(jobs: Jobs, job_id: str, *, age_s: float = 60.0) -> tuple[str, int]:
    """Force the queue's state: a worker took the job's dispatch some time ago."""
    dispatch = jobs.job(job_id).dispatch
    set_queue_status(jobs, job_id, dispatch, "PENDING", age_s)
    return job_id, dispatch


def set_queue_status(jobs: Jobs, job_id: str, dispatch: int, status: str, age_s: float) -> None:
    schema = "dbos." if jobs.database.engine.dialect.name == "postgresql" else ""
    with jobs.database.transaction() as session:
        changed = session.execute(
            sa.text(
                f"UPDATE {schema}workflow_status SET status = :status, executor_id = 'dead-worker',"
                " started_at_epoch_ms = :since WHERE workflow_uuid = :name"
            ),
            {
                "status": status,
                "since": int((time.time() - age_s) * 1000),
                "name": dispatch_name(job_id, dispatch),
            },
        )
        assert changed.rowcount == 1  # type: ignore[attr-defined]


def age(jobs: Jobs, job_id: str) -> None:
    """Make a job look as if it had been queued long ago."""
    with jobs.database.transaction() as session:
        session.execute(
            sa.update(JobRow).where(JobRow.id == job_id).values(dispatched_at=utc_now(-3600.0))
        )


def claimed(jobs: Jobs) -> set[tuple[str, int]]:
    return {(c.job_id, c.dispatch) for c in jobs.queue.claims()}


def test_a_job_whose_worker_died_is_queued_anew(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    start_and_vanish(jobs, job_id)
    reconcile(jobs)
    job = jobs.job(job_id)
    assert (job.state, job.dispatch, job.lost_runs) == ("queued", 2, 1)
    assert jobs.queue.lost([(job_id, 2)]) == set()
    assert claimed(jobs) == set(), "the dead worker's claim still takes a place of its tenant"


def test_a_job_that_keeps_killing_its_workers_is_failed(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    for _ in range(2):
        start_and_vanish(jobs, job_id)
        reconcile(jobs, max_attempts=2)
    job = jobs.job(job_id)
    assert (job.state, job.run, job.lost_runs) == ("failed", 2, 2)
    assert job.error is not None
    assert job.error["code"] == "too_many_attempts"
    assert claimed(jobs) == set()


def test_a_job_being_cancelled_by_a_dead_worker_is_cancelled(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    start_and_vanish(jobs, job_id)
    with jobs.database.transaction() as session:
        lease.request_cancel(session, job_id)
    reconcile(jobs)
    assert jobs.job(job_id).state == "cancelled"


def test_a_job_is_not_blamed_for_the_time_when_nobody_could_write(jobs: Jobs) -> None:
    """After an outage its worker has one lease's time to renew; then it counts as dead."""
    reconciler = Reconciler(jobs.database, jobs.queue, lease_s=0.4, max_attempts=1)
    reconciler.run()
    job_id = jobs.submit("answer")
    start_and_vanish(jobs, job_id)
    time.sleep(0.4)
    reconciler.run()
    assert (jobs.job(job_id).state, jobs.job(job_id).lost_runs) == ("running", 0)
    time.sleep(0.4)
    reconciler.run()
    assert (jobs.job(job_id).state, jobs.job(job_id).lost_runs) == ("failed", 1)


def test_a_live_run_is_left_alone(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    claim(jobs, job_id)
    with jobs.database.transaction() as session:
        assert lease.start(session, job_id, 1, lease_s=60.0)
    reconcile(jobs)
    assert (jobs.job(job_id).state, jobs.job(job_id).dispatch) == ("running", 1)
    assert claimed(jobs) == {(job_id, 1)}


def test_a_job_claimed_but_never_started_is_queued_anew(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    claim(jobs, job_id)
    reconcile(jobs)
    job = jobs.job(job_id)
    assert (job.state, job.dispatch, job.lost_runs) == ("queued", 2, 0)
    assert claimed(jobs) == set()


def test_a_fresh_claim_gets_its_time_to_start(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    claim(jobs, job_id, age_s=0.0)
    reconcile(jobs)
    assert jobs.job(job_id).dispatch == 1
    assert claimed(jobs) == {(job_id, 1)}


def test_a_claim_on_a_finished_job_is_given_up(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    claim(jobs, job_id)
    with jobs.database.transaction() as session:
        lease.request_cancel(session, job_id)
    reconcile(jobs)
    assert jobs.job(job_id).state == "cancelled"
    assert claimed(jobs) == set()


def test_a_waiting_job_that_the_queue_has_forgotten_is_queued_anew(jobs: Jobs) -> None:
    """A dispatch that ended before its job began would otherwise strand the job for ever."""
    forgotten, waiting = jobs.submit("answer"), jobs.submit("answer")
    set_queue_status(jobs, forgotten, 1, "ERROR", 60.0)
    for job_id in (forgotten, waiting):
        age(jobs, job_id)
    reconcile(jobs)
    assert jobs.job(forgotten).dispatch == 2
    assert jobs.job(waiting).dispatch == 1
    assert jobs.queue.lost([(forgotten, 2), (waiting, 1)]) == set()


def test_a_long_queue_is_checked_page_by_page(jobs: Jobs) -> None:
    job_ids = [jobs.submit("answer") for _ in range(5)]
    set_queue_status(jobs, job_ids[4], 1, "SUCCESS", 60.0)
    for job_id in job_ids:
        age(jobs, job_id)
    reconciler = Reconciler(jobs.database, jobs.queue, lease_s=2.0, max_attempts=3, page=2)
    for _ in range(2):
        reconciler.run()
        assert jobs.job(job_ids[4]).dispatch == 1
    reconciler.run()
    assert jobs.job(job_ids[4]).dispatch == 2
