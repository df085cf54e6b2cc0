"""Spacecraft types: built-in ones, and those stored by users."""

from __future__ import annotations

from typing import Any, Final

from fastapi import APIRouter, Response
from sqlalchemy.orm import Session

from service.api.conditional import etagged, located, matched, readable, require_match, unless_known
from service.api.deps import CallDep
from service.api.errors import problem_responses
from service.api.idempotency import OnceDep
from service.api.paging import PagingDep, newest_first
from service.db.rows import SpacecraftRow
from service.problems.faults import validated
from service.problems.kinds import ServiceError
from service.scenarios.translate import figures_from
from service.stores import spacecraft_store as store
from service.stores.finding import alive, existing
from service.wire.base import Listed
from service.wire.satellites import sent_by
from service.wire.spacecraft import SpacecraftIn, SpacecraftOut, SpacecraftPatch, WholeSpacecraft
from service.wire.spacecraft_types import BUILT_IN, filled
from service.wire.stored import from_row

_ANY_PERIOD_S: Final = 5700.0
"""Presets depend on the orbit's period, which a type does not have; they are valid for any."""

router = APIRouter(prefix="/v1/spacecraft", tags=["spacecraft"])


@router.post("", status_code=201)
def create_spacecraft(body: SpacecraftIn, once: OnceDep) -> SpacecraftOut:
    """Store a type of spacecraft, for satellites to name."""
    with once.transaction() as session:
        whole = store.completed(session, sent_by(body), WholeSpacecraft, names_type=False)
        figures_from(whole, _ANY_PERIOD_S)
        row = SpacecraftRow(name=whole.name, body=_figures(whole))
        session.add(row)
        return once.created(session, "spacecraft", row.id, _shown(row))


@router.get("")
def list_spacecraft(call: CallDep, paging: PagingDep) -> Listed[SpacecraftOut]:
    """List the stored types, newest first, followed by the built-in ones on the last page."""
    with call.database.reading() as session:
        page = newest_first(session, alive(SpacecraftRow), SpacecraftRow.id, paging)
    built_in = [_built_in(name) for name in BUILT_IN] if page.next is None else []
    return Listed(items=[*(_shown(row) for row in page.rows), *built_in], next=page.next)


@router.get("/{spacecraft_id}", response_model=SpacecraftOut, responses=readable())
def get_spacecraft(spacecraft_id: str, call: CallDep) -> SpacecraftOut | Response:
    """Return one type, by its id or built-in name."""
    if spacecraft_id in BUILT_IN:
        return unless_known(call, _built_in(spacecraft_id))
    with call.database.reading() as session:
        return unless_known(call, _shown(_find(session, spacecraft_id)))


@router.patch("/{spacecraft_id}", responses=problem_responses(404, 409, 412))
def change_spacecraft(spacecraft_id: str, body: SpacecraftPatch, call: CallDep) -> SpacecraftOut:
    """Change a stored type. Satellites made from it stay as they are.

    `If-Match` takes the ETag of the type.
    """
    with call.database.transaction() as session:
        row = _find(session, spacecraft_id, to_change=True)
        before = _shown(row)
        require_match(call, etagged(before))
        merged = filled({"name": row.name} | sent_by(body), row.body)
        whole = validated(WholeSpacecraft, merged)
        figures_from(whole, _ANY_PERIOD_S)
        row.name, row.body = whole.name, _figures(whole)
        shown = _shown(row)
        if shown != before:
            call.audit.record(session, "update", "spacecraft", spacecraft_id)
    return located(call, shown, f"/v1/spacecraft/{spacecraft_id}")


@router.delete("/{spacecraft_id}", status_code=204, responses=problem_responses(404, 409, 412))
def delete_spacecraft(spacecraft_id: str, call: CallDep) -> None:
    """Delete a stored type. Satellites made from it stay as they are."""
    with call.noted("delete", "spacecraft", spacecraft_id) as session:
        row = matched(call, _find(session, spacecraft_id, to_change=True), _shown)
        row.delete()


def _find(session: Session, spacecraft_id: str, *, to_change: bool = False) -> SpacecraftRow:
    if spacecraft_id in BUILT_IN:
        raise ServiceError(
            "built_in", f"{spacecraft_id} is built in: store a type of your own instead."
        )
    return existing(session, SpacecraftRow, "spacecraft type", spacecraft_id, to_change=to_change)


def _figures(whole: WholeSpacecraft) -> dict[str, Any]:
    return whole.model_dump(mode="json", exclude={"name"})


def _built_in(name: str) -> SpacecraftOut:
    return SpacecraftOut(id=name, name=name, is_built_in=True, created_at=None, **BUILT_IN[name])


def _shown(row: SpacecraftRow) -> SpacecraftOut:
    return from_row(SpacecraftOut, row, is_built_in=False, **row.body)
