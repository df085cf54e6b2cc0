"""A server that requires keys, on SQLite or the given PostgreSQL server."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.access import key_store
from service.access.callers import Scope
from service.answers import store as answer_store
from service.answers.chunks import Chunk
from service.db.rows import JobRow
from tests.plain_http import NO_TLS
from tests.service.conftest import new_app, serve
from tests.service.exports.conftest import Mission, mission  # noqa: F401 - a fixture
from tests.service.jobs.conftest import Jobs, jobs, template_url  # noqa: F401 - fixtures

Document = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """A running server, a client without a key, and keys for it."""

    client: httpx.Client
    jobs: Jobs

    def token(self, scope: str, owner: str = "ops", expires_days: float = 1.0) -> str:
        """Create a key and return its token."""
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
        """Create a key and return the headers that present it."""
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
    """Return a function that runs a server with some settings changed."""

    @contextmanager
    def make(**changes: Any) -> Iterator[Door]:
        app = new_app(type(jobs.settings)(**jobs.settings.model_dump() | changes), jobs.queue)
        with (
            serve(app) as address,
            httpx.Client(base_url=address, timeout=60, verify=NO_TLS) as client,
        ):
            yield Door(client=client, jobs=jobs)
        app.state.database.close()

    return make


@pytest.fixture
def door(make_door: MakeDoor) -> Iterator[Door]:
    """A server on this machine that requires keys."""
    with make_door(require_keys=True) as door:
        yield door


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """A server whose jobs have answers, and the calls that move plans between states."""

    door: Door
    mission: Mission

    def answered_job(self, key: dict[str, str], chunks: tuple[Chunk, ...] | None = None) -> str:
        """Return a job that has the mission's answer."""
        job_id = self.door.submit(key)
        with self.door.jobs.database.transaction() as session:
            answer_store.save(session, job_id, chunks or self.mission.chunks, None)
            session.execute(sa.update(JobRow).where(JobRow.id == job_id).values(state="succeeded"))
        return job_id

    def draft(self, key: dict[str, str], job_id: str | None = None) -> Document:
        """Return a new plan."""
        body = {"job_id": job_id or self.answered_job(key), "name": "Monday"}
        answer = self.door.client.post("/v1/plans", json=body, headers=key)
        assert answer.status_code == 201, answer.text
        assert answer.headers["location"] == f"/v1/plans/{answer.json()['id']}"
        found: Document = answer.json()
        return found

    def move(self, plan: Document, to: str, key: dict[str, str], **fields: Any) -> httpx.Response:
        """Request a transition."""
        address = f"/v1/plans/{plan['id']}/transitions"
        return self.door.client.post(address, json={"to": to} | fields, headers=key)

    def published(self, key: dict[str, str], from_: str) -> Document:
        """Return a plan that is in force from an instant on."""
        plan = self.draft(key)
        assert self.move(plan, "approved", key).status_code == 200
        answer = self.move(plan, "published", key, effective_from=from_)
        assert answer.status_code == 200, answer.text
        return plan

    def get(self, plan: Document, key: dict[str, str], part: str = "") -> Document:
        """Return a plan, or a part of it."""
        answer = self.door.client.get(f"/v1/plans/{plan['id']}{part}", headers=key)
        assert answer.status_code == 200, answer.text
        found: Document = answer.json()
        return found

    def in_force(self, key: dict[str, str], at: str, **query: str) -> list[str]:
        """Return the plans that are published for an instant."""
        wanted = {"state": "published", "at": at} | query
        answer = self.door.client.get("/v1/plans", params=wanted, headers=key)
        return [plan["id"] for plan in answer.json()["items"]]


@pytest.fixture
def desk(door: Door, mission: Mission) -> Desk:  # noqa: F811 - a fixture is used by its name
    return Desk(door=door, mission=mission)
