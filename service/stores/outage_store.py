"""Outages in the database."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import OutageRow
from service.stores.finding import alive
from service.wire.pins import PlacedOutage
from service.wire.stored import from_row


def overlapping(
    query: sa.Select[OutageRow], from_: datetime | None, to: datetime | None
) -> sa.Select[OutageRow]:
    """Return the query restricted to a time span, which may be open at either end."""
    if from_ is not None:
        query = query.where(OutageRow.end > from_)
    if to is not None:
        query = query.where(OutageRow.start < to)
    return query


def concerning(
    session: Session,
    satellite_ids: Collection[str],
    station_ids: Collection[str],
    from_: datetime,
    to: datetime,
) -> Sequence[OutageRow]:
    """Return the outages of these satellites and stations in a time span, by start."""
    whose = sa.or_(OutageRow.satellite_id.in_(satellite_ids), OutageRow.station_id.in_(station_ids))
    wanted = overlapping(alive(OutageRow).where(whose), from_, to)
    return session.scalars(wanted.order_by(OutageRow.start, OutageRow.id)).all()


def placed(row: OutageRow) -> PlacedOutage:
    """Return the outage in the form that scenarios include."""
    return from_row(PlacedOutage, row)
