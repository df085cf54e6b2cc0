"""The jobs part of the HTTP API, on the real application."""

from __future__ import annotations

import base64
import json
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from planner_core.solvers.registry import SOLVERS
from service.answers.chunks import proof_chunks, target_chunks
from service.db.rows import JobRow
from service.jobs import lease
from service.jobs.lease import Lease, Outcome
from service.jobs.queue import DbosQueue
from service.jobs.solver_params import params_of
from tests.service.answers import chunks_of_timeline
from tests.service.conftest import checked_client, new_app, serve
from tests.service.jobs.conftest import Jobs, Workers
from tests.service.jobs.work import EMPTY
from tests.service.problems import assert_problem

TIMELINE = EMPTY | {"job": "one", "termination": "optimal"}

KEYS = {
    "id", "state", "scenario", "solver", "params", "seed", "limits", "attempt", "priority",
    "label", "progress", "created_at", "started_at", "finished_at", "termination", "error",
    "links", "change", "validity", "warnings",
}  # fmt: skip

TARGETS = [
    {
        "target_id": f"t{number}",
        "target_catalog_id": None,
        "outcome": "collected" if number % 2 else "unscheduled",
        "action_id": f"a{number}" if number % 2 else None,
        "satellite_id": "s1" if number % 2 else None,
        "reason": None if number % 2 else {"code": "no_access", "certainty": "proven"},
    }
    for number in range(7)
]


def post(client: httpx.Client, jobs: Jobs, **fields: Any) -> httpx.Response:
    return client.post(
        "/v1/jobs", json={"scenario_id": jobs.scenario_id, "solver": "rule"} | fields
    )


def posted(client: httpx.Client, jobs: Jobs, **fields: Any) -> str:
    response = post(client, jobs, **fields)
    assert response.status_code == 202, response.text
    return str(response.json()["id"])


def start(jobs: Jobs, job_id: str) -> Lease:
    with jobs.database.transaction() as session:
        held = lease.start(session, job_id, 1, lease_s=60.0)
    assert held is not None
    return held


def finish(jobs: Jobs, job_id: str, outcome: Outcome | None = None) -> None:
    answered = Outcome(
        state="succeeded",
        termination="optimal",
        chunks=(*chunks_of_timeline(TIMELINE), *target_chunks(TARGETS)),
    )
    held = start(jobs, job_id)
    with jobs.database.transaction() as session:
        assert lease.finish(session, held, outcome or answered)


def report(jobs: Jobs, held: Lease, reward: float) -> None:
    progress = {"phase": "solve", "fraction": 0.5, "reward": reward, "bound": None, "message": ""}
    with jobs.database.transaction() as session:
        lease.renew(session, held, lease_s=60.0, progress=progress)


def test_a_job_is_taken_and_shown_whole(client: httpx.Client, jobs: Jobs) -> None:
    response = post(client, jobs, label="first", seed=7, limits={"time_s": 5})
    assert response.status_code == 202
    job = response.json()
    assert set(job) == KEYS
    address = f"/v1/jobs/{job['id']}"
    assert response.headers["location"] == address
    assert response.headers["retry-after"] == "1"
    assert response.headers["etag"] == '"1"'
    assert job["state"] == "queued"
    assert job["scenario"] == {"id": jobs.scenario_id, "sha256": "0" * 64}
    assert job["params"] == params_of(SOLVERS["rule"]())
    assert job["limits"] == {"time_s": 5.0, "memory_mb": jobs.settings.default_memory_mb}
    assert (job["seed"], job["attempt"], job["priority"], job["label"]) == (7, 1, 5, "first")
    assert job["created_at"].endswith("Z")
    for name in ("progress", "started_at", "finished_at", "termination", "error"):
        assert job[name] is None
    assert job["links"] == {
        "self": address,
        "timeline": address + "/timeline",
        "targets": address + "/targets",
        "events": address + "/events",
        "scenario": f"/v1/scenarios/{jobs.scenario_id}",
    }
    assert client.get(address).json() == job


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({"solver": "magic"}, "unknown_solver", "/solver"),
        ({"params": {"dept": 3}}, "unknown_parameter_of_solver", "/params/dept"),
        ({"params": {"unimaged_only": "yes"}}, "invalid_value", "/params/unimaged_only"),
        ({"params": [1]}, "invalid_value", "/params"),
        ({"scenario_id": "no-such"}, "unknown_scenario", "/scenario_id"),
        ({"scenario_id": None}, "missing_field", "/scenario_id"),
        ({"limits": {"time_s": 0}}, "value_out_of_range", "/limits/time_s"),
        ({"limits": {"time_s": 1e9}}, "value_out_of_range", "/limits/time_s"),
        ({"limits": {"memory_mb": 16_385}}, "value_out_of_range", "/limits/memory_mb"),
        ({"limits": {"cpu": 1}}, "unknown_field", "/limits/cpu"),
        ({"priority": 10}, "value_out_of_range", "/priority"),
        ({"seed": -1}, "value_out_of_range", "/seed"),
        ({"seed": 2**63}, "value_out_of_range", "/seed"),
        ({"label": "x" * 201}, "value_out_of_range", "/label"),
        ({"colour": "red"}, "unknown_field", "/colour"),
    ],
)
def test_a_wrong_job_is_refused_by_name_and_not_stored(
    client: httpx.Client, jobs: Jobs, fields: dict[str, Any], code: str, pointer: str
) -> None:
    assert_problem(post(client, jobs, **fields), 422, code, pointer)
    assert client.get("/v1/jobs").json() == {"items": [], "next": None}


def test_a_full_queue_takes_no_more(jobs: Jobs) -> None:
    settings = jobs.settings.model_copy(update={"max_queued": 2})
    app = new_app(settings, jobs.queue)
    with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
        first = posted(client, jobs)
        posted(client, jobs)
        refused = post(client, jobs)
        assert_problem(refused, 503, "queue_full")
        assert int(refused.headers["retry-after"]) > 0
        client.post(f"/v1/jobs/{first}/cancel")
        posted(client, jobs)


def test_jobs_are_listed_newest_first_by_pages_and_filters(
    client: httpx.Client, jobs: Jobs
) -> None:
    ids = [posted(client, jobs, label=f"l{number % 2}") for number in range(5)]
    finish(jobs, ids[0])

    def listed(**query: str | int) -> list[str]:
        response = client.get("/v1/jobs", params=query)
        return [job["id"] for job in response.json()["items"]]

    assert listed() == ids[::-1]
    assert listed(label="l1") == [ids[3], ids[1]]
    assert listed(label="l") == []
    assert listed(state="succeeded") == [ids[0]]
    assert listed(solver="forward_search") == []
    assert listed(solver="rule", scenario_id=jobs.scenario_id, state="queued") == ids[:0:-1]
    assert_problem(client.get("/v1/jobs", params={"state": "sleeping"}), 422, "unknown_value")
    first = client.get("/v1/jobs", params={"limit": 2, "label": "l0"}).json()
    second = client.get("/v1/jobs", params={"limit": 2, "label": "l0", "cursor": first["next"]})
    assert [job["id"] for job in first["items"] + second.json()["items"]] == ids[::-2]
    assert second.json()["next"] is None


def test_pages_stay_in_step_while_jobs_are_added(client: httpx.Client, jobs: Jobs) -> None:
    ids = [posted(client, jobs) for _ in range(5)]
    seen: list[str] = []
    cursor: dict[str, str] = {}
    while True:
        page = client.get("/v1/jobs", params={"limit": 2, **cursor}).json()
        seen += [job["id"] for job in page["items"]]
        if page["next"] is None:
            break
        posted(client, jobs)
        cursor = {"cursor": page["next"]}
    assert seen == ids[::-1]


def test_the_service_is_not_ready_without_its_queue(jobs: Jobs, workers: Workers) -> None:
    workers.start()
    elsewhere = DbosQueue(f"sqlite:///{jobs.folder / 'unmigrated.db'}")
    for queue, status in ((jobs.queue, 200), (elsewhere, 503)):
        app = new_app(jobs.settings, queue)
        with serve(app) as address, checked_client(address) as client:
            assert client.get("/health/ready").status_code == status
    elsewhere.close()


def test_what_does_not_exist_is_not_found(client: httpx.Client) -> None:
    for path in ("", "/timeline", "/timeline.csv", "/targets", "/proof"):
        assert_problem(client.get(f"/v1/jobs/none{path}"), 404, "not_found")
    assert_problem(client.post("/v1/jobs/none/cancel"), 404, "not_found")


def test_a_job_that_has_not_changed_is_not_sent_again(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    first = client.get(f"/v1/jobs/{job_id}")
    known = {"If-None-Match": first.headers["etag"]}
    again = client.get(f"/v1/jobs/{job_id}", headers=known)
    assert (again.status_code, again.content) == (304, b"")
    finish(jobs, job_id)
    changed = client.get(f"/v1/jobs/{job_id}", headers=known)
    assert changed.status_code == 200
    assert changed.headers["etag"] != first.headers["etag"]
    assert "retry-after" not in changed.headers


def test_wait_holds_until_the_job_changes(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    held = start(jobs, job_id)
    etag = client.get(f"/v1/jobs/{job_id}").headers["etag"]
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(
            client.get,
            f"/v1/jobs/{job_id}",
            params={"wait": 30},
            headers={"If-None-Match": etag},
        )
        report(jobs, held, 12.5)
        answer = waiting.result()
    assert answer.status_code == 200
    assert answer.json()["progress"]["reward"] == 12.5


def test_wait_ends_without_a_change_and_says_so(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    unchanged = client.get(f"/v1/jobs/{job_id}", params={"wait": 0.2})
    assert unchanged.json()["state"] == "queued"
    known = {"If-None-Match": unchanged.headers["etag"]}
    again = client.get(f"/v1/jobs/{job_id}", params={"wait": 0.2}, headers=known)
    assert again.status_code == 304
    assert_problem(client.get(f"/v1/jobs/{job_id}", params={"wait": 31}), 422, "value_out_of_range")


def test_many_can_wait_while_the_server_serves_others(client: httpx.Client, jobs: Jobs) -> None:
    """Eighty held requests are more than the server has threads."""
    job_id = posted(client, jobs)
    limits = httpx.Limits(max_connections=100)
    with (
        httpx.Client(base_url=client.base_url, timeout=60, limits=limits) as waiters,
        ThreadPoolExecutor(80) as pool,
    ):
        waiting = [
            pool.submit(waiters.get, f"/v1/jobs/{job_id}", params={"wait": 30}) for _ in range(80)
        ]
        for _ in range(5):
            assert client.get("/health/live").status_code == 200
            assert not any(one.done() for one in waiting)
        client.post(f"/v1/jobs/{job_id}/cancel")
        assert {one.result().json()["state"] for one in waiting} == {"cancelled"}


def test_a_waiting_job_is_cancelled_at_once_and_only_once(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    cancelled = client.post(f"/v1/jobs/{job_id}/cancel")
    assert cancelled.status_code == 202
    assert cancelled.json()["state"] == "cancelled"
    assert cancelled.json()["finished_at"] is not None
    assert jobs.queue.lost([(job_id, 1)]) == {(job_id, 1)}
    again = assert_problem(client.post(f"/v1/jobs/{job_id}/cancel"), 409, "invalid_transition")
    assert "no transition is allowed" in again["detail"]


def test_a_running_job_is_cancelling_first(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    start(jobs, job_id)
    for _ in range(2):
        answer = client.post(f"/v1/jobs/{job_id}/cancel")
        assert (answer.status_code, answer.json()["state"]) == (202, "cancelling")


def test_the_timeline_is_not_ready_before_the_job_has_ended(
    client: httpx.Client, jobs: Jobs
) -> None:
    job_id = posted(client, jobs)
    for path in ("timeline", "timeline.json", "targets", "proof"):
        early = client.get(f"/v1/jobs/{job_id}/{path}")
        assert_problem(early, 409, "not_ready")
        assert early.headers["retry-after"] == "1"
    finish(jobs, job_id, Outcome.failed("time_limit", "No plan within the limit of 1 s."))
    late = client.get(f"/v1/jobs/{job_id}/timeline")
    assert "time_limit" in assert_problem(late, 409, "not_ready")["detail"]
    assert "retry-after" not in late.headers
    failed = client.get(f"/v1/jobs/{job_id}").json()
    assert failed["error"] == {"code": "time_limit", "detail": "No plan within the limit of 1 s."}


def test_an_unchanged_timeline_is_not_sent_again(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    path = f"/v1/jobs/{job_id}/timeline"
    known = {"If-None-Match": f'"{job_id}"'}
    assert client.get(path, headers=known).status_code == 409
    finish(jobs, job_id)
    sent = client.get(path)
    again = client.get(path, headers=known)
    assert (again.status_code, again.content) == (304, b"")
    assert {name: again.headers[name] for name in ("etag", "vary")} == {
        name: sent.headers[name] for name in ("etag", "vary")
    }
    assert client.get(path, headers=known | {"Accept": "text/csv"}).status_code != 304
    assert client.get(path, headers={"If-None-Match": '"another"'}).status_code == 200


def test_a_job_that_waits_says_when_to_ask_again(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    with jobs.database.transaction() as session:
        long_ago = datetime.now(UTC) - timedelta(minutes=10)
        session.execute(sa.update(JobRow).values(created_at=long_ago))
    path = f"/v1/jobs/{job_id}"
    sent = client.get(path)
    again = client.get(path, headers={"If-None-Match": sent.headers["etag"]})
    assert (sent.status_code, sent.headers["retry-after"]) == (200, "5")
    assert (again.status_code, again.headers["retry-after"]) == (304, "5")


def test_the_proof_of_a_bound_is_kept_with_the_answer(client: httpx.Client, jobs: Jobs) -> None:
    found = {"version": 1, "proof": "lagrangian", "value": 3.0, "prices": [1.0, 2.0]}
    for proof, shown in ((json.dumps(found), found), (None, None)):
        job_id = posted(client, jobs)
        chunks = (*chunks_of_timeline(TIMELINE), *proof_chunks(proof or ""))
        answered = Outcome(state="succeeded", chunks=chunks)
        finish(jobs, job_id, answered)
        path = f"/v1/jobs/{job_id}/proof"
        answer = client.get(path)
        assert answer.json() == shown
        known = {"If-None-Match": answer.headers["etag"]}
        assert client.get(path, headers=known).status_code == 304


def test_targets_are_listed_once_each_by_pages_and_filters(
    client: httpx.Client, jobs: Jobs
) -> None:
    job_id = posted(client, jobs)
    finish(jobs, job_id)

    def listed(**query: str | int) -> list[str]:
        found: list[str] = []
        path: str | None = f"/v1/jobs/{job_id}/targets"
        while path is not None:
            response = client.get(path, params=query)
            found += [target["target_id"] for target in response.json()["items"]]
            cursor = response.json()["next"]
            assert (cursor is None) == ("link" not in response.headers)
            query["cursor"] = cursor or ""
            path = path if cursor else None
        return found

    assert client.get(f"/v1/jobs/{job_id}/targets").json()["items"] == TARGETS
    assert listed(limit=3) == [f"t{number}" for number in range(7)]
    assert listed(limit=2, outcome="unscheduled") == ["t0", "t2", "t4", "t6"]
    assert listed(reason="no_access") == ["t0", "t2", "t4", "t6"]
    assert listed(outcome="collected", reason="no_access") == []
    wrong = client.get(f"/v1/jobs/{job_id}/targets", params={"outcome": "lost"})
    assert_problem(wrong, 422, "unknown_value")


def test_events_tell_each_change_until_the_job_is_final(client: httpx.Client, jobs: Jobs) -> None:
    job_id = posted(client, jobs)
    path = client.get(f"/v1/jobs/{job_id}").json()["links"]["events"]
    with client.stream("GET", path) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        lines = (line for line in stream.iter_lines() if line)
        first = [next(lines) for _ in range(3)]
        finish(jobs, job_id)
        rest = list(lines)
    assert first[:2] == ["id: 1", "event: job"]
    assert json.loads(first[2].removeprefix("data: "))["state"] == "queued"
    last = json.loads(rest[-1].removeprefix("data: "))
    assert last == client.get(f"/v1/jobs/{job_id}").json()
    assert last["state"] == "succeeded"
    number = rest[-3].removeprefix("id: ")
    all_seen = client.get(path, headers={"Last-Event-ID": number})
    assert (all_seen.status_code, all_seen.text) == (204, "")
    assert client.get(path, headers={"Last-Event-ID": "1"}).text.startswith(f"id: {number}\n")
    assert_problem(client.get("/v1/jobs/none/events"), 404, "not_found")


def test_a_job_goes_from_post_to_timeline_by_a_real_worker(
    client: httpx.Client, jobs: Jobs, workers: Workers
) -> None:
    workers.start()
    searching = posted(client, jobs, solver="forward_search")
    path = f"/v1/jobs/{searching}"
    jobs.until(lambda: client.get(path, params={"wait": 5}).json()["progress"] is not None)
    assert client.post(path + "/cancel").json()["state"] == "cancelling"
    jobs.until(lambda: client.get(path, params={"wait": 5}).json()["state"] == "cancelled")
    assert client.get(path).json()["termination"] == "cancelled"
    assert client.get(path + "/timeline").json()["job"] == searching
    simple = posted(client, jobs)
    path = f"/v1/jobs/{simple}"
    jobs.until(lambda: client.get(path, params={"wait": 5}).json()["state"] == "succeeded")
    assert client.get(path + "/targets").json()["items"][0]["target_id"] == "t0"


def test_a_nul_in_an_address_or_an_id_is_refused_on_every_database(client: httpx.Client) -> None:
    nul = base64.urlsafe_b64encode(b"\0").decode()
    for address in (
        "/a%00b",
        "/a%00b/timeline",
        "?label=%00",
        "?scenario_id=%00",
        f"?cursor={nul}",
    ):
        response = client.get(f"/v1/jobs{address}")
        assert response.status_code == 422, address
    response = client.post("/v1/jobs", json={"scenario_id": "a\0b", "solver": "rule"})
    assert_problem(response, 422, "invalid_value", "/scenario_id")


def test_a_plan_that_breaks_limits_says_so_on_its_job_and_in_the_list(
    client: httpx.Client, jobs: Jobs
) -> None:
    waiting, broken = posted(client, jobs), posted(client, jobs)
    outcome = Outcome(
        state="succeeded",
        termination="optimal",
        chunks=tuple(chunks_of_timeline(TIMELINE)),
        figures={"validity": "violations"},
        warnings=("Elements are old.",),
    )
    finish(jobs, broken, outcome)
    job = client.get(f"/v1/jobs/{broken}").json()
    assert (job["state"], job["validity"]) == ("succeeded", "violations")
    assert job["warnings"] == ["Elements are old."]
    listed = {one["id"]: one for one in client.get("/v1/jobs").json()["items"]}
    assert listed[broken] == job
    assert (listed[waiting]["validity"], listed[waiting]["warnings"]) == (None, [])
