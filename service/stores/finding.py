"""What exists for whom: things not deleted, and those of an owner."""

from __future__ import annotations

from typing import Any, TypeVar

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.columns import Kept, Owned
from service.problems.kinds import ServiceError

K = TypeVar("K", bound=Kept)
W = TypeVar("W", bound=Owned)


def alive(table: type[K]) -> sa.Select[K]:
    """Return the query of all rows not deleted."""
    return sa.select(table).where(table.deleted_at.is_(None))


def find(session: Session, table: type[K], own_id: str, *, to_change: bool = False) -> K | None:
    """Return a row that is not deleted, or None; locked if it is to change."""
    row = session.get(table, own_id, with_for_update=to_change)
    return None if row is None or row.deleted_at is not None else row


def existing(
    session: Session, table: type[K], what: str, own_id: str, *, to_change: bool = False
) -> K:
    """Return a row that is not deleted; 404, calling it ``what``, if there is none."""
    row = find(session, table, own_id, to_change=to_change)
    if row is None:
        raise no_such(what, own_id)
    return row


def of_owner(column: sa.SQLColumnExpression[str], owner: str | None) -> sa.ColumnElement[bool]:
    """Return the condition that a thing belongs to an owner; None means any owner."""
    return sa.true() if owner is None else column == owner


def find_own(
    session: Session, table: type[W], own_id: str, owner: str | None, *, to_change: bool = False
) -> W | None:
    """Return a thing of an owner (None: of any owner), its row locked if it is to change."""
    wanted = sa.select(table).where(table.id == own_id, of_owner(table.owner, owner))
    if to_change:
        wanted = wanted.with_for_update().execution_options(populate_existing=True)
    return session.scalar(wanted)


def with_values(table: type[Any], **wanted: str | None) -> list[sa.ColumnElement[bool]]:
    """Return the conditions that columns have these values; None sets no condition."""
    return [getattr(table, name) == value for name, value in wanted.items() if value is not None]


def no_such(what: str, own_id: str) -> ServiceError:
    """Return the error for a thing that does not exist, at least for this caller."""
    return ServiceError("not_found", f"There is no {what} {own_id!r}.")
