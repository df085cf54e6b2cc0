"""A server that requires keys, a webhook receiver, and couriers between them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
import sqlalchemy as sa

from service.db.rows import WebhookDeliveryRow
from service.webhooks.courier import Courier
from tests.service.access.conftest import Door, MakeDoor, make_door  # noqa: F401 - fixtures
from tests.service.jobs.conftest import Jobs, jobs, template_url, workers  # noqa: F401
from tests.service.webhooks.receiver import Receiver, receiving

RETRY_AFTER_S = (0.1, 0.1, 0.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Post:
    """A service with webhooks to addresses of this machine, and the receiver there."""

    door: Door
    receiver: Receiver

    @property
    def jobs(self) -> Jobs:
        return self.door.jobs

    def webhook(self, path: str = "/", owner: str = "ops", **fields: Any) -> dict[str, Any]:
        """Create a webhook of an owner to a path of the receiver."""
        body = {"url": self.receiver.url + path} | fields
        key = self.door.key("submit", owner)
        response = self.door.client.post("/v1/webhooks", json=body, headers=key)
        assert response.status_code == 201, response.text
        made: dict[str, Any] = response.json()
        return made

    def deliveries(self, webhook: dict[str, Any], owner: str = "ops") -> list[dict[str, Any]]:
        """Return a webhook's deliveries as the API lists them, newest first."""
        key = self.door.key("read", owner)
        answer = self.door.client.get(webhook["links"]["deliveries"], headers=key)
        items: list[dict[str, Any]] = answer.json()["items"]
        return items

    def rows(self) -> list[WebhookDeliveryRow]:
        """Return all deliveries, oldest first."""
        wanted = sa.select(WebhookDeliveryRow).order_by(WebhookDeliveryRow.id)
        with self.jobs.database.reading() as session:
            return list(session.scalars(wanted))

    def until_ended(self, number: int = 1) -> None:
        """Wait until this number of deliveries has ended."""
        self.jobs.until(lambda: sum(row.ended_at is not None for row in self.rows()) >= number)


@pytest.fixture
def post(make_door: MakeDoor) -> Iterator[Post]:  # noqa: F811 - a fixture is used by its name
    """A service that allows webhooks to this machine."""
    with (
        make_door(require_keys=True, webhook_private_addresses=True) as door,
        receiving() as receiver,
    ):
        yield Post(door=door, receiver=receiver)


StartCourier = Callable[..., AbstractContextManager[Courier]]


@pytest.fixture
def courier(post: Post) -> StartCourier:
    """Return a function that runs a courier with short waits."""

    @contextmanager
    def run(**changes: Any) -> Iterator[Courier]:
        settings: dict[str, Any] = {
            "look_every_s": 0.05, "private": True, "retry_after_s": RETRY_AFTER_S,
        } | changes  # fmt: skip
        courier = Courier(post.jobs.database, **settings)
        courier.start()
        try:
            yield courier
        finally:
            courier.stop()

    return run
