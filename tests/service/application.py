"""The application, on routes and with an OpenAPI document that are prepared once for all."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import MutableMapping
from typing import Any

from fastapi import FastAPI

from service.jobs.queue import JobQueue
from service.main import create_app
from service.settings import Settings


@functools.cache
def first_app() -> FastAPI:
    """Return the one whose routes all others have."""
    return create_app(Settings(database_url="sqlite:///unused.db"))


def new_app(settings: Settings, queue: JobQueue | None = None, **options: Any) -> FastAPI:
    """Return the application with settings of its own, on routes that another one has prepared.

    FastAPI prepares the routes of each application at its first call, for 0.1 s, and its OpenAPI
    document for 0.6. They know nothing of settings.
    """
    app = create_app(settings, queue, **options)
    app.router.routes[:] = first_app().router.routes
    app.openapi = first_app().openapi  # type: ignore[method-assign]  # as FastAPI would have it
    return app


def prepare_routes() -> None:
    """Prepare them now, by a call of none of them: no thread begins, no database is opened."""
    statuses: list[int] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: MutableMapping[str, Any]) -> None:
        statuses.extend([message["status"]] if "status" in message else [])

    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "GET",
        "scheme": "http", "path": "/none", "raw_path": b"/none", "query_string": b"",
        "root_path": "", "headers": [(b"host", b"127.0.0.1")], "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
    }  # fmt: skip
    asyncio.run(first_app()(scope, receive, send))
    assert statuses == [404], statuses
