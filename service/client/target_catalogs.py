"""Catalogues of targets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from service.client.transport import Transport, held, path_of
from service.client.uploads import Source, upload
from service.wire.places import CreatedCatalog
from service.wire.places import TargetCatalogOut as TargetCatalog
from service.wire.places import TargetIn as Target


class TargetCatalogs:
    """The target catalogues that are stored."""

    def __init__(self, transport: Transport):
        self._transport = transport

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
            Of the catalogue; a GeoJSON or JSON file that has one of its own keeps it.
        targets, form
            Targets as mappings, each with ``id``, ``lat_deg``, ``lon_deg``; or a file, or its
            content and form: ``csv``, ``geojson`` or ``json``.
        """
        path = path_of("target-catalogs")
        if isinstance(targets, Source):
            content, headers = upload(targets, form)
            return self._transport.post(
                path,
                CreatedCatalog,
                params={"name": name},
                content=content,
                headers=headers,
                idempotency_key=idempotency_key,
            )
        body = {"name": name, "targets": [dict(target) for target in targets]}
        return self._transport.post(
            path, CreatedCatalog, json=body, idempotency_key=idempotency_key
        )

    def list(self) -> Iterator[TargetCatalog]:
        """Yield the catalogues, newest first."""
        return self._transport.pages(path_of("target-catalogs"), TargetCatalog)

    def get(self, catalog_id: str) -> TargetCatalog:
        """Return one catalogue, without its targets."""
        return self._transport.get(path_of("target-catalogs", catalog_id), TargetCatalog)

    def targets(self, catalog_id: str) -> Iterator[Target]:
        """Yield the targets of a catalogue, in the order of its file."""
        path = path_of("target-catalogs", catalog_id, "targets")
        return self._transport.pages(path, Target, {"limit": 500})

    def change(
        self, catalog_id: str, *, if_match: str | None = None, **changes: Any
    ) -> TargetCatalog:
        """Change its ``name``, or by target the ``rewards`` that images earn from now on."""
        headers = {} if if_match is None else {"If-Match": if_match}
        path = path_of("target-catalogs", catalog_id)
        answer = self._transport.request("PATCH", path, json=changes, headers=headers)
        return held(TargetCatalog, answer)

    def delete(self, catalog_id: str, *, if_match: str | None = None) -> None:
        """Delete a catalogue; scenarios keep their copy."""
        self._transport.delete(path_of("target-catalogs", catalog_id), if_match=if_match)
