"""Targets across all plans: open, planned, collected, delivered, expired or cancelled."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from itertools import islice
from typing import Annotated

import sqlalchemy as sa
from fastapi import APIRouter, Query
from sqlalchemy.orm import Session

from service.api.deps import CallDep
from service.api.paging import PagingDep, invalid_cursor
from service.db import clock
from service.db.rows import TargetCatalogRow, TargetRow
from service.plans.target_lives import lives_of, plans_by_catalog
from service.wire.base import Listed
from service.wire.sites import TargetIn
from service.wire.stored import from_store
from service.wire.target_lives import TargetLifeOut, TargetState

router = APIRouter(prefix="/v1/targets", tags=["targets"])

_AT_ONCE = 500
_Numbered = tuple[tuple[str, int], TargetLifeOut]


@router.get("")
def list_target_lives(
    call: CallDep,
    paging: PagingDep,
    state: Annotated[TargetState | None, Query(description="Only targets in this state.")] = None,
    catalog_id: Annotated[str | None, Query(description="Only targets of this catalogue.")] = None,
) -> Listed[TargetLifeOut]:
    """List the targets of the catalogues with their states, catalogue by catalogue.

    `planned`: a published plan has an image of it. `collected`: an image was reported as taken.
    `delivered`: the contact that downlinks it was reported as executed, too. `expired`: it is past
    `due`. `cancelled`: its catalogue was deleted. `open`: none of these.
    """
    after = _after(paging.after)
    with call.database.reading() as session:
        catalogs = _catalogs(session, catalog_id, after[0])
        plans = plans_by_catalog(session, call.caller.visible_owner)
        now = clock.now(session)
        found = (
            numbered
            for catalog in catalogs
            for numbered in _lives(session, catalog, plans.get(catalog.id, []), after, now)
            if state in (None, numbered[1].state)
        )
        page = paging.answer(
            list(islice(found, paging.limit + 1)), lambda row: f"{row[0][0]} {row[0][1]}"
        )
    return page.listed(lambda row: row[1])


def _catalogs(session: Session, catalog_id: str | None, from_id: str) -> list[TargetCatalogRow]:
    wanted = sa.select(TargetCatalogRow).order_by(TargetCatalogRow.id)
    if catalog_id is not None:
        wanted = wanted.where(TargetCatalogRow.id == catalog_id)
    return list(session.scalars(wanted.where(TargetCatalogRow.id >= from_id)))


def _lives(
    session: Session,
    catalog: TargetCatalogRow,
    plan_ids: list[str],
    after: tuple[str, int],
    now: datetime,
) -> Iterator[_Numbered]:
    lives = lives_of(session, plan_ids)
    for row in _rows(session, catalog.id, after[1] if catalog.id == after[0] else -1):
        target = from_store(TargetIn, row.body)
        is_cancelled = catalog.deleted_at is not None
        life = TargetLifeOut(
            catalog_id=catalog.id,
            catalog_name=catalog.name,
            target=target,
            state=lives.state_of(target.id, target.due, is_cancelled=is_cancelled, now=now),
            collect=lives.collect_of(target.id),
        )
        yield (catalog.id, row.position), life


def _rows(session: Session, catalog_id: str, after: int) -> Iterator[TargetRow]:
    while True:
        wanted = sa.select(TargetRow).where(
            TargetRow.catalog_id == catalog_id, TargetRow.position > after
        )
        rows = session.scalars(wanted.order_by(TargetRow.position).limit(_AT_ONCE)).all()
        yield from rows
        if len(rows) < _AT_ONCE:
            return
        after = rows[-1].position


def _after(cursor: str | None) -> tuple[str, int]:
    if cursor is None:
        return "", -1
    catalog_id, _, position = cursor.partition(" ")
    if not position.isdecimal() or len(position) > 18:
        raise invalid_cursor()
    return catalog_id, int(position)
