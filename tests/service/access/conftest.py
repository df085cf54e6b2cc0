"""A server that asks for keys, on SQLite or the PostgreSQL server that is named."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
import pytest

from service.access import key_store
from service.access.callers import Scope
from service.main import create_app
from tests.service.conftest import serve
from tests.service.jobs.conftest import Jobs, jobs, template_url  # noqa: F401 - fixtures


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """A running server, a client without a key, and keys for it."""

    client: httpx.Client
    jobs: Jobs

    def token(self, scope: str, owner: str = "ops", expires_days: float = 1.0) -> str:
        """Make a key and return its token."""
        with self.jobs.database.transaction() as session:
            _, token = key_store.create(
                session,
                name=f"{owner}-{scope}",
                owner=owner,
                scope=Scope(scope),
                expires_days=expires_days,
            )
        return token

    def key(self, scope: str, owner: str = "ops") -> dict[str, str]:
        """Make a key and return the headers that show it."""
        return {"Authorization": f"Bearer {self.token(scope, owner)}"}

    def submit(self, key: dict[str, str], **fields: Any) -> str:
        """Post a job and return its id."""
        body = {"scenario_id": self.jobs.scenario_id, "solver": "rule"} | fields
        response = self.client.post("/v1/jobs", json=body, headers=key)
        assert response.status_code == 202, response.text
        return str(response.json()["id"])


MakeDoor = Callable[..., AbstractContextManager[Door]]


@pytest.fixture
def make_door(jobs: Jobs) -> MakeDoor:  # noqa: F811 - a fixture is used by its name
    """Return what runs a server with some settings changed."""

    @contextmanager
    def make(**changes: Any) -> Iterator[Door]:
        app = create_app(type(jobs.settings)(**jobs.settings.model_dump() | changes), jobs.queue)
        with serve(app) as address, httpx.Client(base_url=address, timeout=60) as client:
            yield Door(client=client, jobs=jobs)
        app.state.database.close()

    return make


@pytest.fixture
def door(make_door: MakeDoor) -> Iterator[Door]:
    """A server on this machine that asks for keys."""
    with make_door(require_keys=True) as door:
        yield door
