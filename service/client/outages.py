"""Outages of satellites and ground stations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime

from service.client.transport import Transport, path_of
from service.wire.instants import instant_text
from service.wire.pins import OutageOut as Outage


class Outages:
    """The outages that are stored: scenarios made in their span take them along."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def create(
        self,
        start: datetime,
        end: datetime,
        *,
        satellite_id: str | None = None,
        station_id: str | None = None,
        modes: Sequence[str] = ("collect", "contact"),
        reason: str | None = None,
        idempotency_key: str | None = None,
    ) -> Outage:
        """Report that a satellite or a station is out from ``start`` to ``end``."""
        body = {
            "satellite_id": satellite_id, "station_id": station_id, "modes": list(modes),
            "start": instant_text(start), "end": instant_text(end), "reason": reason,
        }  # fmt: skip
        return self._transport.post(
            path_of("outages"), Outage, json=body, idempotency_key=idempotency_key
        )

    def list(
        self,
        *,
        satellite_id: str | None = None,
        station_id: str | None = None,
        from_: datetime | None = None,
        to: datetime | None = None,
    ) -> Iterator[Outage]:
        """Yield the outages that touch a span, newest first."""
        wanted = {
            "satellite_id": satellite_id,
            "station_id": station_id,
            "from": None if from_ is None else instant_text(from_),
            "to": None if to is None else instant_text(to),
        }
        params = {name: value for name, value in wanted.items() if value is not None}
        return self._transport.pages(path_of("outages"), Outage, params=params)

    def get(self, outage_id: str) -> Outage:
        """Return one outage."""
        return self._transport.get(path_of("outages", outage_id), Outage)

    def delete(self, outage_id: str, *, if_match: str | None = None) -> None:
        """Delete an outage; scenarios that took it along keep it."""
        self._transport.delete(path_of("outages", outage_id), if_match=if_match)
