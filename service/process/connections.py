"""Inexpensive connections: time limits, and slots that idle connections give up.

uvicorn waits for ever for the rest of a request's head, and its connection limit also
refuses health checks.
"""

from __future__ import annotations

import asyncio
import itertools
import sys
from typing import Any, ClassVar, Final

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

HEAD_WITHIN_S: Final = 10.0
"""From the connection, or the last answer, to the last byte of a request's head."""
LONGEST_HEAD: Final = 65_536

_MOST: Final = 1000
_SPARE_FILES: Final = 256
"""File descriptors for databases, logs, and connections that are being closed."""


class Protocol(HttpToolsProtocol):
    """Closes connections that do not ask in time, and idle ones at once if there are too many.

    Those that never asked go first, then those whose last answer is the oldest, so that a
    returning client finds its connection open.

    A connection *asks* from the end of a request's head until its answer is sent. One that does
    not ask, or sends a body that has not been admitted yet, gives its slot to a new connection.
    """

    most: ClassVar[int] = _MOST
    _places: ClassVar[dict[Protocol, None]] = {}

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self._head_timer: asyncio.TimerHandle | None = None
        self._is_head = False
        self._head_bytes = 0
        self._is_answered = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a slot; if there is none, that of the oldest idle connection."""
        super().connection_made(transport)
        self._places[self] = None
        if len(self._places) > self.most:
            self._make_room()
        self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the slot back."""
        self._places.pop(self, None)
        self._stop_timer()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes; close the connection if a head is too long."""
        if self._is_head:
            if self._head_bytes > LONGEST_HEAD:
                self.transport.close()
                return
            self._head_bytes += len(data)
        super().data_received(data)

    def on_message_begin(self) -> None:
        """Begin to read a head."""
        self._is_head = True
        self._head_bytes = 0
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """Begin a request."""
        self._is_head = False
        self._stop_timer()
        super().on_headers_complete()

    def on_response_complete(self) -> None:
        """Wait for the next request, or for the rest of this one's body."""
        is_next_here = bool(self.pipeline)
        self._is_answered = True
        if self in self._places:
            self._places[self] = self._places.pop(self)
        super().on_response_complete()
        if not is_next_here and not self.transport.is_closing():
            self._await_head()

    def _await_head(self) -> None:
        self._stop_timer()
        self._head_timer = self.loop.call_later(HEAD_WITHIN_S, self.transport.close)

    def _stop_timer(self) -> None:
        if self._head_timer is not None:
            self._head_timer.cancel()
            self._head_timer = None

    def _make_room(self) -> None:
        others = [one for one in self._places if one is not self]
        idle = [one for one in others if one._head_timer is not None]
        silent = (one for one in idle if not one._is_answered)
        sending = (one for one in others if one._head_timer is None and one.cycle.more_body)
        for one in itertools.islice(itertools.chain(silent, idle, sending), 1):
            del self._places[one]
            one.transport.abort()


def allow_connections() -> None:
    """Raise this process's limit on open files, and fit the number of connections to it."""
    if sys.platform == "win32":
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _MOST + _SPARE_FILES
    if soft != resource.RLIM_INFINITY and soft < wanted:
        most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        Protocol.most = max(16, min(_MOST, most - _SPARE_FILES))
