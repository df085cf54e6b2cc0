"""Operations common to all kinds of resources."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Generic, TypeVar

from service.client.transport import Transport, path_of
from service.wire.base import Wire

M = TypeVar("M", bound=Wire)


class Collection(Generic[M]):
    """The resources of one kind, addressed by id.

    A subclass gives their path in the API as ``_name`` and their model as ``_shape``.
    """

    _name: str
    _shape: type[M]

    def __init__(self, transport: Transport):
        self._transport = transport

    def get(self, own_id: str, /) -> M:
        """Return one in its current state."""
        return self._transport.get(self._path(own_id), self._shape)

    def list(self) -> Iterator[M]:
        """Yield all, newest first."""
        return self._listed()

    def delete(self, own_id: str, /, *, if_match: str | None = None) -> None:
        """Delete one; if ``if_match`` is given, only in the state that it names."""
        self._transport.delete(self._path(own_id), if_match=if_match)

    def _path(self, *parts: str) -> str:
        return path_of(self._name, *parts)

    def _listed(self, **wanted: Any) -> Iterator[M]:
        return self._transport.pages(self._path(), self._shape, wanted)

    def _create(self, body: Any, idempotency_key: str | None) -> M:
        return self._transport.post(
            self._path(), self._shape, json=body, idempotency_key=idempotency_key
        )


class Changeable(Collection[M]):
    """Resources that can be changed in part."""

    def change(self, own_id: str, /, *, if_match: str | None = None, **changes: Any) -> M:
        """Change the given fields; if ``if_match`` is given, only in the state that it names."""
        return self._transport.change(
            "PATCH", self._path(own_id), self._shape, changes, if_match=if_match
        )
