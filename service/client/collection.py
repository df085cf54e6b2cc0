"""What can be done with the things of every kind, wherever they are stored."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Generic, TypeVar

from service.client.transport import Transport, path_of
from service.wire.base import Wire

M = TypeVar("M", bound=Wire)


class Collection(Generic[M]):
    """The things of one kind, each by its id.

    A subclass says with ``_name`` where in the API they are, and with ``_shape`` what one is.
    """

    _name: str
    _shape: type[M]

    def __init__(self, transport: Transport):
        self._transport = transport

    def get(self, own_id: str, /) -> M:
        """Return one as it stands."""
        return self._transport.get(self._path(own_id), self._shape)

    def list(self) -> Iterator[M]:
        """Yield all, newest first."""
        return self._listed()

    def delete(self, own_id: str, /, *, if_match: str | None = None) -> None:
        """Delete one; where ``if_match`` is given, only if it is still as that says."""
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
    """Things that can be changed in part."""

    def change(self, own_id: str, /, *, if_match: str | None = None, **changes: Any) -> M:
        """Change what is given, where the thing is still as ``if_match`` says."""
        return self._transport.change(
            "PATCH", self._path(own_id), self._shape, changes, if_match=if_match
        )
