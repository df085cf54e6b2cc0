"""Target catalogues: from JSON, GeoJSON or CSV, stored whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Annotated, Any, Final

import sqlalchemy as sa
from fastapi import APIRouter, Query, Response
from pydantic import Field
from sqlalchemy.orm import Session

from planner_core.errors import Fault
from service.api.conditional import located, matched, readable, unless_known
from service.api.deps import ANY_FILE, CallDep, RawBodyDep, file_type
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.imports import BYTES, request_body
from service.api.paging import NameQuery, PagingDep, by_name, newest_first
from service.db.rows import TargetCatalogRow, TargetRow
from service.files.records import Checked, Record, Records, check, read_csv, read_geojson, read_json
from service.problems.faults import pointer_to, require_none, validated
from service.scenarios.translate import target_from
from service.stores.finding import alive, existing
from service.wire.base import Body, Listed, Name
from service.wire.sites import (
    MAX_TARGETS,
    CreatedCatalog,
    TargetCatalogOut,
    TargetCatalogPatch,
    TargetIn,
)
from service.wire.stored import from_row, from_store

router = APIRouter(prefix="/v1/target-catalogs", tags=["target catalogs"])

_TYPES = ("application/json", "application/geo+json", "text/csv")
_REQUIRED = ("id", "lat_deg", "lon_deg")
_COLUMNS = tuple(TargetIn.model_fields)
_OPTIONAL = tuple(column for column in _COLUMNS if column not in _REQUIRED)
_UNNAMED = "Targets"
_AT_ONCE = 500  # parameters of one statement


class _Listed(Body):
    """A catalogue whose targets are still to be checked one by one."""

    name: Name
    targets: list[dict[str, Any]] = Field(min_length=1, max_length=MAX_TARGETS)


_REQUEST_BODY: Final = request_body(
    {
        "application/json": {"$ref": "#/components/schemas/TargetCatalogIn"},
        "application/geo+json": {
            "type": "object",
            "description": "A FeatureCollection of points (RFC 7946). The id is the feature's or a "
            "property; other fields of a target are properties.",
        },
        ANY_FILE: BYTES,
        "text/csv": {
            "type": "string",
            "description": f"A header with id, lat_deg, lon_deg and any of {', '.join(_OPTIONAL)}; "
            "lat, latitude, lon, lng and longitude are accepted as well, and city for name. An "
            "empty cell means the default.",
        },
    }
)


@router.post(
    "", status_code=201, openapi_extra=_REQUEST_BODY, responses=problem_responses(413, 415)
)
def create_target_catalog(
    call: CallDep,
    data: RawBodyDep,
    once: OnceDep,
    name: Annotated[
        Name | None, Query(description="Name of the catalogue, if its file has none.")
    ] = None,
) -> CreatedCatalog:
    """Store a catalogue. If any row is bad, nothing is stored and every bad row is named."""
    kind = file_type(call.request, data, *_TYPES)
    found, targets = read_targets(kind, data)
    with once.transaction() as session:
        call.count_stored(session, num_rows=len(targets), num_bytes=len(data))
        row = _add(session, found.name or name or _UNNAMED, targets)
        call.audit.record(session, "create", "target_catalog", row.id)
        shown = located(call, _shown(row), f"/v1/target-catalogs/{row.id}")
        answer = CreatedCatalog(**shown.model_dump(), ignored_columns=list(found.ignored))
        return once.keep(session, answer)


def read_targets(kind: str, data: bytes) -> tuple[Records, list[TargetIn]]:
    """Return what a file of this media type holds, and its targets.

    Raises
    ------
    ServiceError
        With every fault of the file, if there is any.
    """
    match kind:
        case "text/csv":
            found = read_csv(data, _COLUMNS, _REQUIRED, most=MAX_TARGETS)
        case "application/geo+json":
            found = read_geojson(data, _COLUMNS, most=MAX_TARGETS)
        case _:
            found = _read_json(data)
    good, faults = check(found.records, TargetIn, target_from)
    faults += [*found.faults, *_faults_of_repeated(good)]
    require_none(sorted(faults, key=lambda fault: fault.row or 0))
    return found, [one.body for one in good]


def _read_json(data: bytes) -> Records:
    body = validated(_Listed, read_json(data))
    records = tuple(
        Record(fields=target, pointer=f"/targets/{position}")
        for position, target in enumerate(body.targets)
    )
    return Records(records=records, name=body.name)


def _faults_of_repeated(good: Sequence[Checked[TargetIn]]) -> list[Fault]:
    """Return a fault for each target whose id an earlier one has."""
    seen: dict[str, Record] = {}
    faults = []
    for one in good:
        own_id = one.body.id
        first = seen.setdefault(own_id, one.record)
        if first is not one.record:
            where = f", as in line {first.row}" if first.row else ""
            detail = f"{own_id!r} appears twice{where}."
            fault = Fault(code="duplicate_target_id", detail=detail, pointer="/id")
            faults.append(one.record.place(fault))
    return faults


def _add(session: Session, name: str, targets: Sequence[TargetIn]) -> TargetCatalogRow:
    row = TargetCatalogRow(name=name, num_targets=len(targets))
    session.add(row)
    session.flush()
    session.execute(
        sa.insert(TargetRow),
        [
            {
                "catalog_id": row.id,
                "position": position,
                "target_id": target.id,
                "body": target.model_dump(mode="json"),
            }
            for position, target in enumerate(targets)
        ],
    )
    return row


@router.get("")
def list_target_catalogs(
    call: CallDep, paging: PagingDep, name: NameQuery = None
) -> Listed[TargetCatalogOut]:
    """List the catalogues, newest first."""
    query = by_name(alive(TargetCatalogRow), TargetCatalogRow.name, name)
    with call.database.reading() as session:
        return newest_first(session, query, TargetCatalogRow.id, paging).listed(_shown)


@router.get("/{catalog_id}", response_model=TargetCatalogOut, responses=readable())
def get_target_catalog(catalog_id: str, call: CallDep) -> TargetCatalogOut | Response:
    """Return one catalogue, without its targets."""
    with call.database.reading() as session:
        return unless_known(call, _shown(_find(session, catalog_id)))


@router.get("/{catalog_id}/targets", responses=problem_responses(404))
def list_targets(catalog_id: str, call: CallDep, paging: PagingDep) -> Listed[TargetIn]:
    """List the targets of a catalogue, in the order of its file."""
    query = (
        sa.select(TargetRow)
        .where(TargetRow.catalog_id == catalog_id, TargetRow.position > paging.after_number())
        .order_by(TargetRow.position)
        .limit(paging.limit + 1)
    )
    with call.database.reading() as session:
        _find(session, catalog_id)
        page = paging.answer(session.scalars(query).all(), lambda row: row.position)
        return page.listed(lambda row: from_store(TargetIn, row.body))


@router.patch("/{catalog_id}", responses=problem_responses(404, 412))
def change_target_catalog(
    catalog_id: str, body: TargetCatalogPatch, call: CallDep
) -> TargetCatalogOut:
    """Change the name of a catalogue, or the rewards of its targets.

    Scenarios that use it keep their copy. `If-Match` takes the ETag of the catalogue.
    """
    with call.noted("update", "target_catalog", catalog_id) as session:
        row = matched(call, _find(session, catalog_id, to_change=True), _shown)
        row.name = body.name or row.name
        _set_rewards(session, catalog_id, body.rewards or {})
        row.changed_at = datetime.now(UTC)
        shown = _shown(row)
    return located(call, shown, f"/v1/target-catalogs/{catalog_id}")


def _set_rewards(session: Session, catalog_id: str, rewards: Mapping[str, float]) -> None:
    """Give targets new rewards; all of them or none."""
    of_catalog = sa.select(TargetRow).where(TargetRow.catalog_id == catalog_id)
    ids, found = list(rewards), dict[str, TargetRow]()
    for first in range(0, len(ids), _AT_ONCE):
        wanted = TargetRow.target_id.in_(ids[first : first + _AT_ONCE])
        found |= {row.target_id: row for row in session.scalars(of_catalog.where(wanted))}
    require_none(
        [
            Fault(
                code="unknown_target",
                detail=f"The catalogue has no target {own_id!r}.",
                pointer=pointer_to("rewards", own_id),
            )
            for own_id in rewards
            if own_id not in found
        ]
    )
    for own_id, reward in rewards.items():
        found[own_id].body = found[own_id].body | {"reward": reward}


@router.delete("/{catalog_id}", status_code=204, responses=problem_responses(404, 412))
def delete_target_catalog(catalog_id: str, call: CallDep) -> None:
    """Delete a catalogue. Scenarios that use it keep their copy."""
    with call.noted("delete", "target_catalog", catalog_id) as session:
        row = matched(call, _find(session, catalog_id, to_change=True), _shown)
        row.delete()


def _find(session: Session, catalog_id: str, *, to_change: bool = False) -> TargetCatalogRow:
    return existing(session, TargetCatalogRow, "target catalogue", catalog_id, to_change=to_change)


def _shown(row: TargetCatalogRow) -> TargetCatalogOut:
    links = {"targets": f"/v1/target-catalogs/{row.id}/targets"}
    return from_row(TargetCatalogOut, row, links=links)
