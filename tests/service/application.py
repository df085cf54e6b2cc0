"""The application with routes and an OpenAPI document that are prepared once for all tests."""

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
    """Return the application whose routes all others share."""
    return create_app(Settings(database_url="sqlite:///unused.db"))


def new_app(settings: Settings, queue: JobQueue | None = None, **options: Any) -> FastAPI:
    """Return an application with its own settings, on routes that the first one has prepared.

    FastAPI prepares the routes of each application at its first call, in 0.1 s, and its OpenAPI
    document in 0.6 s. Neither depends on settings.
    """
    app = create_app(settings, queue, **options)
    app.router.routes[:] = first_app().router.routes
    app.openapi = first_app().openapi  # type: ignore[method-assign]  # as FastAPI would have it
    return app


def prepare_routes() -> None:
    """Prepare the routes by a call that matches none: starts no thread and opens no database."""
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
