"""Catalogues of targets, and the progress of their targets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from service.client.collection import Changeable
from service.client.transport import Transport, path_of
from service.client.uploads import Source, upload
from service.wire.sites import CreatedCatalog
from service.wire.sites import TargetCatalogOut as TargetCatalog
from service.wire.sites import TargetIn as Target
from service.wire.target_lives import TargetLifeOut as TargetLife


class TargetCatalogs(Changeable[TargetCatalog]):
    """The stored target catalogues. Scenarios keep their copy of a deleted one.

    The ``name`` can be changed, and by target the ``rewards`` that images earn from now on.
    """

    _name, _shape = "target-catalogs", TargetCatalog

    def create(
        self,
        name: str,
        targets: Source | Sequence[Mapping[str, Any]],
        form: str | None = None,
        *,
        idempotency_key: str | None = None,
    ) -> CreatedCatalog:
        """Store a catalogue, whole or not at all.

        Parameters
        ----------
        name
            The catalogue's name, unless a GeoJSON or JSON file has one of its own.
        targets, form
            Targets as mappings, each with ``id``, ``lat_deg``, ``lon_deg``; or a file, or its
            content and form: ``csv``, ``geojson`` or ``json``.
        """
        if isinstance(targets, Source):
            sent = {"params": {"name": name}, **upload(targets, form)}
        else:
            sent = {"json": {"name": name, "targets": [dict(target) for target in targets]}}
        return self._transport.post(
            self._path(), CreatedCatalog, idempotency_key=idempotency_key, **sent
        )

    def targets(self, catalog_id: str) -> Iterator[Target]:
        """Yield the targets of a catalogue, in the order of its file."""
        return self._transport.pages(self._path(catalog_id, "targets"), Target, {"limit": 500})


class Targets:
    """The targets of all catalogues, with the progress of each."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def list(
        self, *, state: str | None = None, catalog_id: str | None = None
    ) -> Iterator[TargetLife]:
        """Yield targets: ``open``, ``planned``, ``collected``, ``delivered`` and so on."""
        wanted = {"state": state, "catalog_id": catalog_id}
        return self._transport.pages(path_of("targets"), TargetLife, wanted)
