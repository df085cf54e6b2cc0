"""A job's row decides who runs it: every change is guarded by dispatch and run."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC

import pytest
import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError

from service.db.clock import utc_now
from service.db.ids import new_id
from service.db.rows import JobResultRow, JobRow
from service.jobs import lease
from service.jobs.lease import Lease, Outcome
from service.stores import usage_store
from tests.service.answers import chunks_of_timeline
from tests.service.jobs.conftest import Jobs

ANSWERED = Outcome(
    state="succeeded",
    termination="optimal",
    chunks=tuple(chunks_of_timeline({"validity": "valid", "satellites": []})),
)


def start(jobs: Jobs, job_id: str, dispatch: int = 1, lease_s: float = 60.0) -> Lease | None:
    with jobs.database.transaction() as session:
        return lease.start(session, job_id, dispatch, lease_s=lease_s)


def started(jobs: Jobs, job_id: str, lease_s: float = 60.0) -> Lease:
    held = start(jobs, job_id, jobs.job(job_id).dispatch, lease_s)
    assert held is not None
    return held


def finish(jobs: Jobs, held: Lease, outcome: Outcome = ANSWERED) -> bool:
    with jobs.database.transaction() as session:
        return lease.finish(session, held, outcome)


def renew(jobs: Jobs, held: Lease, reward: float | None = None) -> str | None:
    progress = None if reward is None else {"phase": "solve", "reward": reward}
    with jobs.database.transaction() as session:
        return lease.renew(session, held, lease_s=60.0, progress=progress)


def cancel(jobs: Jobs, job_id: str) -> bool:
    with jobs.database.transaction() as session:
        return lease.request_cancel(session, job_id)


def test_a_finished_job_has_its_state_and_its_result(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    assert finish(jobs, started(jobs, job_id))
    job = jobs.job(job_id)
    assert (job.state, job.termination, job.run, job.lease_until) == (
        "succeeded", "optimal", 1, None,
    )  # fmt: skip
    assert job.started_at is not None
    assert job.finished_at is not None
    assert job.created_at <= job.started_at <= job.finished_at
    assert jobs.result(job_id) == ('{"validity": "valid", "satellites": []}', "[]")


def test_a_result_that_cannot_be_stored_leaves_the_job_unfinished(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    held = started(jobs, job_id)
    with jobs.database.transaction() as session:
        row = {"job_id": job_id, "created_at": utc_now()}
        session.execute(sa.insert(JobResultRow).values(**row))
    with pytest.raises(IntegrityError):
        finish(jobs, held)
    assert jobs.job(job_id).state == "running"


def test_one_dispatch_starts_a_job_once(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    assert start(jobs, job_id) == Lease(job_id=job_id, dispatch=1, run=1)
    assert start(jobs, job_id) is None
    assert jobs.job(job_id).run == 1


def test_a_finished_job_never_starts_again(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    finish(jobs, started(jobs, job_id))
    assert start(jobs, job_id) is None


def test_a_superseded_dispatch_does_nothing(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    with jobs.database.transaction() as session:
        assert lease.return_unstarted(session, jobs.queue, job_id, 1)
        assert not lease.return_unstarted(session, jobs.queue, job_id, 1)
    assert start(jobs, job_id, dispatch=1) is None
    assert start(jobs, job_id, dispatch=2) == Lease(job_id=job_id, dispatch=2, run=1)


def test_a_stale_run_can_neither_renew_nor_finish(jobs: Jobs) -> None:
    """A worker frozen past its lease wakes up: the job is no longer its own."""
    job_id = jobs.submit("answer")
    stale = started(jobs, job_id, lease_s=-1.0)
    owner = started(jobs, job_id)
    assert owner.run == stale.run + 1
    assert renew(jobs, stale) is None
    assert not finish(jobs, stale, Outcome.failed("stale", "must not be seen"))
    assert finish(jobs, owner)
    assert not finish(jobs, owner)
    assert jobs.job(job_id).error is None


def test_progress_changes_the_version_and_a_bare_renewal_does_not(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    held = started(jobs, job_id)
    before = jobs.job(job_id)
    assert renew(jobs, held) == "running"
    renewed = jobs.job(job_id)
    assert renewed.version == before.version
    assert renewed.lease_until is not None
    assert before.lease_until is not None
    assert renewed.lease_until >= before.lease_until
    renew(jobs, held, reward=3.0)
    reported = jobs.job(job_id)
    assert reported.version == before.version + 1
    assert reported.progress == {"phase": "solve", "reward": 3.0}


def test_each_change_of_state_is_a_version_of_its_own(jobs: Jobs) -> None:
    """A client that watches a job sees every change in its ETag."""
    job_id = jobs.submit("answer")
    versions = [jobs.job(job_id).version]
    held = started(jobs, job_id)
    versions.append(jobs.job(job_id).version)
    with jobs.database.transaction() as session:
        lease.hand_back(session, jobs.queue, held)
    versions.append(jobs.job(job_id).version)
    held = started(jobs, job_id)
    versions.append(jobs.job(job_id).version)
    cancel(jobs, job_id)
    versions.append(jobs.job(job_id).version)
    finish(jobs, held)
    versions.append(jobs.job(job_id).version)
    assert versions == [1, 2, 3, 4, 5, 6]


def test_answers_are_counted_with_their_owner_and_their_warnings_are_told(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    finish(jobs, started(jobs, jobs.submit("answer")))
    outcome = replace(ANSWERED, num_shared_bytes=1000, warnings=("Elements are old.",))
    finish(jobs, started(jobs, job_id), outcome)
    num_chars = sum(len(chunk.text) for chunk in ANSWERED.chunks)
    with jobs.database.reading() as session:
        used = usage_store.used(session, "local")
    assert used == (2 * (1 + len(ANSWERED.chunks)), 1000 + 2 * num_chars)
    assert jobs.job(job_id).warnings == ["Elements are old."]


def test_a_waiting_job_is_cancelled_at_once(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    assert cancel(jobs, job_id)
    assert (jobs.job(job_id).state, jobs.job(job_id).cancel_requested) == ("cancelled", True)
    assert start(jobs, job_id) is None


def test_a_running_job_is_asked_to_stop_and_may_be_asked_twice(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    held = started(jobs, job_id)
    assert cancel(jobs, job_id)
    assert (jobs.job(job_id).state, jobs.job(job_id).cancel_requested) == ("cancelling", True)
    assert renew(jobs, held) == "cancelling"
    version = jobs.job(job_id).version
    assert cancel(jobs, job_id)
    assert jobs.job(job_id).version == version
    assert finish(jobs, held, Outcome(state="cancelled"))
    assert not cancel(jobs, job_id)


def test_a_plan_that_beats_the_cancelling_is_kept_in_a_cancelled_job(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    held = started(jobs, job_id)
    cancel(jobs, job_id)
    assert finish(jobs, held)
    assert (jobs.job(job_id).state, jobs.job(job_id).termination) == ("cancelled", "optimal")
    assert jobs.result(job_id) is not None


def test_a_job_handed_back_waits_again_and_has_lost_no_attempt(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    held = started(jobs, job_id)
    with jobs.database.transaction() as session:
        lease.hand_back(session, jobs.queue, held)
    job = jobs.job(job_id)
    assert (job.state, job.dispatch, job.lost_runs, job.lease_until) == ("queued", 2, 0, None)
    assert jobs.queue.lost([(job_id, 2)]) == set()
    assert not finish(jobs, held)


def test_a_job_that_was_being_cancelled_is_not_handed_back(jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    held = started(jobs, job_id)
    cancel(jobs, job_id)
    with jobs.database.transaction() as session:
        lease.hand_back(session, jobs.queue, held)
    assert jobs.job(job_id).state == "cancelled"


def test_a_job_and_its_place_in_the_queue_come_and_go_together(jobs: Jobs) -> None:
    job_id = new_id()
    with jobs.database.transaction() as session:
        jobs.queue.enqueue(session, job_id, 1, priority=5, tenant="local")
        session.rollback()
    assert jobs.queue.lost([(job_id, 1)]) == {(job_id, 1)}


def test_the_clock_of_the_database_counts_offsets_and_reads_as_utc(jobs: Jobs) -> None:
    with jobs.database.reading() as session:
        earlier, now, later = session.execute(
            sa.select(utc_now(-90.5), utc_now(), utc_now(90.5))
        ).one()
        assert now.tzinfo is UTC
        assert (now - earlier).total_seconds() == pytest.approx(90.5, abs=0.5)
        assert (later - now).total_seconds() == pytest.approx(90.5, abs=0.5)
        assert session.scalar(sa.select(utc_now(0.001) < utc_now(0.5)))
        assert session.scalar(sa.select(sa.func.count(JobRow.id))) == 0
