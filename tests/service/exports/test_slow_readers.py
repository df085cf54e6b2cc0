"""Readers that take one byte of an export at a time."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from urllib.parse import urlsplit

import httpx

READERS = 60
TINY_BUFFER = 2048


@contextmanager
def reading_a_byte_at_a_time(client: httpx.Client, path: str) -> Iterator[None]:
    """Request an answer and take one byte of it, with buffers for no more than a few."""
    address = urlsplit(str(client.base_url))
    with socket.socket() as peer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, TINY_BUFFER)
        peer.connect((address.hostname, address.port))
        peer.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        assert peer.recv(1) == b"H"
        yield


def test_slow_readers_of_exports_hold_up_nobody(client: httpx.Client, job_path: str) -> None:
    whole = client.get(f"{job_path}/timeline.czml").text
    with ExitStack() as readers:
        for _ in range(READERS):
            slow = reading_a_byte_at_a_time(client, f"{job_path}/timeline.czml")
            readers.enter_context(slow)
        # More than there are threads: if each held one, the next would wait for ever.
        assert client.get(f"{job_path}/timeline.czml").text == whole
        made = client.post("/v1/jobs/none/cancel")
        assert made.status_code == 404
