"""Many dashboards that poll jobs, in one process and at little cost."""

from __future__ import annotations

import asyncio
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from typing import Any
from urllib.parse import urlsplit

PERIOD_S = 1.0
"""Between two polls, unless ``Retry-After`` asks for more."""


@contextmanager
def polling(base_url: str, job_ids: Sequence[str], number: int) -> Iterator[Callable[[], int]]:
    """Let many clients poll one of these jobs each; yield a function that stops and counts them."""
    context = multiprocessing.get_context("spawn")
    stop, answers = context.Event(), context.Value("l", 0)
    args = (base_url, list(job_ids), number, stop, answers)
    process = context.Process(target=_run, args=args, daemon=True)
    process.start()

    def stopped() -> int:
        stop.set()
        process.join()
        return int(answers.value)

    try:
        yield stopped
    finally:
        stopped()


def _run(base_url: str, job_ids: list[str], number: int, stop: Event, answers: Any) -> None:
    asyncio.run(_poll_all(base_url, job_ids, number, stop, answers))


async def _poll_all(
    base_url: str, job_ids: list[str], number: int, stop: Event, answers: Any
) -> None:
    clients = [
        asyncio.create_task(_poll(base_url, job_ids, n % len(job_ids), n / number, answers))
        for n in range(number)
    ]
    while not stop.is_set():
        await asyncio.sleep(0.1)
    for client in clients:
        client.cancel()
    await asyncio.gather(*clients, return_exceptions=True)


async def _poll(base_url: str, job_ids: list[str], at: int, phase: float, answers: Any) -> None:
    """Poll a job until it has ended, then the next one that has not."""
    address = urlsplit(base_url)
    await asyncio.sleep(phase * PERIOD_S)
    reader, writer = await asyncio.open_connection(address.hostname, address.port)
    etag, pause_s = "", PERIOD_S
    while True:
        known = f"If-None-Match: {etag}\r\n" if etag else ""
        request = f"GET /v1/jobs/{job_ids[at]} HTTP/1.1\r\nHost: {address.netloc}\r\n{known}\r\n"
        writer.write(request.encode())
        head = (await reader.readuntil(b"\r\n\r\n")).decode().lower()
        headers = dict(line.split(": ", 1) for line in head.split("\r\n")[1:] if line)
        await reader.readexactly(int(headers.get("content-length", 0)))
        answers.value += 1
        if "retry-after" in headers:
            etag, pause_s = headers["etag"], float(headers["retry-after"])
        else:
            etag, at = "", (at + 1) % len(job_ids)
        await asyncio.sleep(pause_s)
