"""Ground stations."""

from __future__ import annotations

from typing import Any

from service.client.collection import Changeable
from service.client.uploads import Source, upload
from service.wire.imports import Imported as Import
from service.wire.sites import GroundStationOut as GroundStation
from service.wire.sites import ImportedStation


class GroundStations(Changeable[GroundStation]):
    """The stored ground stations. Scenarios keep their copy of a deleted one."""

    _name, _shape = "ground-stations", GroundStation

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
        body = {"name": name, "lat_deg": lat_deg, "lon_deg": lon_deg, **optional}
        return self._create(body, idempotency_key)

    def import_stations(
        self,
        source: Source,
        form: str | None = None,
        *,
        reject_all: bool = False,
        idempotency_key: str | None = None,
    ) -> Import[ImportedStation]:
        """Store the stations of a ``csv`` or ``geojson`` file, without duplicating known ones."""
        return self._transport.post(
            self._path("import"),
            Import[ImportedStation],
            params={"on_error": "reject_all" if reject_all else "skip"},
            idempotency_key=idempotency_key,
            **upload(source, form),
        )
