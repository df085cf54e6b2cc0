"""Watching a job: its events as they come, or polling if there is no event stream."""

from __future__ import annotations

import logging
import random
import time
from collections.abc import Callable, Iterator
from typing import Final, Protocol, TypeVar

import httpx
from httpx_sse import EventSource, SSEError

from service.client.errors import ServiceError, WaitTimedOut, seconds_asked
from service.client.transport import Transport

log = logging.getLogger("service.client")

HOLD_S: Final = 10.0
_SILENCE_S: Final = 30.0  # of a stream on which the service sends something every 10 s
_EMPTY_STREAMS: Final = 3
_PAUSE_S: Final = 0.5


class Watched(Protocol):
    """A resource that changes until it is final."""

    @property
    def is_final(self) -> bool:
        """Whether it no longer changes."""


W = TypeVar("W", bound=Watched)


def follow(transport: Transport, path: str, parse: Callable[[str], W]) -> Iterator[W]:
    """Yield a job as it is, then after each change, until it is final.

    A broken stream of events is resumed where it broke. If no stream is available, the job
    is polled instead; the first answer may then repeat the last event.
    """
    for job in events(transport, path, parse):
        yield job
        if job.is_final:
            return
    yield from polled(transport, path, parse)


def events(transport: Transport, path: str, parse: Callable[[str], W]) -> Iterator[W]:
    """Yield a job's events for as long as a stream of them is available."""
    last_id, num_empty = "", 0
    while num_empty < _EMPTY_STREAMS:
        headers = {"Accept": "text/event-stream", "Cache-Control": "no-store"}
        if last_id:
            headers["Last-Event-ID"] = last_id
        num_empty += 1
        try:
            stream = transport.stream(f"{path}/events", headers, silence_s=_SILENCE_S)
            with stream as response:
                for event in EventSource(response).iter_sse():
                    if event.event == "job":
                        last_id, num_empty = event.id, 0
                        yield parse(event.data)
        except httpx.TransportError as error:
            log.info("the stream of events broke: %s", error)
        except (SSEError, ServiceError) as error:
            log.info("there is no stream of events: %s", error)
            return
        time.sleep(random.uniform(0.0, _PAUSE_S * 2**num_empty))


def polled(
    transport: Transport,
    path: str,
    parse: Callable[[str], W],
    *,
    timeout_s: float | None = None,
    can_hold: bool = True,
) -> Iterator[W]:
    """Yield what is at a path, then after each change, until it is final; polls with its ETag.

    Parameters
    ----------
    can_hold
        Whether the service can hold its answer until something changes.

    Raises
    ------
    WaitTimedOut
        If it is not final after ``timeout_s``.
    """
    etag: str | None = None
    until_s = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        asked_at_s = time.monotonic()
        params, headers = {}, {}
        # The first answer comes at once; only a change from a known state is waited for.
        if etag is not None:
            headers["If-None-Match"] = etag
            left_s = HOLD_S if until_s is None else min(HOLD_S, until_s - asked_at_s)
            if can_hold:
                params["wait"] = round(max(left_s, 0.0), 3)
        answer = transport.request("GET", path, params=params, headers=headers)
        if answer.status_code != 304:
            etag = answer.headers.get("etag")
            found = parse(answer.text)
            yield found
            if found.is_final:
                return
        pause_s = (seconds_asked(answer) or 0.0) - (time.monotonic() - asked_at_s)
        if until_s is not None:
            left_s = until_s - time.monotonic()
            if left_s <= 0.0:
                raise WaitTimedOut(f"{path} is not final after {timeout_s:g} s")
            pause_s = min(pause_s, left_s)
        time.sleep(max(pause_s, 0.0))
