"""Satellites and their element sets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from service.client.transport import Transport, held, path_of
from service.client.uploads import Source, upload
from service.wire.imports import Imported as Import
from service.wire.satellites import ElementsOut as Elements
from service.wire.satellites import ImportedSatellite
from service.wire.satellites import SatelliteOut as Satellite


class Satellites:
    """The satellites that are stored."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def create(
        self,
        name: str,
        *,
        tle: Sequence[str] | None = None,
        omm: Mapping[str, Any] | None = None,
        oem: Sequence[str] | None = None,
        agility: Mapping[str, Any] | None = None,
        sensor: Mapping[str, Any] | None = None,
        resources: str | Mapping[str, Any] | None = None,
        spacecraft: str | None = None,
        idempotency_key: str | None = None,
    ) -> Satellite:
        """Store a satellite; its orbit is ``tle``, two lines, ``omm``, keywords, or ``oem``, lines.

        It is of the type ``spacecraft``, an id or the name of one that is built in
        (``generic_optical`` by default), but for the figures given.
        """
        optional = {
            "tle": None if tle is None else list(tle),
            "omm": omm,
            "oem": None if oem is None else list(oem),
            "agility": agility,
            "sensor": sensor,
            "resources": resources,
            "spacecraft": spacecraft,
        }
        body = {"name": name} | {k: v for k, v in optional.items() if v is not None}
        return self._transport.post(
            path_of("satellites"), Satellite, json=body, idempotency_key=idempotency_key
        )

    def import_elements(
        self,
        source: Source,
        form: str | None = None,
        *,
        reject_all: bool = False,
        spacecraft: str | None = None,
        idempotency_key: str | None = None,
    ) -> Import[ImportedSatellite]:
        """Store the orbits of a file: ``tle``, ``kvn``, ``json``, ``csv`` or ``xml``.

        Records whose catalogue number is known join that satellite, so that importing the
        same file again changes nothing.

        Parameters
        ----------
        source, form
            The file, or its content and form.
        reject_all
            Whether one bad record refuses the file.
        spacecraft
            Type of the new satellites, ``generic_optical`` by default.
        """
        content, headers = upload(source, form)
        return self._transport.post(
            path_of("satellites", "import"),
            Import[ImportedSatellite],
            params={"on_error": "reject_all" if reject_all else "skip"}
            | ({} if spacecraft is None else {"spacecraft": spacecraft}),
            content=content,
            headers=headers,
            idempotency_key=idempotency_key,
        )

    def list(self, *, norad_cat_id: int | None = None) -> Iterator[Satellite]:
        """Yield the satellites, newest first."""
        params = {"norad_cat_id": norad_cat_id}
        return self._transport.pages(path_of("satellites"), Satellite, params)

    def get(self, satellite_id: str) -> Satellite:
        """Return one satellite."""
        return self._transport.get(path_of("satellites", satellite_id), Satellite)

    def elements(self, satellite_id: str) -> Iterator[Elements]:
        """Yield all element sets of a satellite, the last stored first."""
        return self._transport.pages(path_of("satellites", satellite_id, "elements"), Elements)

    def put_elements(
        self,
        satellite_id: str,
        *,
        tle: Sequence[str] | None = None,
        omm: Mapping[str, Any] | None = None,
        oem: Sequence[str] | None = None,
        if_match: str | None = None,
    ) -> Satellite:
        """Store a further orbit, where the satellite is still as ``if_match`` says."""
        forms = {"tle": tle, "omm": omm, "oem": oem}
        body = {form: value for form, value in forms.items() if value is not None}
        headers = {} if if_match is None else {"If-Match": if_match}
        path = path_of("satellites", satellite_id, "elements")
        answer = self._transport.request("PUT", path, json=body, headers=headers)
        return held(Satellite, answer)

    def change(
        self, satellite_id: str, *, if_match: str | None = None, **changes: Any
    ) -> Satellite:
        """Change what is given, where the satellite is still as ``if_match`` says."""
        headers = {} if if_match is None else {"If-Match": if_match}
        path = path_of("satellites", satellite_id)
        answer = self._transport.request("PATCH", path, json=changes, headers=headers)
        return held(Satellite, answer)

    def delete(self, satellite_id: str, *, if_match: str | None = None) -> None:
        """Delete a satellite; scenarios keep their copy."""
        self._transport.delete(path_of("satellites", satellite_id), if_match=if_match)
