"""Targets over all plans."""

from __future__ import annotations

from collections.abc import Iterator

from service.client.transport import Transport, path_of
from service.wire.target_lives import TargetLifeOut as TargetLife


class Targets:
    """The targets of all catalogues, with how far each has come."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def list(
        self, *, state: str | None = None, catalog_id: str | None = None
    ) -> Iterator[TargetLife]:
        """Yield targets: ``open``, ``planned``, ``collected``, ``delivered`` and so on."""
        wanted = {"state": state, "catalog_id": catalog_id}
        params = {name: value for name, value in wanted.items() if value is not None}
        return self._transport.pages(path_of("targets"), TargetLife, params=params)
