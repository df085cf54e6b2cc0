"""Receivers whose answers never end, and addresses that callers make up."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache

import httpx
import pytest

from service.webhooks import courier as couriers
from tests.patience import wait_until
from tests.service.serving import serving
from tests.service.webhooks.conftest import Post, StartCourier

ENDLESS = (
    b"HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\n\r\n",  # a body without end
    b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1\r\na\r\n",
    b"HTTP/1.1 200 OK\r\nX-Much: ",  # a header without end
    b"HTTP/1.1 100 Continue\r\n\r\n",  # answers before the answer
    b"HTTP/1.1 ",
)


@contextmanager
def endless_receiver(beginning: bytes) -> Iterator[tuple[str, list[int]]]:
    """Accept connections and send endless answers; yield the address and how much each one took."""
    sent: list[int] = []
    more = beginning if beginning.startswith(b"HTTP/1.1 100") else b"a" * 65536

    def pour(peer: socket.socket) -> None:
        place = len(sent)
        sent.append(0)
        with peer:
            try:
                peer.recv(65536)
                peer.sendall(beginning)
                while True:
                    sent[place] += peer.send(more)
            except OSError:
                return

    with socket.create_server(("127.0.0.1", 0)) as listener:

        def listen() -> None:
            while True:
                try:
                    peer, _ = listener.accept()
                except OSError:
                    return
                threading.Thread(target=pour, args=(peer,), daemon=True).start()

        threading.Thread(target=listen, daemon=True).start()
        yield f"http://127.0.0.1:{listener.getsockname()[1]}/", sent
        listener.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize("beginning", ENDLESS)
def test_a_receiver_that_answers_without_end_is_read_for_seconds_only(
    post: Post, courier: StartCourier, beginning: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(couriers, "_ANSWER_WITHIN_S", 1.0)
    key = post.door.key("submit")
    with endless_receiver(beginning) as (url, sent):
        made = post.door.client.post("/v1/webhooks", json={"url": url}, headers=key).json()
        path = f"/v1/webhooks/{made['id']}/test"
        assert post.door.client.post(path, headers=key).status_code == 202
        other = post.webhook("/other", "other")
        with courier(retry_after_s=()):
            post.until_ended()
            post.door.client.post(
                f"{other['links']['self']}/test", headers=post.door.key("submit", "other")
            )
            wait_until(lambda: post.receiver.of_path("/other"))
        assert len(sent) == 1
        # What the buffers of both ends hold, not all that it would have sent.
        assert sent[0] < 50_000_000


def refused_of(client: httpx.Client, number: int, *, trusted_last: str) -> int:
    """Return how many calls were refused, each claiming a different address."""
    calls = (
        client.get(
            "/v1/me", headers={"X-Forwarded-For": f"10.0.{n % 250}.{n // 250}{trusted_last}"}
        )
        for n in range(number)
    )
    return sum(call.status_code == 429 for call in calls)


@pytest.fixture(scope="module")
def limited(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], str]]:
    """Return a function from trusted proxies to the address of a service that trusts them."""
    limits = {"rate_limit_per_s": "0.001", "rate_limit_burst": "5"}
    with pytest.MonkeyPatch.context() as patch, ExitStack() as stack:

        @cache
        def url(trusted: str) -> str:
            patch.setenv("FORWARDED_ALLOW_IPS", trusted)
            folder = tmp_path_factory.mktemp("limited")
            _, line = stack.enter_context(serving(folder, "serve", "--workers", "0", **limits))
            return line.split()[-1]

        yield url


@pytest.mark.parametrize(
    ("trusted", "last", "is_limited"),
    [
        ("", "", True),  # no proxy is trusted
        ("192.0.2.1", "", True),  # another proxy is trusted
        ("127.0.0.1", ", 198.51.100.7", True),  # the proxy appends the address it has seen
        ("127.0.0.1", "", False),  # the proxy itself claims the addresses
    ],
)
def test_a_made_up_address_moves_no_rate_limit(
    limited: Callable[[str], str], trusted: str, last: str, is_limited: bool
) -> None:
    with httpx.Client(base_url=limited(trusted), timeout=60, trust_env=False) as client:
        assert refused_of(client, 20, trusted_last=last) == (15 if is_limited else 0)
