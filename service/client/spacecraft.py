"""Spacecraft types."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from service.client.transport import Transport, held, path_of
from service.wire.spacecraft import SpacecraftOut as SpacecraftType


class SpacecraftTypes:
    """The types that satellites may be made from, built in or one's own."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def create(
        self,
        name: str,
        *,
        agility: Mapping[str, Any] | None = None,
        sensor: Mapping[str, Any] | None = None,
        resources: str | Mapping[str, Any] | None = None,
        idempotency_key: str | None = None,
    ) -> SpacecraftType:
        """Store a type; what is left out is that of ``generic_optical``."""
        figures = {"agility": agility, "sensor": sensor, "resources": resources}
        body = {"name": name} | {k: v for k, v in figures.items() if v is not None}
        return self._transport.post(
            path_of("spacecraft"), SpacecraftType, json=body, idempotency_key=idempotency_key
        )

    def list(self) -> Iterator[SpacecraftType]:
        """Yield the types: one's own, newest first, then those that are built in."""
        return self._transport.pages(path_of("spacecraft"), SpacecraftType)

    def get(self, spacecraft_id: str) -> SpacecraftType:
        """Return one type, by its id or the name of one that is built in."""
        return self._transport.get(path_of("spacecraft", spacecraft_id), SpacecraftType)

    def change(
        self, spacecraft_id: str, *, if_match: str | None = None, **changes: Any
    ) -> SpacecraftType:
        """Change what is given, where the type is still as ``if_match`` says."""
        headers = {} if if_match is None else {"If-Match": if_match}
        path = path_of("spacecraft", spacecraft_id)
        answer = self._transport.request("PATCH", path, json=changes, headers=headers)
        return held(SpacecraftType, answer)

    def delete(self, spacecraft_id: str, *, if_match: str | None = None) -> None:
        """Delete a type of one's own; satellites made from it stay as they are."""
        self._transport.delete(path_of("spacecraft", spacecraft_id), if_match=if_match)
