"""Outages of satellites and ground stations, which are copied into scenarios that they overlap."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import sqlalchemy as sa
from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from service.api.conditional import matched, readable, unless_known
from service.api.deps import CallDep
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.paging import PagingDep, newest_first
from service.db.rows import GroundStationRow, OutageRow, SatelliteRow
from service.scenarios.pin_inputs import outage_from
from service.stores import outage_store
from service.stores.finding import alive, existing, find, with_values
from service.wire.base import Instant, Listed
from service.wire.pins import OutageIn, OutageOut
from service.wire.stored import from_row

router = APIRouter(prefix="/v1/outages", tags=["outages"])


@router.post("", status_code=201)
def create_outage(body: OutageIn, once: OnceDep) -> OutageOut:
    """Report that a satellite or a ground station is out for a while.

    Scenarios stored from now on include it, with its id, if it overlaps their horizon.
    """
    with once.transaction() as session:
        satellite_ids = _alive(session, SatelliteRow, body.satellite_id)
        outage_from(body).check(
            "", satellite_ids, _alive(session, GroundStationRow, body.station_id)
        )
        row = OutageRow(**body.model_dump())
        session.add(row)
        session.flush()
        return once.created(session, "outage", row.id, _shown(session, [row])[0])


@router.get("")
def list_outages(
    call: CallDep,
    paging: PagingDep,
    satellite_id: Annotated[str | None, Query(description="Only of this satellite.")] = None,
    station_id: Annotated[str | None, Query(description="Only of this station.")] = None,
    from_: Annotated[
        Instant | None, Query(alias="from", description="Only those that end after this.")
    ] = None,
    to: Annotated[Instant | None, Query(description="Only those that begin before this.")] = None,
) -> Listed[OutageOut]:
    """List the outages, newest first."""
    own = with_values(OutageRow, satellite_id=satellite_id, station_id=station_id)
    query = outage_store.overlapping(alive(OutageRow).where(*own), from_, to)
    with call.database.reading() as session:
        page = newest_first(session, query, OutageRow.id, paging)
        return Listed(items=_shown(session, page.rows), next=page.next)


@router.get("/{outage_id}", response_model=OutageOut, responses=readable())
def get_outage(outage_id: str, call: CallDep) -> OutageOut | Response:
    """Return one outage."""
    with call.database.reading() as session:
        row = existing(session, OutageRow, "outage", outage_id)
        return unless_known(call, _shown(session, [row])[0])


@router.delete("/{outage_id}", status_code=204, responses=problem_responses(404, 412))
def delete_outage(outage_id: str, call: CallDep) -> None:
    """Delete an outage, for example if it ends early. Scenarios that include it keep it."""
    with call.noted("delete", "outage", outage_id) as session:
        row = existing(session, OutageRow, "outage", outage_id, to_change=True)
        matched(call, row, lambda row: _shown(session, [row])[0])
        row.delete()


def _alive(
    session: Session, table: type[SatelliteRow] | type[GroundStationRow], own_id: str | None
) -> set[str]:
    """Return the id, if it is that of a stored row."""
    return set() if own_id is None or find(session, table, own_id) is None else {own_id}


def _shown(session: Session, rows: Sequence[OutageRow]) -> list[OutageOut]:
    names: dict[str, str] = {}
    for table, ids in (
        (SatelliteRow, {row.satellite_id for row in rows}),
        (GroundStationRow, {row.station_id for row in rows}),
    ):
        wanted = sa.select(table.id, table.name).where(table.id.in_(ids - {None}))
        names |= {row.id: row.name for row in session.execute(wanted)}
    return [
        from_row(
            OutageOut,
            row,
            satellite_name=names.get(row.satellite_id or ""),
            station_name=names.get(row.station_id or ""),
        )
        for row in rows
    ]
