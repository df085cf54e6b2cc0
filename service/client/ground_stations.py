"""Ground stations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from service.client.transport import Transport, held, path_of
from service.client.uploads import Source, upload
from service.wire.imports import Imported as Import
from service.wire.places import GroundStationOut as GroundStation
from service.wire.places import ImportedStation


class GroundStations:
    """The ground stations that are stored."""

    def __init__(self, transport: Transport):
        self._transport = transport

    def create(
        self,
        name: str,
        lat_deg: float,
        lon_deg: float,
        *,
        idempotency_key: str | None = None,
        **optional: Any,
    ) -> GroundStation:
        """Store a station; ``min_elevation_deg``, ``antennas`` and the like are optional."""
        return self._transport.post(
            path_of("ground-stations"),
            GroundStation,
            json={"name": name, "lat_deg": lat_deg, "lon_deg": lon_deg, **optional},
            idempotency_key=idempotency_key,
        )

    def import_stations(
        self,
        source: Source,
        form: str | None = None,
        *,
        reject_all: bool = False,
        idempotency_key: str | None = None,
    ) -> Import[ImportedStation]:
        """Store the stations of a file, ``csv`` or ``geojson``; those that are known stay one."""
        content, headers = upload(source, form)
        return self._transport.post(
            path_of("ground-stations", "import"),
            Import[ImportedStation],
            params={"on_error": "reject_all" if reject_all else "skip"},
            content=content,
            headers=headers,
            idempotency_key=idempotency_key,
        )

    def list(self) -> Iterator[GroundStation]:
        """Yield the stations, newest first."""
        return self._transport.pages(path_of("ground-stations"), GroundStation)

    def get(self, station_id: str) -> GroundStation:
        """Return one station."""
        return self._transport.get(path_of("ground-stations", station_id), GroundStation)

    def change(
        self, station_id: str, *, if_match: str | None = None, **changes: Any
    ) -> GroundStation:
        """Change what is given, where the station is still as ``if_match`` says."""
        headers = {} if if_match is None else {"If-Match": if_match}
        path = path_of("ground-stations", station_id)
        answer = self._transport.request("PATCH", path, json=changes, headers=headers)
        return held(GroundStation, answer)

    def delete(self, station_id: str, *, if_match: str | None = None) -> None:
        """Delete a station; scenarios keep their copy."""
        self._transport.delete(path_of("ground-stations", station_id), if_match=if_match)
