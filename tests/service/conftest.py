"""The real service on a free port, with a database of its own."""

from __future__ import annotations

import asyncio
import functools
import shutil
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
import uvicorn
from fastapi import FastAPI

from service.db.migrate import upgrade
from service.db.session import Database
from service.scenarios.opportunities import OpportunityReader
from service.settings import Settings
from tests.plain_http import NO_TLS
from tests.service.application import first_app, new_app
from tests.service.contract import Contract

__all__ = ["Service", "checked_client", "contract", "new_app", "serve"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """A running service and how to reach it."""

    app: FastAPI
    client: httpx.Client
    database: Database
    settings: Settings


class _PromptServer(uvicorn.Server):
    """A server that ends as soon as it is told to; others look every tenth of a second.

    Looking a hundred times a second takes 2.8 % of a core from the tests; this takes 0.4 %.
    """

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        self._loop, self._told = asyncio.get_running_loop(), asyncio.Event()
        await super().startup(sockets)

    async def main_loop(self) -> None:
        while not await self.on_tick(0):
            with suppress(TimeoutError):
                await asyncio.wait_for(self._told.wait(), 0.1)

    def end(self) -> None:
        """Tell the server to end, from another thread."""
        self._loop.call_soon_threadsafe(self._end)

    def _end(self) -> None:
        self.should_exit = True
        self._told.set()


@contextmanager
def serve(app: FastAPI) -> Iterator[str]:
    """Run an application in a thread; yield its address."""
    server = _PromptServer(uvicorn.Config(app, port=0, log_level="critical"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive(), "the server did not start"
        time.sleep(0.005)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        server.end()
        thread.join()


@functools.cache
def contract() -> Contract:
    """Return the contract of the OpenAPI document, which does not depend on settings."""
    return Contract(first_app().openapi())


def checked_client(address: str) -> httpx.Client:
    """Return a client that checks every answer against the OpenAPI document."""
    hooks = {"response": [contract().check]}
    return httpx.Client(base_url=address, timeout=60, verify=NO_TLS, event_hooks=hooks)


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with only the schema, to be copied."""
    path = tmp_path_factory.mktemp("database") / "empty.db"
    upgrade(f"sqlite:///{path}")
    return path


@pytest.fixture
def settings(tmp_path: Path, empty_database: Path) -> Settings:
    """Settings of a service with an empty database in a temporary folder."""
    shutil.copyfile(empty_database, tmp_path / "service.db")
    return Settings(database_url=f"sqlite:///{tmp_path / 'service.db'}", max_body_mb=4.0)


@pytest.fixture(scope="session")
def running_app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[FastAPI, str]]:
    """The application on one port for all tests; each test gives it its own database."""
    unused = f"sqlite:///{tmp_path_factory.mktemp('unused') / 'unused.db'}"
    app = new_app(Settings(database_url=unused, max_body_mb=4.0))
    with serve(app) as address:
        yield app, address


@pytest.fixture
def service(settings: Settings, running_app: tuple[FastAPI, str]) -> Iterator[Service]:
    """A service with an empty database."""
    app, address = running_app
    app.state.settings = settings
    app.state.database = Database(settings.database_url)
    app.state.opportunities = OpportunityReader()
    with checked_client(address) as client:
        yield Service(app=app, client=client, database=app.state.database, settings=settings)
    app.state.opportunities.close()
    app.state.database.close()


@pytest.fixture
def client(service: Service) -> httpx.Client:
    """An HTTP client of an empty service."""
    return service.client
