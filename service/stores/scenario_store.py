"""Who sees which scenario: those that came with a job are seen by the owner of that job."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, cast

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from service.db.rows import ScenarioOwnerRow, ScenarioRow


def seen_by(owner: str | None) -> sa.ColumnElement[bool]:
    """Return the condition that an owner sees a scenario; None sees all."""
    if owner is None:
        return sa.true()
    owners = sa.select(ScenarioOwnerRow.owner).where(ScenarioOwnerRow.scenario_id == ScenarioRow.id)
    return ~owners.exists() | owners.where(ScenarioOwnerRow.owner == owner).exists()


def find(session: Session, scenario_id: str, owner: str | None) -> ScenarioRow | None:
    """Return a scenario that an owner sees, or None."""
    wanted = sa.select(ScenarioRow).where(ScenarioRow.id == scenario_id, seen_by(owner))
    return session.scalar(wanted)


def let_see(session: Session, scenario_id: str, owner: str) -> None:
    """Let an owner see a scenario, and from now on nobody else who was not let."""
    values = {"scenario_id": scenario_id, "owner": owner}
    session.execute(sa.insert(ScenarioOwnerRow).values(**values))


def let_see_too(session: Session, scenario_id: str, owner: str) -> None:
    """Let one more owner see a scenario that only some see."""
    found = sa.select(ScenarioOwnerRow.owner).where(ScenarioOwnerRow.scenario_id == scenario_id)
    owners = session.scalars(found).all()
    if owners and owner not in owners:
        # Another request of this owner may do the same at this moment.
        with suppress(IntegrityError), session.begin_nested():
            let_see(session, scenario_id, owner)


def disown(session: Session, scenario_id: str) -> bool:
    """Let everybody see a scenario; return whether only some did."""
    owners = sa.delete(ScenarioOwnerRow).where(ScenarioOwnerRow.scenario_id == scenario_id)
    return cast("sa.CursorResult[Any]", session.execute(owners)).rowcount > 0
