"""Polls of jobs share queries and answers, and are as correct as if each were alone."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import httpx

from service.db.session import Database
from service.jobs import lease
from tests.service.conftest import checked_client, new_app, serve
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import finish, posted, report, start
from tests.service.problems import assert_problem

OF_THE_CALL = {"x-request-id", "date"}


def told(answer: httpx.Response) -> tuple[int, dict[str, str], bytes]:
    headers = {name: text for name, text in answer.headers.items() if name not in OF_THE_CALL}
    return answer.status_code, headers, answer.content


def test_a_poll_is_answered_as_the_route_would(client: httpx.Client, jobs: Jobs) -> None:
    """With a query string the route itself answers."""
    job_id = posted(client, jobs, label="é", params={})
    path = f"/v1/jobs/{job_id}"

    def compare() -> None:
        by_route = client.get(path, params={"wait": 0})
        assert by_route.status_code == 200
        for _ in range(2):  # rendered, then cached
            assert told(client.get(path)) == told(by_route)
        other = client.get(path, headers={"If-None-Match": '"0"'})
        assert told(other) == told(by_route)

    compare()
    held = start(jobs, job_id)
    compare()
    report(jobs, held, 12.5)
    compare()
    with jobs.database.transaction() as session:
        assert lease.finish(session, held, lease.Outcome.failed("memory_limit", "Too large."))
    compare()


def test_no_poll_is_told_less_than_was_known_when_it_came(client: httpx.Client, jobs: Jobs) -> None:
    """Many clients follow a job that keeps changing; each sees its own latest change."""
    job_id = posted(client, jobs)
    path = f"/v1/jobs/{job_id}"
    held = start(jobs, job_id)
    is_over = threading.Event()

    def follow() -> set[int]:
        etag, seen = "", set()
        while not is_over.is_set():
            answer = client.get(path, headers={"If-None-Match": etag} if etag else {})
            etag = answer.headers["etag"]
            if answer.status_code == 200:
                seen.add(int(answer.json()["progress"]["reward"]))
        return seen

    report(jobs, held, 0.0)
    with ThreadPoolExecutor(8) as pool:
        followers = [pool.submit(follow) for _ in range(8)]
        known = client.get(path).headers["etag"]
        for reward in range(1, 40):
            report(jobs, held, float(reward))
            answer = client.get(path, headers={"If-None-Match": known})
            assert (answer.status_code, answer.json()["progress"]["reward"]) == (200, reward)
            known = answer.headers["etag"]
        is_over.set()
        assert all(len(follower.result()) > 1 for follower in followers)


def test_polls_at_once_are_told_of_their_own_jobs(client: httpx.Client, jobs: Jobs) -> None:
    waiting, ended = posted(client, jobs), posted(client, jobs)
    finish(jobs, ended)
    absent = waiting[:-4] + ("0000" if waiting[-4:] != "0000" else "1111")
    known = {
        job_id: {"If-None-Match": client.get(f"/v1/jobs/{job_id}").headers["etag"]}
        for job_id in (waiting, ended)
    }
    calls = [
        *[(f"/v1/jobs/{job_id}", known[job_id], 304) for job_id in known],
        *[(f"/v1/jobs/{job_id}", {}, 200) for job_id in known],
        (f"/v1/jobs/{ended}/timeline", {"If-None-Match": f'"{ended}"'}, 304),
        (f"/v1/jobs/{waiting}/timeline", {"If-None-Match": f'"{waiting}"'}, 409),
        (f"/v1/jobs/{absent}", {}, 404),
        (f"/v1/jobs/{absent}/timeline", {"If-None-Match": "*"}, 404),
    ] * 10  # fmt: skip
    with ThreadPoolExecutor(20) as pool:
        answers = pool.map(lambda call: client.get(call[0], headers=call[1]), calls)
    for (path, _, status), answer in zip(calls, answers, strict=True):
        assert answer.status_code == status
        if status == 200:
            assert answer.json()["id"] == path.rpartition("/")[2]


def test_polls_are_refused_as_by_the_routes_while_the_database_is_away(jobs: Jobs) -> None:
    app = new_app(jobs.settings, jobs.queue)
    at_hand = app.state.database
    # No file can be opened at the path of a folder.
    away = Database(f"sqlite:///{jobs.folder}")
    with serve(app) as address, checked_client(address) as client:
        path = f"/v1/jobs/{posted(client, jobs)}"
        known = {"If-None-Match": client.get(path).headers["etag"]}
        app.state.database = away
        for headers in ({}, known):
            refused = client.get(path, headers=headers)
            assert_problem(refused, 503, "database_unavailable")
        app.state.database = at_hand
        assert client.get(path, headers=known).status_code == 304
        assert client.get(path).status_code == 200
    away.close()
