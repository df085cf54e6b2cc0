"""Forecasts that are stored, each its owner's."""

from __future__ import annotations

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import ForecastRow


def seen_by(owner: str | None) -> sa.ColumnElement[bool]:
    """Return the condition that an owner sees a forecast; None sees all."""
    return sa.true() if owner is None else ForecastRow.owner == owner


def find(session: Session, forecast_id: str, owner: str | None) -> ForecastRow | None:
    """Return a forecast that an owner sees, or None."""
    wanted = sa.select(ForecastRow).where(ForecastRow.id == forecast_id, seen_by(owner))
    return session.scalar(wanted)
