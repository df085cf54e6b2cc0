"""Comparisons: several solvers on one frozen scenario, one table."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from service.answers.rendering import figures_of
from service.jobs.lease import Outcome
from tests.service.answers import chunks_of_timeline
from tests.service.conftest import new_app, serve
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import finish, start
from tests.service.jobs.work import EMPTY
from tests.service.problems import assert_problem

RUNS = [
    {"solver": "rule"},
    {"solver": "forward_search", "params": {"depth": 2}},
    {"solver": "mcts", "seed": 3},
]
FIGURES = {
    "reward": 6.0,
    "bound": 8.0,
    "gap": 0.25,
    "bound_proof": "lagrangian",
    "collects": 6,
    "contacts": 2,
    "delivered": 4,
    "age_s": {"mean": 60.0, "median": 50.0, "p90": 90.0, "max": 100.0},
    "downlinked_mbit": None,
    "downlinked_fraction": 0.5,
    "solve_s": 0.4,
    "runtime_s": 0.65,
    "validity": "valid",
    "plan_sha256": "ab",
}


def compare(client: httpx.Client, jobs: Jobs, **fields: Any) -> httpx.Response:
    body = {"scenario_id": jobs.scenario_id, "runs": RUNS} | fields
    return client.post("/v1/comparisons", json=body)


def test_a_comparison_queues_a_job_for_each_run(client: httpx.Client, jobs: Jobs) -> None:
    answer = compare(client, jobs, label="three", priority=7, limits={"time_s": 9})
    assert answer.status_code == 202
    table = answer.json()
    assert answer.headers["location"] == f"/v1/comparisons/{table['id']}"
    assert answer.headers["retry-after"] == "1"
    assert (table["state"], table["label"]) == ("running", "three")
    assert table["scenario"] == {"id": jobs.scenario_id, "sha256": "0" * 64}
    assert [(run["solver"], run["seed"]) for run in table["runs"]] == [
        ("rule", 0),
        ("forward_search", 0),
        ("mcts", 3),
    ]
    for run in table["runs"]:
        assert {run[name] for name in FIGURES} == {None}
        job = client.get(run["links"]["job"]).json()
        assert (job["state"], job["label"], job["priority"]) == ("queued", "three", 7)
        assert job["limits"]["time_s"] == 9.0
        assert job["params"] == run["params"]
        start(jobs, run["job_id"])
    assert table["runs"][1]["params"]["depth"] == 2


def test_the_table_fills_line_by_line(client: httpx.Client, jobs: Jobs) -> None:
    table = compare(client, jobs).json()
    path = f"/v1/comparisons/{table['id']}"
    ids = [run["job_id"] for run in table["runs"]]
    etag = client.get(path).headers["etag"]
    assert client.get(path, headers={"If-None-Match": etag}).status_code == 304
    finish(
        jobs,
        ids[1],
        Outcome(
            state="succeeded",
            termination="horizon_complete",
            chunks=tuple(chunks_of_timeline(EMPTY)),
            figures=FIGURES,
        ),
    )
    answer = client.get(path, headers={"If-None-Match": etag})
    assert (answer.status_code, answer.headers["retry-after"]) == (200, "1")
    lines = answer.json()["runs"]
    assert {name: lines[1][name] for name in FIGURES} == FIGURES
    assert (lines[1]["state"], lines[1]["termination"]) == ("succeeded", "horizon_complete")
    assert {lines[0][name] for name in FIGURES} == {None}
    assert (lines[0]["state"], answer.json()["state"]) == ("queued", "running")
    finish(jobs, ids[0], Outcome.failed("no_such_orbit", "The orbit is not one."))
    client.post(f"/v1/jobs/{ids[2]}/cancel")
    finished = client.get(path)
    assert "retry-after" not in finished.headers
    assert finished.json()["state"] == "finished"
    assert [run["state"] for run in finished.json()["runs"]] == ["failed", "succeeded", "cancelled"]
    assert finished.json()["runs"][0]["error"]["code"] == "no_such_orbit"


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({"runs": []}, "value_out_of_range", "/runs"),
        ({"runs": [{"solver": "rule"}] * 33}, "value_out_of_range", "/runs"),
        ({"runs": [{"solver": "rule"}, {"solver": "magic"}]}, "unknown_solver", "/runs/1/solver"),
        (
            {"runs": [{"solver": "forward_search", "params": {"dept": 3}}]},
            "unknown_parameter_of_solver",
            "/runs/0/params/dept",
        ),
        ({"runs": [{"solver": "rule", "label": "x"}]}, "unknown_field", "/runs/0/label"),
        ({"scenario_id": "none"}, "unknown_scenario", "/scenario_id"),
        ({"scenario_id": None}, "missing_field", "/scenario_id"),
        ({"limits": {"time_s": 1e9}}, "value_out_of_range", "/limits/time_s"),
    ],
)
def test_one_wrong_run_refuses_the_whole(
    client: httpx.Client, jobs: Jobs, fields: dict[str, Any], code: str, pointer: str
) -> None:
    assert_problem(compare(client, jobs, **fields), 422, code, pointer)
    for path in ("/v1/jobs", "/v1/comparisons"):
        assert client.get(path).json()["items"] == []


def test_a_comparison_has_room_in_the_queue_as_a_whole_or_not(jobs: Jobs) -> None:
    app = new_app(jobs.settings.model_copy(update={"max_queued": 2}), jobs.queue)
    with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
        assert_problem(compare(client, jobs), 503, "queue_full")
        assert client.get("/v1/jobs").json()["items"] == []
        assert compare(client, jobs, runs=RUNS[:2]).status_code == 202


def test_comparisons_are_listed_newest_first_and_repeat_by_key(
    client: httpx.Client, jobs: Jobs
) -> None:
    body = {"scenario_id": jobs.scenario_id, "runs": RUNS}
    key = {"Idempotency-Key": "c"}
    first = client.post("/v1/comparisons", json=body, headers=key).json()
    again = client.post("/v1/comparisons", json=body, headers=key)
    assert (again.headers["idempotency-replayed"], again.json()) == ("true", first)
    second = compare(client, jobs).json()
    listed = client.get("/v1/comparisons").json()["items"]
    assert listed == [second, first]
    assert len(client.get("/v1/jobs").json()["items"]) == 6
    assert_problem(client.get("/v1/comparisons/none"), 404, "not_found")


def test_the_figures_are_those_of_the_timeline() -> None:
    totals = {
        "reward": 6.0,
        "bound": 8.0,
        "gap": 0.25,
        "bound_proof": "lagrangian",
        "collects": 6,
        "contacts": 2,
        "targets": {},
        "delivered": 4,
        "age_s": {"mean": 60.0, "median": 50.0, "p90": 90.0, "max": 100.0},
        "downlinked_mbit": None,
        "downlinked_fraction": 0.5,
        "battery_min_fraction": 0.3,
    }
    timeline = {
        "totals": totals,
        "runtime_s": {"access": 0.1, "compile": 0.1, "solve": 0.4, "verify": 0.05},
        "validity": "valid",
        "plan_sha256": "ab",
    }
    assert figures_of(timeline) == FIGURES
    # Answers of the first release do not say what is downlinked.
    older = {k: v for k, v in totals.items() if k not in ("delivered", "age_s")}
    found = figures_of(timeline | {"totals": older})
    assert found == FIGURES | {"delivered": None, "age_s": None}
