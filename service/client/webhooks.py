"""Webhooks: where the service tells the ends of jobs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from service.client.transport import Transport, path_of
from service.wire.webhooks import DeliveryOut as Delivery
from service.wire.webhooks import WebhookOut


class Webhook(WebhookOut):
    """A webhook. Only a new one has its ``secret``, which signs what it sends."""

    secret: str | None = None


class Webhooks:
    """The webhooks of the key's owner."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def create(
        self,
        url: str,
        *,
        events: Sequence[str] | None = None,
        name: str | None = None,
        idempotency_key: str | None = None,
    ) -> Webhook:
        """Have the ends of jobs told to an address; by default all of them."""
        optional: dict[str, Any] = {"events": None if events is None else list(events)}
        optional |= {"name": name}
        body = {"url": url} | {k: v for k, v in optional.items() if v is not None}
        return self._transport.post(
            path_of("webhooks"), Webhook, json=body, idempotency_key=idempotency_key
        )

    def list(self) -> Iterator[Webhook]:
        """Yield the webhooks, newest first."""
        return self._transport.pages(path_of("webhooks"), Webhook)

    def get(self, webhook_id: str) -> Webhook:
        """Return one webhook."""
        return self._transport.get(path_of("webhooks", webhook_id), Webhook)

    def delete(self, webhook_id: str, *, if_match: str | None = None) -> None:
        """Delete a webhook: nothing more is sent there."""
        self._transport.delete(path_of("webhooks", webhook_id), if_match=if_match)

    def test(self, webhook_id: str, *, idempotency_key: str | None = None) -> Delivery:
        """Have a test event sent."""
        return self._transport.post(
            path_of("webhooks", webhook_id, "test"), Delivery, idempotency_key=idempotency_key
        )

    def deliveries(self, webhook_id: str) -> Iterator[Delivery]:
        """Yield what was sent, newest first."""
        return self._transport.pages(path_of("webhooks", webhook_id, "deliveries"), Delivery)
