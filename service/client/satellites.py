"""Satellites and their element sets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from service.client.collection import Changeable
from service.client.transport import said
from service.client.uploads import Source, upload
from service.wire.imports import Imported as Import
from service.wire.satellites import ElementsOut as Elements
from service.wire.satellites import ImportedSatellite
from service.wire.satellites import SatelliteOut as Satellite


class Satellites(Changeable[Satellite]):
    """The stored satellites. Scenarios keep their copy of a deleted one."""

    _name, _shape = "satellites", Satellite

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
        """Store a satellite, its orbit as ``tle`` (two lines), ``omm`` (keywords) or ``oem`` lines.

        Figures that are not given come from the type ``spacecraft``: an id, or the name of a
        built-in type (``generic_optical`` by default).
        """
        figures = said(agility=agility, sensor=sensor, resources=resources, spacecraft=spacecraft)
        return self._create({"name": name, **_orbit(tle, omm, oem), **figures}, idempotency_key)

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

        A record with a known catalogue number is added to that satellite, so importing the
        same file again changes nothing.

        Parameters
        ----------
        source, form
            The file, or its content and form.
        reject_all
            Whether one bad record rejects the whole file.
        spacecraft
            Type of new satellites, ``generic_optical`` by default.
        """
        return self._transport.post(
            self._path("import"),
            Import[ImportedSatellite],
            params={
                "on_error": "reject_all" if reject_all else "skip",
                "spacecraft": spacecraft,
            },
            idempotency_key=idempotency_key,
            **upload(source, form),
        )

    def list(self, *, norad_cat_id: int | None = None) -> Iterator[Satellite]:
        """Yield the satellites, newest first."""
        return self._listed(norad_cat_id=norad_cat_id)

    def elements(self, satellite_id: str) -> Iterator[Elements]:
        """Yield all element sets of a satellite, most recently stored first."""
        return self._transport.pages(self._path(satellite_id, "elements"), Elements)

    def put_elements(
        self,
        satellite_id: str,
        *,
        tle: Sequence[str] | None = None,
        omm: Mapping[str, Any] | None = None,
        oem: Sequence[str] | None = None,
        if_match: str | None = None,
    ) -> Satellite:
        """Store another orbit; if ``if_match`` is given, only in the state that it names."""
        path, body = self._path(satellite_id, "elements"), _orbit(tle, omm, oem)
        return self._transport.change("PUT", path, Satellite, body, if_match=if_match)


def _orbit(
    tle: Sequence[str] | None, omm: Mapping[str, Any] | None, oem: Sequence[str] | None
) -> dict[str, Any]:
    return said(tle=tle and list(tle), omm=omm, oem=oem and list(oem))
