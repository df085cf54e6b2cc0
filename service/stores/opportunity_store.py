"""Opportunities of scenarios, computed once and stored."""

from __future__ import annotations

from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from planner_core.sources import opportunity_version
from service.db.clock import utc_now
from service.db.rows import OpportunitySetRow
from service.db.session import inserted

VERSION: Final = opportunity_version()
"""Blocks of other code are recomputed, so nobody has to track changes of their format."""


def load(session: Session, sha256: str) -> bytes | None:
    """Return the stored block of a scenario, or None."""
    row = session.get(OpportunitySetRow, sha256)
    return None if row is None or row.version != VERSION else row.block


def save(session: Session, sha256: str, block: bytes) -> None:
    """Store the block of a scenario, unless another transaction has stored one already."""
    stale = sa.delete(OpportunitySetRow).where(
        OpportunitySetRow.scenario_sha256 == sha256, OpportunitySetRow.version != VERSION
    )
    session.execute(stale)
    row = {"scenario_sha256": sha256, "version": VERSION, "block": block, "created_at": utc_now()}
    inserted(session, OpportunitySetRow, **row)
