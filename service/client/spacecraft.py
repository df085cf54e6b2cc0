"""Spacecraft types."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.client.collection import Changeable
from service.client.transport import said
from service.wire.spacecraft import SpacecraftOut as SpacecraftType


class SpacecraftTypes(Changeable[SpacecraftType]):
    """The types that satellites may be made from: the user's own, then the built-in ones.

    The id of a built-in type is its name. Satellites stay as they are when their type is
    changed or deleted.
    """

    _name, _shape = "spacecraft", SpacecraftType

    def create(
        self,
        name: str,
        *,
        agility: Mapping[str, Any] | None = None,
        sensor: Mapping[str, Any] | None = None,
        resources: str | Mapping[str, Any] | None = None,
        idempotency_key: str | None = None,
    ) -> SpacecraftType:
        """Store a type; ``generic_optical`` supplies what is left out."""
        body = said(name=name, agility=agility, sensor=sensor, resources=resources)
        return self._create(body, idempotency_key)
