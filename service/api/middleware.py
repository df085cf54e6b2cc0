"""Work around every request: its id, its log line, its count."""

from __future__ import annotations

import logging
import re
import time
from http import HTTPStatus

from opentelemetry import trace
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.callers import Caller
from service.api.metrics import CallCounters
from service.db.ids import new_id
from service.process.logs import request_id

logger = logging.getLogger("service.access")

_ACCEPTABLE_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")


class RequestContext:
    """Give each request an id: the caller's ``X-Request-ID`` if it is usable, else a new one."""

    def __init__(self, app: ASGIApp, counters: CallCounters):
        self.app = app
        self.counters = counters

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, answer with its id, log and count it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        asked = Headers(scope=scope).get("x-request-id", "")
        own_id = asked if _ACCEPTABLE_ID.fullmatch(asked) else new_id()
        scope.setdefault("state", {})["request_id"] = own_id
        request_id.set(own_id)
        trace.get_current_span().set_attribute("slewline.request_id", own_id)
        started = time.perf_counter()
        status = 500

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["X-Request-ID"] = own_id
            await send(message)

        try:
            await self.app(scope, receive, send_with_id)
        finally:
            seconds = time.perf_counter() - started
            self.counters.count(scope, status, seconds)
            caller: Caller | None = scope["state"].get("caller")
            logger.log(
                logging.DEBUG if _is_routine(status, scope["path"]) else logging.INFO,
                "request",
                extra={
                    "method": scope["method"],
                    "path": scope["path"],
                    "status": status,
                    "duration_s": round(seconds, 6),
                    "owner": caller.owner if caller else None,
                    "key_id": caller.key_id if caller else None,
                },
            )


def _is_routine(status: int, path: str) -> bool:
    """Return whether a request is one of many alike, for which metrics suffice.

    Dashboards ask again and again for what has not changed, and clients that wait for the service
    to be ready ask ten times a second.
    """
    if status == HTTPStatus.NOT_MODIFIED:
        return True
    return status == HTTPStatus.SERVICE_UNAVAILABLE and path.startswith("/health/")
