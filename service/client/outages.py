"""Outages of satellites and ground stations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime

from service.client.collection import Collection
from service.client.transport import said
from service.wire.pins import OutageOut as Outage


class Outages(Collection[Outage]):
    """The stored outages: scenarios whose horizon they touch take a copy, and keep it."""

    _name, _shape = "outages", Outage

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
        """Report that a satellite or a station is unavailable from ``start`` to ``end``."""
        body = said(
            satellite_id=satellite_id, station_id=station_id, modes=list(modes),
            start=start, end=end, reason=reason,
        )  # fmt: skip
        return self._create(body, idempotency_key)

    def list(
        self,
        *,
        satellite_id: str | None = None,
        station_id: str | None = None,
        from_: datetime | None = None,
        to: datetime | None = None,
    ) -> Iterator[Outage]:
        """Yield the outages that overlap a time span, newest first."""
        span = {"from": from_, "to": to}
        return self._listed(satellite_id=satellite_id, station_id=station_id, **span)
