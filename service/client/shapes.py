"""What the service answers, as frozen types.

They say what a reader needs and ignore what a newer service adds. Words that may be added to,
such as a job's ``state``, are plain strings.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict

T = TypeVar("T")

Json = dict[str, Any]


class Shape(BaseModel):
    """Base of all that is read."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Stored(Shape):
    """Something with an id. ``etag`` names its state, where it was read on its own."""

    id: str
    etag: str | None = None


class Fault(Shape):
    """One thing that is wrong, by JSON pointer or by line of the file."""

    code: str
    detail: str
    pointer: str | None = None
    row: int | None = None


class Import(Shape, Generic[T]):
    """What an import stored, and what it did not."""

    accepted: int
    rejected: int
    items: tuple[T, ...]
    errors: tuple[Fault, ...]


class Satellite(Stored):
    """A satellite with the element set in force: either ``tle`` or ``omm``."""

    name: str
    norad_cat_id: int
    epoch: datetime
    tle: tuple[str, ...] | None
    omm: Json | None
    agility: Json
    sensor: Json
    resources: str | Json
    created_at: datetime


class Elements(Stored):
    """One element set of a satellite."""

    epoch: datetime
    tle: tuple[str, ...] | None
    omm: Json | None
    created_at: datetime


class ImportedSatellite(Shape):
    """The satellite that a record belongs to; ``status`` says what the record changed."""

    id: str
    name: str
    norad_cat_id: int
    epoch: datetime
    row: int | None
    status: str
    warnings: tuple[Fault, ...]


class GroundStation(Stored):
    """A ground station."""

    name: str
    lat_deg: float
    lon_deg: float
    alt_m: float
    min_elevation_deg: float
    min_contact_s: float
    elevation_mask: tuple[tuple[float, float], ...]
    antennas: int
    created_at: datetime


class ImportedStation(Shape):
    """The station that a record belongs to; ``unchanged`` where it was stored before."""

    id: str
    name: str
    row: int | None
    status: str


class TargetCatalog(Stored):
    """A catalogue of targets. ``ignored_columns`` are those of a new one's file."""

    name: str
    num_targets: int
    created_at: datetime
    ignored_columns: tuple[str, ...] = ()


class Target(Shape):
    """A point on the ground to be imaged once; what it narrows of the sensor is in ``extra``."""

    model_config = ConfigDict(extra="allow")

    id: str
    lat_deg: float
    lon_deg: float
    alt_m: float
    reward: float
    collect_s: float
    release: datetime | None = None
    due: datetime | None = None
    sensor_type: str | None = None

    @property
    def extra(self) -> Json:
        """The other fields of the target."""
        return dict(self.model_extra or {})


class Horizon(Shape):
    """The span that is planned."""

    start: datetime
    end: datetime


class Counts(Shape):
    """How much a scenario holds."""

    satellites: int
    targets: int
    ground_stations: int


class Scenario(Stored):
    """A frozen question. ``sha256`` is of its content, the name left out."""

    sha256: str
    name: str | None
    horizon: Horizon
    satellite_ids: tuple[str, ...]
    target_catalog_ids: tuple[str, ...]
    ground_station_ids: tuple[str, ...]
    use_resources: bool
    dynamics: str
    counts: Counts
    warnings: tuple[str, ...]
    created_at: datetime


class Opportunity(Shape):
    """A collect or a contact that a plan may take; angles and range hold at its middle."""

    id: str
    satellite_id: str
    kind: str
    target_id: str | None
    station_id: str | None
    start: datetime
    end: datetime
    access_start: datetime
    access_end: datetime
    off_nadir_deg: float
    elevation_deg: float
    azimuth_deg: float
    sun_elevation_deg: float
    range_km: float
    eclipse: bool


class Solver(Shape):
    """A solver: what it is, and what ``params`` it takes."""

    name: str
    title: str
    paper: str
    kind: str
    honours: tuple[str, ...]
    params_schema: Json


class Version(Shape):
    """What runs there."""

    name: str
    version: str


class Ready(Shape):
    """Jobs are taken and run."""

    workers: int
    last_heartbeat: datetime
