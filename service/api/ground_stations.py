"""Ground stations: one, and many at once from GeoJSON or CSV."""

from __future__ import annotations

from collections import Counter
from typing import Final, Literal

from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from planner_core.errors import Fault
from service.api.conditional import located, matched, readable, unless_known
from service.api.deps import CallDep, RawBodyDep, file_type
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.imports import OnError, OnErrorQuery, body_schemas, imported, refuse_if_asked
from service.api.paging import NameQuery, PagingDep, by_name, newest_first, size_of
from service.db.rows import GroundStationRow
from service.files.records import Checked, check, read_csv, read_geojson
from service.problems.faults import validated
from service.scenarios.translate import ground_station_from
from service.stores.finding import alive, existing
from service.wire.base import Listed
from service.wire.imports import Imported
from service.wire.sites import (
    GroundStationIn,
    GroundStationOut,
    GroundStationPatch,
    ImportedStation,
)
from service.wire.stored import from_row, from_store

router = APIRouter(prefix="/v1/ground-stations", tags=["ground stations"])

_Status = Literal["created", "updated", "unchanged"]

_CSV_COLUMNS = tuple(n for n in GroundStationIn.model_fields if n != "elevation_mask")
_REQUIRED = ("name", "lat_deg", "lon_deg")
_ACTIONS: Final[dict[_Status, str]] = {"created": "create", "updated": "update"}
_MOST_STATIONS = 10_000
_IMPORT_TYPES = ("application/geo+json", "application/json", "text/csv")


@router.post("", status_code=201)
def create_ground_station(body: GroundStationIn, once: OnceDep) -> GroundStationOut:
    """Store one ground station."""
    ground_station_from(body, "new")
    with once.transaction() as session:
        row = _add(session, body)
        return once.created(session, "ground_station", row.id, _shown(row))


@router.post(
    "/import",
    openapi_extra=body_schemas(
        {
            "application/geo+json": "A FeatureCollection of points, each with a `name`.",
            "text/csv": f"A header with some of {', '.join(_CSV_COLUMNS)}.",
        }
    ),
    responses=problem_responses(413, 415),
)
def import_ground_stations(
    call: CallDep, data: RawBodyDep, once: OnceDep, on_error: OnErrorQuery = OnError.SKIP
) -> Imported[ImportedStation]:
    """Store the stations of a file. A station whose name is stored gets the figures of the file.

    If several stations share a name, none is updated: those with new figures are created.

    CSV: `lat`, `latitude`, `lon`, `lng` and `longitude` are accepted as well. GeoJSON: properties
    that are no fields of a station are ignored.
    """
    kind = file_type(call.request, data, *_IMPORT_TYPES)
    good, faults = read_stations(kind, data)
    refuse_if_asked(len(good), faults, on_error)
    with once.transaction() as session:
        call.count_stored(session, num_rows=len(good), num_bytes=len(data))
        items = _store(session, good)
        for status, action in _ACTIONS.items():
            changed = [item.id for item in items if item.status == status]
            call.audit.record(session, action, "ground_station", *changed)
        return once.keep(session, imported(items, faults))


def read_stations(kind: str, data: bytes) -> tuple[list[Checked[GroundStationIn]], list[Fault]]:
    """Return the stations of a file of this media type, and what is wrong with the others."""
    found = (
        read_csv(data, _CSV_COLUMNS, _REQUIRED, most=_MOST_STATIONS)
        if kind == "text/csv"
        else read_geojson(data, GroundStationIn.model_fields, most=_MOST_STATIONS)
    )
    good, faults = check(
        found.records, GroundStationIn, lambda body: ground_station_from(body, "new")
    )
    return good, [*found.faults, *faults]


@router.get("")
def list_ground_stations(
    call: CallDep, paging: PagingDep, name: NameQuery = None
) -> Listed[GroundStationOut]:
    """List the ground stations, newest first."""
    own_name = GroundStationRow.body["name"].as_string()
    query = by_name(alive(GroundStationRow), own_name, name)
    with call.database.reading() as session:
        weight = size_of(GroundStationRow.body)
        return newest_first(session, query, GroundStationRow.id, paging, weight).listed(_shown)


@router.get("/{station_id}", response_model=GroundStationOut, responses=readable())
def get_ground_station(station_id: str, call: CallDep) -> GroundStationOut | Response:
    """Return one ground station."""
    with call.database.reading() as session:
        return unless_known(call, _shown(_find(session, station_id)))


@router.patch("/{station_id}", responses=problem_responses(404, 412))
def change_ground_station(
    station_id: str, body: GroundStationPatch, call: CallDep
) -> GroundStationOut:
    """Change a ground station. Scenarios that use it keep their copy.

    `If-Match` takes the ETag of the station.
    """
    with call.database.transaction() as session:
        row = matched(call, _find(session, station_id, to_change=True), _shown)
        changes = body.model_dump(mode="json", exclude_none=True)
        whole = row.body | changes
        changed = validated(GroundStationIn, whole)  # a stored value may be out of today's range
        ground_station_from(changed, station_id)
        if _change(row, changed):
            call.audit.record(session, "update", "ground_station", station_id)
        shown = _shown(row)
    return located(call, shown, f"/v1/ground-stations/{station_id}")


@router.delete("/{station_id}", status_code=204, responses=problem_responses(404, 412))
def delete_ground_station(station_id: str, call: CallDep) -> None:
    """Delete a ground station. Scenarios that use it keep their copy."""
    with call.noted("delete", "ground_station", station_id) as session:
        row = matched(call, _find(session, station_id, to_change=True), _shown)
        row.delete()


def _find(session: Session, station_id: str, *, to_change: bool = False) -> GroundStationRow:
    return existing(session, GroundStationRow, "ground station", station_id, to_change=to_change)


def _add(session: Session, body: GroundStationIn) -> GroundStationRow:
    row = GroundStationRow(name=body.name, body=body.model_dump(mode="json"))
    session.add(row)
    return row


def _store(session: Session, good: list[Checked[GroundStationIn]]) -> list[ImportedStation]:
    stored = session.scalars(alive(GroundStationRow)).all()
    known = {from_store(GroundStationIn, row.body).model_dump_json(): row for row in stored}
    # A name that is stored twice, or occurs twice in the file, does not identify a station.
    of_file = Counter(one.body.name for one in good)
    of_store = Counter(row.name for row in stored)
    by_name = {row.name: row for row in stored if of_store[row.name] == 1 == of_file[row.name]}
    items = []
    for one in good:
        key = one.body.model_dump_json()
        status: _Status = "unchanged"
        if key not in known:
            row = by_name.get(one.body.name)
            status = "created" if row is None else "updated"
            known[key] = row or _add(session, one.body)
            _change(known[key], one.body)
        row = known[key]
        items.append(ImportedStation(id=row.id, name=row.name, row=one.record.row, status=status))
    return items


def _change(row: GroundStationRow, body: GroundStationIn) -> bool:
    """Give a station these figures; return whether that changed anything."""
    dumped = body.model_dump(mode="json")
    is_other = dumped != row.body
    row.name, row.body = body.name, dumped
    return is_other


def _shown(row: GroundStationRow) -> GroundStationOut:
    return from_row(GroundStationOut, row, **row.body)
