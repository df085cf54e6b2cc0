"""Webhooks: addresses that the service notifies when jobs end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from service.client.collection import Collection
from service.client.transport import said
from service.wire.webhooks import DeliveryOut as Delivery
from service.wire.webhooks import WebhookOut


class Webhook(WebhookOut):
    """A webhook. Only a newly created one has its ``secret``, which signs messages."""

    secret: str | None = None


class Webhooks(Collection[Webhook]):
    """The webhooks of the key's owner. A deleted one receives nothing more."""

    _name, _shape = "webhooks", Webhook

    def create(
        self,
        url: str,
        *,
        events: Sequence[str] | None = None,
        name: str | None = None,
        idempotency_key: str | None = None,
    ) -> Webhook:
        """Register an address to be notified of ``events``; by default of every end of a job."""
        asked = None if events is None else list(events)
        return self._create(said(url=url, events=asked, name=name), idempotency_key)

    def test(self, webhook_id: str, *, idempotency_key: str | None = None) -> Delivery:
        """Send a test event."""
        path = self._path(webhook_id, "test")
        return self._transport.post(path, Delivery, idempotency_key=idempotency_key)

    def deliveries(self, webhook_id: str) -> Iterator[Delivery]:
        """Yield the messages sent, newest first."""
        return self._transport.pages(self._path(webhook_id, "deliveries"), Delivery)
