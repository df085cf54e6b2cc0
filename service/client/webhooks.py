"""Webhooks: where the service tells the ends of jobs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from service.client.collection import Collection
from service.client.transport import said
from service.wire.webhooks import DeliveryOut as Delivery
from service.wire.webhooks import WebhookOut


class Webhook(WebhookOut):
    """A webhook. Only a new one has its ``secret``, which signs what it sends."""

    secret: str | None = None


class Webhooks(Collection[Webhook]):
    """The webhooks of the key's owner. Nothing more is sent to one that is deleted."""

    _name, _shape = "webhooks", Webhook

    def create(
        self,
        url: str,
        *,
        events: Sequence[str] | None = None,
        name: str | None = None,
        idempotency_key: str | None = None,
    ) -> Webhook:
        """Have the ends of jobs told to an address; by default all of them."""
        asked = None if events is None else list(events)
        return self._create(said(url=url, events=asked, name=name), idempotency_key)

    def test(self, webhook_id: str, *, idempotency_key: str | None = None) -> Delivery:
        """Have a test event sent."""
        path = self._path(webhook_id, "test")
        return self._transport.post(path, Delivery, idempotency_key=idempotency_key)

    def deliveries(self, webhook_id: str) -> Iterator[Delivery]:
        """Yield what was sent, newest first."""
        return self._transport.pages(self._path(webhook_id, "deliveries"), Delivery)
