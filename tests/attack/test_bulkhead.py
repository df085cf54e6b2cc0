"""Heavy work runs in a process of its own, and delays no other request."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import psutil
import pytest

from service.api.bulkhead import LIGHT_TARGETS
from service.api.slots import Slots
from service.problems.kinds import ServiceError
from tests.attack.conftest import Program, StartProgram, running_program
from tests.patience import wait_until
from tests.plain_http import NO_TLS
from tests.service.factories import ground_station, satellite, target
from tests.service.jobs.conftest import stored_jobs
from tests.service.problems import assert_problem

HORIZON = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-02T00:00:00Z"}


@pytest.fixture(scope="module")
def plain(template_url: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Program]:
    """A program with default settings, for all tests that leave it as it was."""
    with (
        stored_jobs(template_url, tmp_path_factory.mktemp("plain")) as jobs,
        running_program(jobs) as run,
    ):
        yield run


def targets(number: int) -> list[dict[str, Any]]:
    return [
        target(id=f"t{i}", lat_deg=-80 + 160 * i / number, lon_deg=i % 360 - 180)
        for i in range(number)
    ]


def post(program: Program, path: str, body: object, key: dict[str, str]) -> httpx.Response:
    return program.door.client.post(path, json=body, headers=key)


def scenario(program: Program, key: dict[str, str], num_targets: int, **fields: Any) -> str:
    """Store a scenario with this number of targets and return its id."""
    catalog = {"name": "Many", "targets": targets(num_targets)}
    body = {
        "horizon": HORIZON,
        "satellite_ids": [post(program, "/v1/satellites", satellite(), key).json()["id"]],
        "target_catalog_ids": [post(program, "/v1/target-catalogs", catalog, key).json()["id"]],
        **fields,
    }
    answer = post(program, "/v1/scenarios", body, key)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def num_listed(program: Program, key: dict[str, str]) -> float:
    """Return how many lists of opportunities the metrics have counted."""
    counted = program.door.client.get("/metrics", headers=key).text
    found = re.search(r'/opportunities",status="200"} (\S+)', counted)
    return 0.0 if found is None else float(found[1])


def test_what_is_passed_on_is_answered_as_if_it_were_not(plain: Program) -> None:
    key = plain.door.key("submit")
    held, listed_before = plain.heavy.pid, num_listed(plain, key)
    own_id = scenario(plain, key, LIGHT_TARGETS + 1)  # a large body, and a large question
    small = scenario(plain, key, 1)
    client = plain.door.client
    shown = client.get(f"/v1/scenarios/{own_id}", headers=key)
    assert shown.json()["counts"]["targets"] == LIGHT_TARGETS + 1
    known = {"If-None-Match": shown.headers["etag"]} | key
    assert client.get(f"/v1/scenarios/{own_id}", headers=known).status_code == 304
    page = client.get(f"/v1/scenarios/{small}/opportunities?kind=collect&limit=1", headers=key)
    assert page.status_code == 200, page.text
    assert_problem(client.get("/v1/scenarios/none", headers=key), 404, "not_found")
    refused = client.get(f"/v1/scenarios/{small}/opportunities?limit=0", headers=key)
    assert_problem(refused, 422, "value_out_of_range")
    assert_problem(client.get(f"/v1/scenarios/{small}"), 401, "authentication_required")
    # A caller cannot forge an identity: only the service itself may set this header.
    admin = {"x-slewline-caller": json.dumps({"owner": "x", "scope": "admin"})}
    assert client.get(f"/v1/scenarios/{small}", headers=admin).status_code == 401
    assert client.get("/v1/audit-events", headers=key | admin).status_code == 403
    assert num_listed(plain, key) == listed_before + 1
    assert "x-slewline-route" not in page.headers
    assert plain.heavy.pid == held


def test_what_reads_whole_timelines_or_catalogues_is_passed_on(plain: Program) -> None:
    asked = [
        ("GET", "/v1/targets?state=cancelled", None, 200),
        ("GET", "/v1/plans/none/changes", None, 404),
        ("GET", "/v1/plans/none/passes", None, 404),
        ("POST", "/v1/plans", {"job_id": "none"}, 422),
        ("GET", "/stapi/orders", None, 200),
        ("POST", "/stapi/products/none/opportunities", {}, 404),
    ]
    key, url = plain.door.key("submit"), plain.door.client.base_url

    def ask(call: tuple[str, str, Any, int]) -> int:
        method, path, body, _ = call
        address = url.join(path)
        answer = httpx.request(method, address, json=body, headers=key, timeout=300, verify=NO_TLS)
        return answer.status_code

    plain.heavy.send_signal(signal.SIGSTOP)
    with ThreadPoolExecutor(len(asked)) as threads:
        answers = [threads.submit(ask, call) for call in asked]
        for _ in range(20):
            assert plain.door.client.get("/v1/me", headers=key).status_code == 200
            plain.door.submit(key)
        assert not any(answer.done() for answer in answers)
        plain.heavy.send_signal(signal.SIGCONT)
        assert [answer.result() for answer in answers] == [call[3] for call in asked]


def test_a_body_that_comes_in_pieces_or_is_too_large(program: StartProgram) -> None:
    with program(max_body_mb=1) as run:
        key = run.door.key("submit")
        headers = key | {"Content-Type": "application/json"}
        text = json.dumps(ground_station()).encode()
        client = run.door.client
        pieces = iter([text[:5], text[5:]])
        made = client.post("/v1/ground-stations", content=pieces, headers=headers)
        assert made.status_code == 201, made.text
        endless = (b" " * 100_000 for _ in range(20))
        refused = client.post("/v1/ground-stations", content=endless, headers=headers)
        assert_problem(refused, 413, "body_too_large")


def test_one_who_asks_for_much_at_once_holds_up_nobody(plain: Program) -> None:
    """Forty lists of opportunities that take long to compute, by one owner."""
    greedy, other = plain.door.key("submit", "greedy"), plain.door.key("read", "other")
    long = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-03T00:00:00Z"}
    own_id = scenario(plain, greedy, 20_000, collect_spacing_s=0.7, horizon=long)
    address = plain.door.client.base_url.join(f"/v1/scenarios/{own_id}/opportunities")
    one_was_refused = threading.Event()

    def ask(_: int) -> str:
        answer = httpx.get(address, headers=greedy, timeout=300, verify=NO_TLS)
        if answer.status_code == 503:
            assert int(answer.headers["retry-after"]) > 0
            one_was_refused.set()
        return str(answer.json().get("code"))

    with ThreadPoolExecutor(40) as pool:
        answers = [pool.submit(ask, number) for number in range(40)]
        assert one_was_refused.wait(300)  # as many wait as may, and one more was refused
        assert plain.door.client.get("/v1/me", headers=other).status_code == 200
        assert not all(one.done() for one in answers), "nobody waits for the answer any more"
        assert "too_busy" in {one.result() for one in answers}


def test_a_process_that_holds_too_much_is_ended_and_the_api_goes_on(program: StartProgram) -> None:
    with program(heavy_memory_mb=300, max_body_mb=32) as run:
        key = run.door.key("submit")
        first, api = run.heavy.pid, psutil.Process(run.process.pid)
        before_mb = api.memory_info().rss / 1e6
        # Millions of numbers in lists, each of them a separate object.
        body = {"name": "Much", "targets": [[0.5 + i for i in range(9)] for _ in range(300_000)]}
        answer = post(run, "/v1/target-catalogs", body, key)
        assert_problem(answer, 503, "too_heavy")
        assert int(answer.headers["retry-after"]) > 0
        assert run.door.client.get("/v1/me", headers=key).status_code == 200
        (fork_server,) = api.children()
        wait_until(lambda: [p.pid for p in fork_server.children()] not in ([], [first]))
        assert scenario(run, key, 1)
        assert api.memory_info().rss / 1e6 < before_mb + 100


def test_places_are_shared_by_owners_in_turn() -> None:
    async def play() -> list[str]:
        slots = Slots(2, 1, waiting=4, waiting_of_owner=2, wait_s=60)
        order: list[str] = []
        go_on = asyncio.Event()

        async def work(name: str) -> None:
            try:
                async with slots.held(name[0]):
                    order.append(name)
                    await go_on.wait()
            except ServiceError as error:
                order.append(f"{name} {error.code}")

        async with asyncio.TaskGroup() as group:
            for name in ("a1", "a2", "a3", "a4", "b1", "c1"):
                group.create_task(work(name))
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            assert order == ["a1", "a4 too_busy", "b1"]
            go_on.set()
        return order

    assert asyncio.run(play()) == ["a1", "a4 too_busy", "b1", "a2", "c1", "a3"]


def test_who_goes_away_while_waiting_leaves_no_place_taken() -> None:
    async def play() -> None:
        slots = Slots(1, 1, waiting=2, waiting_of_owner=2, wait_s=60)

        async def hold() -> None:
            async with slots.held("a"):
                await asyncio.sleep(0)

        async with slots.held("a"):
            waiting = asyncio.create_task(hold())
            await asyncio.sleep(0)
            waiting.cancel()
            with pytest.raises(asyncio.CancelledError):
                await waiting
        await hold()

    asyncio.run(play())
