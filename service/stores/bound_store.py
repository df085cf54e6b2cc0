"""Proven bounds of scenarios: each job starts from the best bound so far."""

from __future__ import annotations

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import utc_now
from service.db.rows import BoundRow
from service.db.session import inserted
from service.stores.opportunity_store import VERSION


def load(session: Session, sha256: str) -> str | None:
    """Return the best bound of a scenario with its proof (JSON text), or None."""
    row = session.get(BoundRow, sha256)
    return None if row is None or row.version != VERSION else row.proof


def save(session: Session, sha256: str, value: float, proof: str) -> None:
    """Store a bound of a scenario, unless one as low is stored."""
    own = BoundRow.scenario_sha256 == sha256
    is_beaten = sa.or_(BoundRow.version != VERSION, BoundRow.value > value)
    row = {"version": VERSION, "value": value, "proof": proof, "created_at": utc_now()}
    # Insert first: if another transaction's insert comes between, its bound can be beaten.
    if not inserted(session, BoundRow, scenario_sha256=sha256, **row):
        session.execute(sa.update(BoundRow).where(own, is_beaten).values(**row))
