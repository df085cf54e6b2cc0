"""The attacks of one owner, in a process whose own cost is not measured."""

from __future__ import annotations

import contextlib
import multiprocessing
import resource
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx

NUM_CONNECTIONS = 1050
BODY_BYTES = 31_000_000
PAUSE_S = 0.05
JSON = {"Content-Type": "application/json"}
XML = {"Content-Type": "application/xml"}

Attack = Callable[[httpx.Client, dict[str, Any]], None]


def lists(client: httpx.Client, aims: dict[str, Any]) -> None:
    """Request eighty lists at a time of opportunities that take long to compute."""
    _in_threads(80, lambda: client.get(f"/v1/scenarios/{aims['heavy']}/opportunities"))


def webhooks(client: httpx.Client, _aims: dict[str, Any]) -> None:
    """Test twenty webhooks again and again whose receiver never answers."""
    with socket.create_server(("127.0.0.1", 0), backlog=4096) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        made = [client.post("/v1/webhooks", json={"url": url}).json() for _ in range(20)]
        paths = [f"/v1/webhooks/{one['id']}/test" for one in made if "id" in one]

        def test_all() -> None:
            for path in paths:
                client.post(path)
                time.sleep(PAUSE_S)

        _in_threads(2, test_all)


def connections(client: httpx.Client, aims: dict[str, Any]) -> None:
    """Open event streams and half-sent requests, 1,050 of each, and reopen those closed."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 4096)), hard))
    key = client.headers["authorization"]
    path = f"/v1/jobs/{aims['job']}/events"
    stream = f"GET {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: {key}\r\n\r\n".encode()
    texts = [stream, b"GET /v1/me HTTP/1.1\r\n"] * NUM_CONNECTIONS
    opened: list[socket.socket | None] = [None] * len(texts)
    address = (client.base_url.host, client.base_url.port or 80)
    while True:
        for number, text in enumerate(texts):
            if not _is_open(opened[number]):
                opened[number] = _connect(address, text)
        time.sleep(PAUSE_S)


def comparisons(client: httpx.Client, aims: dict[str, Any]) -> None:
    """Request comparisons of 32 runs, as many as are accepted and then more."""
    body = {"scenario_id": aims["light"], "runs": [{"solver": "rule"}] * 32}

    def compare() -> None:
        client.post("/v1/comparisons", json=body)
        time.sleep(PAUSE_S)

    _in_threads(4, compare)


def bodies(client: httpx.Client, _aims: dict[str, Any]) -> None:
    """Send JSON of 31 MB, and XML with two million attributes."""
    item = '{"id":"t","lat_deg":1,"lon_deg":2,"reward":3},'
    text = '{"name":"N","targets":[' + item * (BODY_BYTES // len(item)) + "{}]}"
    xml = "<omm " + " ".join(f'a{number}=""' for number in range(2_000_000)) + "/>"
    sent = threading.local()

    def send() -> None:
        sent.turn = not getattr(sent, "turn", False)
        if sent.turn:
            client.post("/v1/target-catalogs", content=text, headers=JSON)
        else:
            client.post("/v1/satellites/import", content=xml, headers=XML)

    _in_threads(4, send)


ATTACKS: dict[str, Attack] = {
    "2: lists of opportunities": lists,
    "3: silent receivers": webhooks,
    "6: streams, half-sent requests": connections,
    "7: comparisons": comparisons,
    "8: large bodies": bodies,
}


@contextmanager
def attacking(name: str, url: str, key: dict[str, str], aims: dict[str, Any]) -> Iterator[None]:
    """Attack until the block ends."""
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=_run, args=(name, url, key, aims), daemon=True)
    process.start()
    try:
        yield
    finally:
        process.kill()
        process.join()


def _run(name: str, url: str, key: dict[str, str], aims: dict[str, Any]) -> None:
    limits = httpx.Limits(max_connections=None)
    with httpx.Client(base_url=url, headers=key, timeout=300, limits=limits) as client:
        ATTACKS[name](client, aims)


def _in_threads(number: int, work: Callable[[], object]) -> None:
    def again_and_again() -> None:
        while True:
            with contextlib.suppress(httpx.HTTPError):
                work()
            time.sleep(PAUSE_S)

    threads = [threading.Thread(target=again_and_again, daemon=True) for _ in range(number)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _connect(address: tuple[str, int], text: bytes) -> socket.socket | None:
    try:
        one = socket.create_connection(address, timeout=5.0)
        one.sendall(text)
        one.setblocking(False)
    except OSError:
        return None
    return one


def _is_open(one: socket.socket | None) -> bool:
    if one is None:
        return False
    try:
        is_closed = not one.recv(65_536)
    except BlockingIOError:
        return True
    except OSError:
        is_closed = True
    if is_closed:
        one.close()
    return not is_closed
