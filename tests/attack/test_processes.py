"""Processes that are killed, and the fate of the jobs they ran."""

from __future__ import annotations

from dataclasses import replace

from tests.service.jobs.conftest import Jobs, Workers


def test_a_job_outlives_the_process_it_was_forked_from(jobs: Jobs, workers: Workers) -> None:
    # No lease may expire by itself: the one lost run must be this one.
    workers.jobs = replace(jobs, settings=jobs.settings.model_copy(update={"lease_s": 120.0}))
    workers.start()
    params = {"log": str(jobs.folder / "starts.log"), "survives": 2}
    job_id = jobs.submit("kill_fork_server", params=params)
    job = jobs.until_state(job_id, "succeeded", "failed")
    assert (job.state, job.error, job.lost_runs) == ("succeeded", None, 1)
    assert jobs.until_state(jobs.submit("answer"), "succeeded", "failed").state == "succeeded"


def test_a_job_that_takes_it_away_each_time_fails_at_last(jobs: Jobs, workers: Workers) -> None:
    workers.start()
    job = jobs.until_state(jobs.submit("kill_fork_server"), "succeeded", "failed")
    assert job.error is not None
    assert job.error["code"] == "too_many_attempts"
    assert len(jobs.starts()) == jobs.settings.max_attempts
