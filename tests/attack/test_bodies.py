"""Bodies that take long to parse, or become very large when parsed."""

from __future__ import annotations

import json
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest

from planner_core.orbits.ingest import read_elements
from service.api.body_limit import MOST_COMMAS
from service.api.bulkhead import LIGHT_BYTES
from tests.attack.conftest import StartProgram
from tests.plain_http import NO_TLS
from tests.service.factories import ground_station
from tests.service.problems import assert_problem

JSON = {"Content-Type": "application/json"}
BYTES = {"Content-Type": "application/octet-stream"}
LONG_TAG = "<omm " + " ".join(f'a{number}=""' for number in range(500_000)) + "/>"
MANY_TAGS = "<omm>" + '<a b="" c="" d=""/>' * 600_000 + "</omm>"


@pytest.mark.parametrize("text", [LONG_TAG, MANY_TAGS], ids=["one tag", "many tags"])
@pytest.mark.parametrize("coding", ["utf-8", "utf-16"])
def test_attributes_are_counted_before_anything_is_built(text: str, coding: str) -> None:
    found = read_elements(text.encode(coding), "application/xml")
    assert [fault.code for fault in found.faults] == ["not_xml"]
    assert "tag" in found.faults[0].detail or "attributes" in found.faults[0].detail


@pytest.mark.parametrize("headers", [JSON, BYTES], ids=["json", "bytes"])
def test_the_values_of_a_body_are_counted_before_it_is_read(
    client: httpx.Client, headers: dict[str, str]
) -> None:
    text = b'{"name": "N", "targets": [' + b"0," * (MOST_COMMAS + 1) + b"0]}"
    answer = client.post("/v1/target-catalogs", content=text, headers=headers)
    assert_problem(answer, 413, "body_too_large")


def test_while_a_large_body_is_read_everybody_else_is_served(program: StartProgram) -> None:
    with program() as run:
        key = run.door.key("submit")
        body = json.dumps(ground_station(name="x" * 100)) + " " * LIGHT_BYTES
        sent = threading.Event()

        def send() -> httpx.Response:
            sent.set()
            path = run.door.client.base_url.join("/v1/ground-stations")
            return httpx.post(path, content=body, headers=key | JSON, timeout=300, verify=NO_TLS)

        # As if parsing it took for ever.
        run.heavy.send_signal(signal.SIGSTOP)
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(send)
            assert sent.wait(60)
            for _ in range(20):
                assert run.door.client.get("/v1/me", headers=key).status_code == 200
                run.door.submit(key)
            assert not answer.done()
            run.heavy.send_signal(signal.SIGCONT)
            assert answer.result().status_code == 201
