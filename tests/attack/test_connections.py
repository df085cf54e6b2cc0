"""More connections than a process may have, and some that never send a request."""

from __future__ import annotations

import resource
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import cycle, islice

import httpx
import pytest

from service.api import body_limit
from service.api.guard import MOST_OF_AN_OWNER
from service.process.connections import LONGEST_HEAD
from tests.attack.conftest import Door, Program, StartProgram, running_program
from tests.patience import PATIENCE_S
from tests.plain_http import NO_TLS
from tests.service.jobs.conftest import stored_jobs

NUM = 1050
NUM_FILES = 1024

# For tests in which connections must not reach the idle time limit, however slow the machine:
# files for 64 of them.
FEW_FILES = 320
FEW = 88


@contextmanager
def connected(client: httpx.Client, number: int, *texts: str) -> Iterator[list[socket.socket]]:
    """Open connections that each send one of the texts, in turn."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft < 2 * number:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(2 * number, hard), hard))
    address = (client.base_url.host, client.base_url.port)
    with ExitStack() as stack:
        opened = []
        for text in islice(cycle(texts), number):
            one = socket.create_connection(address, timeout=PATIENCE_S)
            opened.append(stack.enter_context(one))
            one.sendall(text.encode())
        yield opened


def head(method: str, path: str, **headers: str) -> str:
    """Return the head of a request."""
    named = (f"{name.replace('_', '-')}: {value}" for name, value in headers.items())
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: localhost", *named, "", ""])


def status_of(connection: socket.socket) -> int:
    return int(connection.recv(12).split()[1])


def is_closed(connection: socket.socket) -> bool:
    """Return True once the other side has closed."""
    try:
        while connection.recv(65_536):
            pass
    except ConnectionError:
        pass
    return True


def assert_served(run: Program, key: dict[str, str]) -> None:
    """Assert that others are served, each over a connection of its own."""
    for _ in range(10):
        for path in ("/health/live", "/v1/me"):
            address = run.door.client.base_url.join(path)
            answer = httpx.get(address, headers=key, timeout=PATIENCE_S, verify=NO_TLS)
            assert answer.status_code == 200


@pytest.fixture(scope="module")
def crowded(template_url: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Program]:
    """A program with few file descriptors, for all tests that leave it as it was."""
    with (
        stored_jobs(template_url, tmp_path_factory.mktemp("crowded")) as jobs,
        running_program(jobs, NUM_FILES) as run,
    ):
        yield run


def test_streams_of_one_owner_leave_room_for_others(crowded: Program) -> None:
    door = crowded.door
    greedy, other = door.key("submit", "streaming"), door.key("read", "other")
    path = f"/v1/jobs/{door.submit(greedy)}/events"
    with connected(door.client, NUM, head("GET", path, **greedy)) as streams:
        statuses = Counter(map(status_of, streams))
        assert statuses == {200: MOST_OF_AN_OWNER, 503: NUM - MOST_OF_AN_OWNER}
        assert_served(crowded, other)
    # Closed connections make room for others.
    with connected(door.client, 1, head("GET", path, **greedy)) as (again,):
        assert status_of(again) == 200


def test_half_sent_requests_leave_room_for_others(crowded: Program) -> None:
    other = crowded.door.key("read", "other")
    half_sent = "", "GET /health/live HT", head("GET", "/")[:-2]
    with connected(crowded.door.client, NUM, *half_sent) as silent:
        assert_served(crowded, other)
        assert all(map(is_closed, silent))


def test_who_was_served_keeps_a_connection_that_others_want(program: StartProgram) -> None:
    ask = head("GET", "/health/live")
    with (
        program(num_files=FEW_FILES) as run,
        connected(run.door.client, 1, ask) as (regular,),
    ):
        assert status_of(regular) == 200
        while b"}" not in regular.recv(65_536):
            pass
        with connected(run.door.client, FEW // 2, ask) as others:
            assert [status_of(one) for one in others] == [200] * len(others)
            regular.sendall(ask.encode())
            assert status_of(regular) == 200
            while b"}" not in regular.recv(65_536):
                pass
            with connected(run.door.client, FEW - len(others), "") as silent:
                assert is_closed(silent[0])
            with connected(run.door.client, FEW - len(others), ask) as more:
                assert [status_of(one) for one in more] == [200] * len(more)
                assert is_closed(others[0])
                regular.sendall(ask.encode())
                assert status_of(regular) == 200


def test_half_sent_bodies_leave_room_for_others(crowded: Program) -> None:
    client = crowded.door.client
    greedy, other = crowded.door.key("submit", "greedy"), crowded.door.key("read", "other")
    sent = {"Content_Type": "application/json", "Content_Length": "1000"}
    with connected(client, NUM, head("POST", "/v1/jobs", **greedy, **sent) + "{"):
        assert_served(crowded, other)
    # After a refusal nothing more is read, however long the client keeps sending.
    with connected(client, 1, head("POST", "/v1/jobs", **sent)) as (refused,):
        assert status_of(refused) == 401
        refused.settimeout(1.0)
        with pytest.raises(ConnectionError):
            send_for_ever(refused, b"{")


def send_for_ever(connection: socket.socket, piece: bytes) -> None:
    """Send pieces until the other side closes."""
    while True:
        connection.sendall(piece)
        try:
            if not connection.recv(65_536):
                raise ConnectionResetError
        except TimeoutError:
            pass


def test_a_head_without_an_end_is_not_read(crowded: Program) -> None:
    with connected(crowded.door.client, 1, "GET / HTTP/1.1\r\nX: ") as (endless,):
        endless.settimeout(0.1)
        with pytest.raises(ConnectionError):
            send_for_ever(endless, b"x" * LONGEST_HEAD)


def test_a_body_that_does_not_come_is_not_waited_for(
    door: Door, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(body_limit, "PART_WITHIN_S", 0.2)
    sent = {"Content_Type": "application/json", "Content_Length": "9"} | door.key("submit")
    with connected(door.client, 1, head("POST", "/v1/jobs", **sent) + "{") as (slow,):
        assert status_of(slow) == 408
