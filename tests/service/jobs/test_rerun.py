"""A job run again: the same frozen scenario, a new job."""

from __future__ import annotations

import httpx
import pytest

from service.jobs.lease import Outcome
from tests.service.conftest import new_app, serve
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import finish, posted, start
from tests.service.problems import assert_problem

SAME = ("scenario", "solver", "params", "seed", "limits", "priority", "label")


def test_a_rerun_asks_the_same_and_leads_to_the_first(client: httpx.Client, jobs: Jobs) -> None:
    first = posted(
        client,
        jobs,
        solver="forward_search",
        params={"depth": 2},
        seed=9,
        priority=8,
        label="x",
        limits={"time_s": 7, "memory_mb": 999},
    )
    finish(jobs, first)
    answer = client.post(f"/v1/jobs/{first}/rerun")
    assert answer.status_code == 202
    again, before = answer.json(), client.get(f"/v1/jobs/{first}").json()
    assert again["id"] != first
    assert answer.headers["location"] == f"/v1/jobs/{again['id']}"
    assert (answer.headers["retry-after"], answer.headers["etag"]) == ("1", '"1"')
    assert {name: again[name] for name in SAME} == {name: before[name] for name in SAME}
    assert (again["state"], again["attempt"], again["termination"]) == ("queued", 1, None)
    assert again["links"]["rerun_of"] == f"/v1/jobs/{first}"
    assert "rerun_of" not in before["links"]
    assert client.get(f"/v1/jobs/{again['id']}").json() == again
    start(jobs, again["id"])  # it is in the queue, under its own name
    assert before["state"] == client.get(f"/v1/jobs/{first}").json()["state"] == "succeeded"


@pytest.mark.parametrize("ending", ["queued", "running", "failed", "cancelled"])
def test_a_job_in_any_state_can_be_run_again(client: httpx.Client, jobs: Jobs, ending: str) -> None:
    first = posted(client, jobs)
    match ending:
        case "running":
            start(jobs, first)
        case "failed":
            finish(jobs, first, Outcome.failed("crashed", "It ended without an answer."))
        case "cancelled":
            client.post(f"/v1/jobs/{first}/cancel")
    assert client.post(f"/v1/jobs/{first}/rerun").status_code == 202
    assert client.get(f"/v1/jobs/{first}").json()["state"] == ending


def test_a_rerun_needs_a_job_and_room_in_the_queue(jobs: Jobs) -> None:
    app = new_app(jobs.settings.model_copy(update={"max_queued": 1}), jobs.queue)
    with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
        assert_problem(client.post("/v1/jobs/none/rerun"), 404, "not_found")
        first = posted(client, jobs)
        assert_problem(client.post(f"/v1/jobs/{first}/rerun"), 503, "queue_full")
