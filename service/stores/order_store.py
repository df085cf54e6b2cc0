"""Orders in the database: each is a target in its owner's standing catalogue."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import OrderRow, TargetCatalogRow, TargetRow
from service.db.session import take_turns
from service.wire.sites import MAX_TARGETS

CATALOG_NAME: Final = "STAPI orders"
_TURNS: Final = "stapi_orders"


def add(
    session: Session,
    owner: str,
    product_id: str,
    target: Mapping[str, Any],
    sent: Mapping[str, Any],
) -> OrderRow:
    """Store an order, and its target at the end of the owner's standing catalogue.

    Parameters
    ----------
    target
        As in catalogues; its id becomes that of the order.
    sent
        The content of the order, for its readers.
    """
    take_turns(session, _TURNS)
    catalog = _standing(session, owner)
    # Not the number of targets, since positions may have gaps.
    last = sa.select(sa.func.max(TargetRow.position)).where(TargetRow.catalog_id == catalog.id)
    before = session.scalar(last)
    session.add(
        TargetRow(
            catalog_id=catalog.id,
            position=0 if before is None else before + 1,
            target_id=target["id"],
            body=dict(target),
        )
    )
    catalog.num_targets += 1
    row = OrderRow(
        id=target["id"],
        owner=owner,
        product_id=product_id,
        catalog_id=catalog.id,
        target=dict(target),
        sent=dict(sent),
    )
    session.add(row)
    return row


def _standing(session: Session, owner: str) -> TargetCatalogRow:
    """Return the catalogue for the owner's next order; a new one if it is deleted or full."""
    newest = (
        sa.select(TargetCatalogRow)
        .join(OrderRow, OrderRow.catalog_id == TargetCatalogRow.id)
        .where(OrderRow.owner == owner)
        .order_by(OrderRow.id.desc())
        .limit(1)
        .with_for_update(of=TargetCatalogRow)
    )
    found = session.scalar(newest)
    if found is not None and found.deleted_at is None and found.num_targets < MAX_TARGETS:
        return found
    fresh = TargetCatalogRow(name=CATALOG_NAME, num_targets=0)
    session.add(fresh)
    session.flush()
    return fresh
