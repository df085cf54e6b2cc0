"""A bulkhead between light and heavy requests.

Python runs one thread at a time, and parsing 32 MB occupies it for seconds: requests that take
long, or gigabytes, would hold up everybody's polls. They are passed on to a separate process
(``service.heavy``) with limited memory, a few at a time in all and for each owner, and its answers
are passed back.
"""

from __future__ import annotations

import json
import re
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import asdict
from types import SimpleNamespace
from typing import Any, Final

import httpcore
from opentelemetry.propagate import inject
from starlette.datastructures import Headers
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.callers import Caller
from service.access.callers import Scope as KeyScope
from service.api.slots import Slots
from service.problems.kinds import ServiceError
from service.process.logs import request_id
from service.wire.scenarios import ScenarioIn

LIGHT_BYTES: Final = 65_536
"""Largest body that is read in the process that answers polls."""
LIGHT_TARGETS: Final = 5_000
"""Most targets of a scenario that is frozen there; a satellite counts as ten."""

_HEAVY: Final = re.compile(
    r"/v1/scenarios/[^/]+(/opportunities)?|/v1/jobs/[^/]+/(what-if|diff/.*|targets/.+/explanation)"
    r"|/v1/plans/[^/]+/(replans|changes|passes(\.[^/]*)?)|/v1/targets"
    r"|/stapi/orders(/.*)?|/stapi/products/[^/]+/opportunities"
)
# Binary files, however short, are decoded where memory is limited; a plan is read from the whole
# timeline of its job.
_HEAVY_POSTS: Final = ("/v1/forecasts", "/v1/plans")
_IS_LIGHT: Final = "slewline.is_light"
_CALLER: Final = "x-slewline-caller"
_SCHEME: Final = "x-slewline-scheme"
_ROUTE: Final = b"x-slewline-route"
_OF_ONE_HOP: Final = (
    b"connection", b"keep-alive", b"transfer-encoding", b"expect", b"upgrade", b"te", _ROUTE,
)  # fmt: skip
_WITHIN_S: Final = 120.0
_AGAIN_S: Final = 5


class Heavy(Exception):
    """The request turns out to be too heavy for this process; nothing has been done yet."""


def require_light(request: Request, body: ScenarioIn, num_targets: int) -> None:
    """Raise ``Heavy`` if the request is large and there is a process for heavy ones."""
    is_large = num_targets + 10 * len(body.satellite_ids) > LIGHT_TARGETS
    if request.scope.get(_IS_LIGHT) and (is_large or body.forecast_id is not None):
        raise Heavy


class Bulkhead:
    """Pass heavy requests on.

    Parameters
    ----------
    address
        Socket file of the process for heavy requests.
    """

    def __init__(self, app: ASGIApp, address: str):
        self.app = app
        self._pool = httpcore.AsyncConnectionPool(
            uds=address, max_connections=None, max_keepalive_connections=0
        )
        self._slots = Slots(3, 2, waiting=64, waiting_of_owner=16, wait_s=30.0)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request = Request(scope)
        if not _is_heavy(request):
            kept: list[Message] = []

            async def receive_and_keep() -> Message:
                kept.append(await receive())
                return kept[-1]

            try:
                scope[_IS_LIGHT] = True
                await self.app(scope, receive_and_keep, send)
            except Heavy:
                receive = _again(kept, receive)
            else:
                return
        with suppress(ClientDisconnect):
            async with self._slots.held(request.state.caller.owner):
                await self._pass_on(request, receive, send)

    async def _pass_on(self, request: Request, receive: Receive, send: Send) -> None:
        scope = request.scope
        is_started = False
        try:
            async with self._pool.stream(
                request.method,
                _target(scope),
                headers=_headers(request),
                content=_body(receive),
                extensions={"timeout": dict.fromkeys(("connect", "read", "write"), _WITHIN_S)},
            ) as answer:
                # The only attribute of a route that metrics read.
                route = dict(answer.headers).get(_ROUTE, b"none").decode()
                scope["route"] = SimpleNamespace(path_format=route)
                headers = [pair for pair in answer.headers if pair[0].lower() not in _OF_ONE_HOP]
                start = {"type": "http.response.start", "status": answer.status, "headers": headers}
                is_started = True
                await send(start)
                async for part in answer.aiter_stream():
                    await send({"type": "http.response.body", "body": part, "more_body": True})
            await send({"type": "http.response.body", "body": b""})
        except (httpcore.NetworkError, httpcore.ProtocolError, httpcore.TimeoutException):
            if is_started:
                raise
            raise ServiceError(
                "too_heavy",
                "The process for heavy work ended before it had an answer.",
                headers={"Retry-After": str(_AGAIN_S)},
            ) from None


class Admitted:
    """The receiving side: take the caller from the process that admitted it.

    Only for a server that nobody else can reach.
    """

    def __init__(self, app: ASGIApp):
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        told = json.loads(headers[_CALLER])
        own_id = headers["x-request-id"]
        caller = Caller(**told | {"scope": KeyScope(told["scope"])})
        scope.setdefault("state", {}).update(caller=caller, request_id=own_id)
        request_id.set(own_id)
        # For addresses in an answer: only the first process trusts a proxy's headers.
        scope["scheme"] = headers[_SCHEME]

        async def send_with_route(message: Message) -> None:
            if message["type"] == "http.response.start":
                route = getattr(scope.get("route"), "path_format", "none")
                message.setdefault("headers", []).append((_ROUTE, route.encode()))
            await send(message)

        await self.app(scope, receive, send_with_route)


def _is_heavy(request: Request) -> bool:
    length = request.headers.get("content-length", "0")
    if "transfer-encoding" in request.headers or not length.isdecimal():
        return True
    path = request.scope["path"]
    if request.method == "POST" and path in _HEAVY_POSTS:
        return True
    return int(length) > LIGHT_BYTES or _HEAVY.fullmatch(path) is not None


def _target(scope: Scope) -> httpcore.URL:
    query = b"?" + scope["query_string"] if scope["query_string"] else b""
    return httpcore.URL(scheme=b"http", host=b"heavy", port=None, target=scope["raw_path"] + query)


def _headers(request: Request) -> list[tuple[bytes, bytes]]:
    own: dict[str, Any] = {
        _CALLER: json.dumps(asdict(request.state.caller)),
        _SCHEME: request.scope["scheme"],
        "x-request-id": request.state.request_id,
    }
    inject(own)
    kept = [
        (name, value)
        for name, value in request.scope["headers"]
        if name.decode("latin-1") not in own and name not in _OF_ONE_HOP
    ]
    if "transfer-encoding" in request.headers:
        kept.append((b"transfer-encoding", b"chunked"))
    return kept + [(name.encode(), value.encode()) for name, value in own.items()]


async def _body(receive: Receive) -> AsyncIterator[bytes]:
    more = True
    while more:
        message = await receive()
        if message["type"] == "http.disconnect":
            raise ClientDisconnect
        yield message.get("body", b"")
        more = message.get("more_body", False)


def _again(kept: list[Message], receive: Receive) -> Receive:
    """Return a ``receive`` that first repeats the messages that were read already."""

    async def receive_again() -> Message:
        return kept.pop(0) if kept else await receive()

    return receive_again
