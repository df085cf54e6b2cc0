"""Forecasts that are stored, each its owner's."""

from __future__ import annotations

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import ForecastRow
from service.stores.finding import of_owner


def find(session: Session, forecast_id: str, owner: str | None) -> ForecastRow | None:
    """Return a forecast that an owner sees, or None."""
    wanted = sa.select(ForecastRow).where(
        ForecastRow.id == forecast_id, of_owner(ForecastRow.owner, owner)
    )
    return session.scalar(wanted)
