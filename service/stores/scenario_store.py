"""Who sees which scenario, and which satellites and stations each has.

A scenario that came with a job is seen only by the job's owner.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final, cast

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import ScenarioOwnerRow, ScenarioPartRow, ScenarioRow
from service.db.session import inserted

_KINDS: Final = {"satellite_ids": "satellite", "ground_station_ids": "station"}


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
    """Let an owner see a scenario, which hides it from everybody not let in this way."""
    # Another request of this owner may do the same just now.
    inserted(session, ScenarioOwnerRow, scenario_id=scenario_id, owner=owner)


def let_see_too(session: Session, scenario_id: str, owner: str) -> None:
    """Let one more owner see a scenario that is not visible to everybody."""
    found = sa.select(ScenarioOwnerRow.owner).where(ScenarioOwnerRow.scenario_id == scenario_id)
    owners = session.scalars(found).all()
    if owners and owner not in owners:
        let_see(session, scenario_id, owner)


def disown(session: Session, scenario_id: str) -> bool:
    """Let everybody see a scenario; return whether it was hidden from some."""
    owners = sa.delete(ScenarioOwnerRow).where(ScenarioOwnerRow.scenario_id == scenario_id)
    return cast("sa.CursorResult[Any]", session.execute(owners)).rowcount > 0


def note_parts(session: Session, scenario_id: str, summary: Mapping[str, Any]) -> None:
    """Store a scenario's satellites and ground stations, taken from its summary."""
    rows = [
        {"part_id": part_id, "scenario_id": scenario_id, "kind": kind}
        for name, kind in _KINDS.items()
        for part_id in summary[name]
    ]
    if rows:
        session.execute(sa.insert(ScenarioPartRow), rows)


def with_parts(
    scenario_id: sa.SQLColumnExpression[str], satellite_id: str | None, station_id: str | None
) -> Iterator[sa.ColumnElement[bool]]:
    """Yield conditions that a scenario has a satellite and a station; None sets no condition."""
    for kind, part_id in (("satellite", satellite_id), ("station", station_id)):
        if part_id is not None:
            part = sa.select(ScenarioPartRow.part_id).where(
                ScenarioPartRow.part_id == part_id,
                ScenarioPartRow.kind == kind,
                ScenarioPartRow.scenario_id == scenario_id,
            )
            yield part.exists()
