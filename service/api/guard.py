"""Access control: each request is given its caller, or refused, before its body is read."""

from __future__ import annotations

import math
from contextlib import nullcontext
from typing import Final

from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import LOCAL_CALLER, NOBODY, Caller
from service.access.callers import Scope as KeyScope
from service.access.rate_limit import RateLimiter
from service.api.questions import Questions
from service.api.sites import READING, Sites
from service.api.slots import Slots
from service.problems.kinds import ServiceError
from service.settings import Settings

OPEN: Final = (
    "/health", "/version", "/docs", "/openapi.json", "/problems",
    "/new", "/jobs", "/comparisons", "/static",
)  # fmt: skip
"""Paths that anybody may read, with all below: the dashboard's pages get their data by calls."""

MOST_AT_ONCE: Final = 512
MOST_OF_AN_OWNER: Final = 256
"""Most requests under way, in all and of one owner, streams and waits included. Idle connections
make room for others (``service.process.connections``)."""

_UNLIMITED: Final = "/health"


def is_open(path: str) -> bool:
    """Return whether a path needs no key.

    >>> is_open("/health/live"), is_open("/docs"), is_open("/docs-of-mine"), is_open("/v1/jobs")
    (True, True, False, False)
    >>> is_open("/"), is_open("//v1/jobs")
    (True, False)
    """
    return path == "/" or any(_is_below(path, root) for root in OPEN)


def is_limited(path: str) -> bool:
    """Return whether requests to a path are limited: a health check must never be refused."""
    return not _is_below(path, _UNLIMITED)


class Guard:
    """Find each request's caller and put it into ``request.state.caller``.

    Reading needs the scope `read`, every other method `submit`, so that new routes are guarded by
    default. Routes that need more declare it (``deps.admin_only``).
    """

    def __init__(self, app: ASGIApp, settings: Settings):
        self.app = app
        self._keys_required = settings.keys_required
        self._static_keys = settings.static_keys
        self._sites = Sites(settings.own_hosts, settings.allowed_origins)
        self._slots = Slots(MOST_AT_ONCE, MOST_OF_AN_OWNER)
        per_s = settings.requests_per_s
        self._limiter = RateLimiter(per_s, settings.rate_limit_burst) if per_s else None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, or raise the error that refuses it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request = Request(scope)
        caller = request.state.caller = await self._admitted(request)
        place = self._slots.held(caller.owner) if is_limited(scope["path"]) else nullcontext()
        async with place:
            await self.app(scope, receive, send)

    async def _admitted(self, request: Request) -> Caller:
        path = request.scope["path"]
        if not is_limited(path):
            return NOBODY
        self._sites.check(request.method, request.headers)
        if is_open(path):
            self._count(request, NOBODY)
            return NOBODY
        try:
            caller = await self._caller(request)
        except ServiceError:
            # Wrong keys count as well; otherwise keys could be guessed at any speed.
            self._count(request, NOBODY)
            raise
        self._count(request, caller)
        require_scope(caller, KeyScope.READ if request.method in READING else KeyScope.SUBMIT)
        return caller

    async def _caller(self, request: Request) -> Caller:
        token = _token(request)
        if token is None:
            if self._keys_required:
                raise ServiceError(
                    "authentication_required",
                    "This call needs a key: Authorization: Bearer <key>, or X-API-Key.",
                    headers={"WWW-Authenticate": 'Bearer realm="slewline"'},
                )
            return LOCAL_CALLER
        questions: Questions = request.app.state.questions
        caller = self._static_keys.find(token) or await questions.callers.get(token)
        if caller is None:
            raise ServiceError(
                "invalid_key",
                "The key is unknown, expired or revoked.",
                headers={"WWW-Authenticate": 'Bearer realm="slewline", error="invalid_token"'},
            )
        return caller

    def _count(self, request: Request, caller: Caller) -> None:
        if self._limiter is None:
            return
        address = request.client.host if request.client else "unknown"
        who = f"key {caller.key_id}" if caller.key_id else f"address {address}"
        wait_s = self._limiter.take(who)
        if wait_s > 0.0:
            raise ServiceError(
                "rate_limited",
                f"Too many requests; the next one is allowed in {wait_s:.3f} s.",
                headers={"Retry-After": str(math.ceil(wait_s))},
            )


def require_scope(caller: Caller, needed: KeyScope) -> None:
    """Raise 403 ``insufficient_scope`` if the caller's scope does not include this one."""
    if caller.scope.includes(needed):
        return
    challenge = f'Bearer realm="slewline", error="insufficient_scope", scope="{needed}"'
    raise ServiceError(
        "insufficient_scope",
        f"This call needs the scope {needed}; the key has {caller.scope}.",
        headers={"WWW-Authenticate": challenge},
    )


def _token(request: Request) -> str | None:
    scheme, _, credentials = request.headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return credentials.strip()
    return request.headers.get("x-api-key")


def _is_below(path: str, root: str) -> bool:
    return path == root or path.startswith(f"{root}/")
