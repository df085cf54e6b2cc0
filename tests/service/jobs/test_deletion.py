"""Deleting jobs, comparisons and scenarios: by hand, and by age."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.db import rows
from service.jobs.retention import Retention
from service.stores import usage_store
from tests.service.jobs.conftest import Jobs, Workers
from tests.service.jobs.test_api import finish, posted
from tests.service.problems import assert_problem

OWNER = "local"


def count(jobs: Jobs, row: type[Any]) -> int:
    with jobs.database.reading() as session:
        number = session.scalar(sa.select(sa.func.count()).select_from(row))
    assert number is not None
    return number


def used(jobs: Jobs) -> tuple[int, int]:
    with jobs.database.reading() as session:
        return usage_store.used(session, OWNER)


def age(jobs: Jobs, row: type[Any], own_id: str, column: str, days: float) -> None:
    """Make an event appear to have happened this many days ago."""
    then = datetime.now(UTC) - timedelta(days=days)
    with jobs.database.transaction() as session:
        session.execute(sa.update(row).where(row.id == own_id).values({column: then}))


def test_a_finished_job_is_deleted_with_its_answer(client: httpx.Client, jobs: Jobs) -> None:
    before = used(jobs)
    job_id = posted(client, jobs)
    assert_problem(client.delete(f"/v1/jobs/{job_id}"), 409, "invalid_transition")
    finish(jobs, job_id)
    assert used(jobs) > before
    assert client.delete(f"/v1/jobs/{job_id}").status_code == 204
    assert used(jobs) == before
    assert_problem(client.get(f"/v1/jobs/{job_id}"), 404, "not_found")
    assert_problem(client.delete(f"/v1/jobs/{job_id}"), 404, "not_found")
    for row in (rows.JobRow, rows.JobResultRow, rows.JobChunkRow):
        assert count(jobs, row) == 0
    last = client.get("/v1/audit-events").json()["items"][0]
    assert (last["action"], last["object_id"]) == ("delete", job_id)


def test_what_something_leads_to_stays(client: httpx.Client, jobs: Jobs) -> None:
    runs = [{"solver": "rule"}, {"solver": "mcts"}]
    body = {"scenario_id": jobs.scenario_id, "runs": runs}
    comparison = client.post("/v1/comparisons", json=body).json()
    job_ids = [run["job_id"] for run in comparison["runs"]]
    for job_id in job_ids:
        finish(jobs, job_id)
    scenario = f"/v1/scenarios/{jobs.scenario_id}"
    for address in (f"/v1/jobs/{job_ids[0]}", scenario):
        assert_problem(client.delete(address), 409, "in_use")
    own = f"/v1/comparisons/{comparison['id']}"
    assert client.delete(own).status_code == 204
    assert_problem(client.delete(own), 404, "not_found")
    assert_problem(client.delete(scenario), 409, "in_use")
    for job_id in job_ids:
        assert client.delete(f"/v1/jobs/{job_id}").status_code == 204
    assert client.delete(scenario).status_code == 204
    assert_problem(client.get(scenario), 404, "not_found")


def test_what_is_old_goes_and_what_is_needed_stays(client: httpx.Client, jobs: Jobs) -> None:
    old, young, waiting = (posted(client, jobs) for _ in range(3))
    body = {"scenario_id": jobs.scenario_id, "runs": [{"solver": "rule"}, {"solver": "mcts"}]}
    comparisons = [client.post("/v1/comparisons", json=body).json() for _ in range(2)]
    compared = [run["job_id"] for one in comparisons for run in one["runs"]]
    for job_id in (old, young, *compared):
        finish(jobs, job_id)
    for job_id in (old, *compared):
        age(jobs, rows.JobRow, job_id, "finished_at", 1.0)
    age(jobs, rows.ComparisonRow, comparisons[0]["id"], "created_at", 1.0)
    age(jobs, rows.ScenarioRow, jobs.scenario_id, "created_at", 1.0)
    Retention(jobs.database, None).run()
    assert count(jobs, rows.JobRow) == 7
    for _ in range(3):
        Retention(jobs.database, 0.5).run()
    left = {job["id"] for job in client.get("/v1/jobs").json()["items"]}
    assert left == {young, waiting, *compared[2:]}
    listed = client.get("/v1/comparisons").json()["items"]
    assert [one["id"] for one in listed] == [comparisons[1]["id"]]
    assert count(jobs, rows.ScenarioRow) == 1


def test_workers_delete_by_age_and_at_last_the_scenario(
    client: httpx.Client, jobs: Jobs, workers: Workers
) -> None:
    job_id = posted(client, jobs)
    finish(jobs, job_id)
    age(jobs, rows.JobRow, job_id, "finished_at", 1.0)
    age(jobs, rows.ScenarioRow, jobs.scenario_id, "created_at", 1.0)
    workers.start({"SLEWLINE_RETENTION_DAYS": "0.5"})
    jobs.until(lambda: count(jobs, rows.ScenarioRow) == 0)
    assert count(jobs, rows.JobRow) == 0


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ({}, 2),
        ({"from": "2020-01-01T00:00:00Z"}, 2),
        ({"to": "2020-01-01T00:00:00Z"}, 0),
        ({"from": "yesterday"}, None),
    ],
)
def test_lists_are_narrowed_by_time(
    client: httpx.Client, jobs: Jobs, query: dict[str, str], found: int | None
) -> None:
    for _ in range(2):
        posted(client, jobs)
    answer = client.get("/v1/jobs", params=query)
    if found is None:
        assert_problem(answer, 422, "invalid_time")
    else:
        assert len(answer.json()["items"]) == found
    ids = [job["id"] for job in client.get("/v1/jobs").json()["items"]]
    age(jobs, rows.JobRow, ids[0], "created_at", 1.0)
    border = (datetime.now(UTC) - timedelta(days=0.5)).isoformat()
    before = client.get("/v1/jobs", params={"to": border}).json()["items"]
    after = client.get("/v1/jobs", params={"from": border}).json()["items"]
    assert [[job["id"] for job in some] for some in (before, after)] == [ids[:1], ids[1:]]
