"""Satellites: one, many at once, and their element sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, Any, Final, TypeVar

import sqlalchemy as sa
from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from planner_core.orbits.ingest import read_elements
from planner_core.orbits.oem import outline_of
from service.api.conditional import etagged, located, matched, readable, require_match, unless_known
from service.api.deps import CallDep, RawBodyDep, file_type
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.imports import OnError, OnErrorQuery, body_schemas, imported, refuse_if_asked
from service.api.paging import NameQuery, PagingDep, by_name, newest_first
from service.db.rows import ElementSetRow, SatelliteRow
from service.problems.faults import refuse_one
from service.scenarios.translate import orbit_from, satellite_from
from service.stores import satellite_store as store
from service.stores import spacecraft_store
from service.stores.finding import alive, existing
from service.wire.base import Json, Listed
from service.wire.imports import Imported
from service.wire.satellites import (
    AgilityIn,
    ElementsOut,
    ImportedSatellite,
    OrbitIn,
    RecordWarning,
    SatelliteIn,
    SatelliteOut,
    SatellitePatch,
    SensorIn,
    TypedFigures,
    WholeSatellite,
    sent_by,
)
from service.wire.spacecraft_types import DEFAULT
from service.wire.stored import from_row

router = APIRouter(prefix="/v1/satellites", tags=["satellites"])

P = TypeVar("P", AgilityIn, SensorIn)

_ACTIONS: Final[dict[store.Status, str]] = {"created": "create", "elements_added": "add_elements"}
_IMPORT_TYPES = ("text/plain", "application/json", "text/csv", "application/xml", "text/xml")


@router.post("", status_code=201, responses=problem_responses(409))
def create_satellite(body: SatelliteIn, once: OnceDep) -> SatelliteOut:
    """Store one satellite.

    Each catalogue number belongs to one satellite: 409 `duplicate_norad_cat_id` names it. Number 0
    means that it is unknown; any number of satellites may have it.
    """
    orbit = orbit_from(body)
    with once.transaction() as session:
        whole = spacecraft_store.completed(session, sent_by(body), WholeSatellite)
        satellite_from(whole, "new")
        row = store.add_satellite(session, whole, orbit.elements, orbit.stored)
        return once.created(session, "satellite", row.id, _shown(session, [row])[0])


@router.post(
    "/import",
    openapi_extra=body_schemas(
        {
            "text/plain": "TLE, 2LE or 3LE; or OMM or OEM in the keyword form (KVN).",
            "application/json": "One OMM; or a list of them, as CelesTrak serves it.",
            "text/csv": "OMM keywords in the header, one element set a line.",
            "application/xml": "An omm or oem document, or an ndm with many of one kind.",
        }
    ),
    responses=problem_responses(413, 415),
)
def import_satellites(
    call: CallDep,
    data: RawBodyDep,
    once: OnceDep,
    on_error: OnErrorQuery = OnError.SKIP,
    spacecraft: Annotated[
        str, Query(description="Spacecraft type of new satellites: an id or a built-in name.")
    ] = DEFAULT,
) -> Imported[ImportedSatellite]:
    """Store the element sets or ephemerides of a file; new satellites are of one spacecraft type.

    Importing the same file again changes nothing: a record whose catalogue number is stored
    is added to that satellite if its epoch is new. If a file has two records of one satellite and
    epoch, the second is only reported. An ephemeris (OEM) has no catalogue number: it is added to
    the satellite with its object's name, if there is one.
    """
    found = read_elements(data, file_type(call.request, data, *_IMPORT_TYPES))
    refuse_if_asked(len(found.entries), found.faults, on_error)
    with once.transaction() as session:
        call.count_stored(session, num_rows=len(found.entries), num_bytes=len(data))
        figures = _figures_of(session, spacecraft)
        items = [_imported(one) for one in store.import_entries(session, found.entries, figures)]
        for status, action in _ACTIONS.items():
            changed = [item.id for item in items if item.status == status]
            call.audit.record(session, action, "satellite", *changed)
        return once.keep(session, imported(items, found.faults))


@router.get("")
def list_satellites(
    call: CallDep,
    paging: PagingDep,
    norad_cat_id: Annotated[
        int | None, Query(ge=0, le=999_999_999, description="Only this number.")
    ] = None,
    name: NameQuery = None,
) -> Listed[SatelliteOut]:
    """List the satellites, newest first."""
    query = by_name(alive(SatelliteRow), SatelliteRow.name, name)
    if norad_cat_id is not None:
        query = query.where(SatelliteRow.norad_cat_id == norad_cat_id)
    with call.database.reading() as session:
        page = newest_first(session, query, SatelliteRow.id, paging)
        return Listed(items=_shown(session, page.rows), next=page.next)


@router.get("/{satellite_id}", response_model=SatelliteOut, responses=readable())
def get_satellite(satellite_id: str, call: CallDep) -> SatelliteOut | Response:
    """Return one satellite with the element set in force."""
    with call.database.reading() as session:
        return unless_known(call, _shown(session, [find_satellite(session, satellite_id)])[0])


@router.patch("/{satellite_id}", responses=problem_responses(404, 412))
def change_satellite(satellite_id: str, body: SatellitePatch, call: CallDep) -> SatelliteOut:
    """Change a satellite's name or settings. Existing scenarios do not change.

    `If-Match` takes the ETag of the satellite. Elements are added by a call of their own.
    """
    with call.database.transaction() as session:
        row = find_satellite(session, satellite_id, to_change=True)
        before = _shown(session, [row])[0]
        require_match(call, etagged(before))
        changed = _changed(session, before, body)
        satellite_from(changed, satellite_id)
        changes = changed.model_dump(mode="json", include=set(SatellitePatch.model_fields))
        for name, value in changes.items():
            setattr(row, name, value)
        shown = _shown(session, [row])[0]
        if shown != before:
            call.audit.record(session, "update", "satellite", satellite_id)
    return located(call, shown, f"/v1/satellites/{satellite_id}")


@router.delete("/{satellite_id}", status_code=204, responses=problem_responses(404, 412))
def delete_satellite(satellite_id: str, call: CallDep) -> None:
    """Delete a satellite. Scenarios that use it keep their copy."""
    with call.noted("delete", "satellite", satellite_id) as session:
        row = find_satellite(session, satellite_id, to_change=True)
        matched(call, row, lambda row: _shown(session, [row])[0])
        row.delete()


@router.put("/{satellite_id}/elements", responses=problem_responses(404, 412))
def put_elements(satellite_id: str, body: OrbitIn, call: CallDep) -> SatelliteOut:
    """Store a further element set of the satellite; the one of the newest epoch is in force.

    Older ones stay readable. Existing scenarios do not change. `If-Match` takes the ETag of the
    satellite.
    """
    orbit = orbit_from(body)
    with call.noted("add_elements", "satellite", satellite_id) as session:
        row = find_satellite(session, satellite_id, to_change=True)
        matched(call, row, lambda row: _shown(session, [row])[0])
        _require_same_object(row, orbit.elements.norad_cat_id, body)
        store.add_elements(session, row.id, orbit.elements.epoch, orbit.stored)
        shown = _shown(session, [row])[0]
    return located(call, shown, f"/v1/satellites/{row.id}/elements")


@router.get("/{satellite_id}/elements", responses=problem_responses(404))
def list_elements(satellite_id: str, call: CallDep, paging: PagingDep) -> Listed[ElementsOut]:
    """List all element sets of a satellite, the last stored first."""
    query = sa.select(ElementSetRow).where(ElementSetRow.satellite_id == satellite_id)
    with call.database.reading() as session:
        find_satellite(session, satellite_id)
        page = newest_first(session, query, ElementSetRow.id, paging)
        return page.listed(lambda row: from_row(ElementsOut, row, **_told(row.orbit)))


def find_satellite(session: Session, satellite_id: str, *, to_change: bool = False) -> SatelliteRow:
    """Return a satellite, its row locked if it is to change; 404 if there is none."""
    return existing(session, SatelliteRow, "satellite", satellite_id, to_change=to_change)


def _figures_of(session: Session, spacecraft_id: str) -> dict[str, Any]:
    """Return all figures of a type, as satellites of it are stored."""
    whole = spacecraft_store.completed(session, {"spacecraft": spacecraft_id}, TypedFigures)
    return whole.model_dump(mode="json", include=set(store.FIGURES))


def _changed(session: Session, before: SatelliteOut, body: SatellitePatch) -> WholeSatellite:
    base: SatelliteOut | TypedFigures = before
    if body.spacecraft is not None:
        base = TypedFigures(**_figures_of(session, body.spacecraft))
    return WholeSatellite(
        name=body.name or before.name,
        **store.in_force(session, [before.id])[before.id].orbit,
        spacecraft=base.spacecraft,
        agility=_merged(base.agility, body.agility),
        sensor=_merged(base.sensor, body.sensor),
        resources=base.resources if body.resources is None else body.resources,
    )


def _merged(before: P, changes: P | None) -> P:
    """Return settings updated by those that a client has sent."""
    sent = {} if changes is None else changes.model_dump(exclude_unset=True)
    return before.model_copy(update=sent)


def _require_same_object(row: SatelliteRow, norad_cat_id: int, body: OrbitIn) -> None:
    # An ephemeris has no catalogue number.
    if norad_cat_id == row.norad_cat_id or body.oem is not None:
        return
    detail = f"The elements are for {norad_cat_id}, but the satellite is {row.norad_cat_id}."
    pointer = "/tle" if body.tle is not None else "/omm/NORAD_CAT_ID"
    raise refuse_one("different_satellite", detail, pointer)


def _shown(session: Session, rows: Sequence[SatelliteRow]) -> list[SatelliteOut]:
    elements = store.in_force(session, [row.id for row in rows])
    return [
        from_row(
            SatelliteOut,
            row,
            epoch=elements[row.id].epoch,
            links={"elements": f"/v1/satellites/{row.id}/elements"},
            **_told(elements[row.id].orbit),
        )
        for row in rows
    ]


def _told(orbit: Json) -> Json:
    """Return the orbit as answers show it; an ephemeris, with its many states, is summarised."""
    oem = asdict(outline_of(orbit["oem"])) if "oem" in orbit else None
    return {"tle": orbit.get("tle"), "omm": orbit.get("omm"), "oem": oem}


def _imported(one: store.ImportedEntry) -> ImportedSatellite:
    return from_row(
        ImportedSatellite,
        one.satellite,
        epoch=one.entry.elements.epoch,
        row=one.entry.row,
        status=one.status,
        warnings=[from_row(RecordWarning, warning) for warning in one.entry.warnings],
    )
