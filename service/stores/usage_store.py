"""How much of the database each owner uses."""

from __future__ import annotations

from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.rows import OwnerUsageRow
from service.db.session import changed, inserted
from service.problems.kinds import ServiceError

MB: Final = 1_000_000


def add(session: Session, owner: str, *, num_rows: int, num_bytes: int) -> tuple[int, int]:
    """Add to an owner's usage; return its total rows and bytes."""
    rows, size = OwnerUsageRow.num_rows, OwnerUsageRow.num_bytes
    more = {"num_rows": rows + num_rows, "num_bytes": size + num_bytes}
    found = changed(session, OwnerUsageRow, OwnerUsageRow.owner == owner, rows, size, **more)
    if found is None:
        # Another transaction may insert the row just now.
        inserted(session, OwnerUsageRow, owner=owner, num_rows=0, num_bytes=0)
        found = changed(session, OwnerUsageRow, OwnerUsageRow.owner == owner, rows, size, **more)
        assert found is not None
    return found[0], found[1]


def give_back(session: Session, owner: str, *, num_rows: int, num_bytes: int) -> None:
    """Subtract what an owner no longer stores."""
    values = {}
    for column, number in (("num_rows", num_rows), ("num_bytes", num_bytes)):
        left = getattr(OwnerUsageRow, column) - number
        # What was stored before counting began was never added.
        values[column] = sa.case((left > 0, left), else_=0)
    own = OwnerUsageRow.owner == owner
    changed(session, OwnerUsageRow, own, OwnerUsageRow.owner, **values)


def used(session: Session, owner: str) -> tuple[int, int]:
    """Return how many rows and bytes an owner has stored."""
    row = session.get(OwnerUsageRow, owner)
    return (0, 0) if row is None else (row.num_rows, row.num_bytes)


def require(usage: tuple[int, int], max_rows: int, max_mb: float) -> None:
    """Raise ``quota_exceeded`` if an owner stores more than it may."""
    num_rows, num_bytes = usage
    if num_rows > max_rows or num_bytes > max_mb * MB:
        raise ServiceError(
            "quota_exceeded",
            f"An owner may store {max_rows} rows and {max_mb:g} MB; "
            f"this would make {num_rows} rows and {num_bytes / MB:.1f} MB.",
        )
