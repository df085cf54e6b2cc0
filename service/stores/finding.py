"""What is there for whom: things that were not deleted, and those of an owner."""

from __future__ import annotations

from typing import Any, TypeVar

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.columns import Kept, Owned
from service.problems.kinds import ServiceError

K = TypeVar("K", bound=Kept)
W = TypeVar("W", bound=Owned)


def alive(table: type[K]) -> sa.Select[K]:
    """Return the query of all that have not been deleted."""
    return sa.select(table).where(table.deleted_at.is_(None))


def find(session: Session, table: type[K], own_id: str, *, to_change: bool = False) -> K | None:
    """Return one that has not been deleted, its row locked where it is to change."""
    row = session.get(table, own_id, with_for_update=to_change)
    return None if row is None or row.deleted_at is not None else row


def existing(
    session: Session, table: type[K], what: str, own_id: str, *, to_change: bool = False
) -> K:
    """Return one that has not been deleted; 404 where there is none, in these words."""
    row = find(session, table, own_id, to_change=to_change)
    if row is None:
        raise no_such(what, own_id)
    return row


def of_owner(column: sa.SQLColumnExpression[str], owner: str | None) -> sa.ColumnElement[bool]:
    """Return the condition that a thing is an owner's; None stands for everybody."""
    return sa.true() if owner is None else column == owner


def find_own(
    session: Session, table: type[W], own_id: str, owner: str | None, *, to_change: bool = False
) -> W | None:
    """Return a thing of an owner's, or of anybody's, its row locked where it is to change."""
    wanted = sa.select(table).where(table.id == own_id, of_owner(table.owner, owner))
    if to_change:
        wanted = wanted.with_for_update().execution_options(populate_existing=True)
    return session.scalar(wanted)


def with_values(table: type[Any], **wanted: str | None) -> list[sa.ColumnElement[bool]]:
    """Return the conditions that columns have these values; None asks nothing."""
    return [getattr(table, name) == value for name, value in wanted.items() if value is not None]


def no_such(what: str, own_id: str) -> ServiceError:
    """Return the error for a thing that is not there, or not for who asks."""
    return ServiceError("not_found", f"There is no {what} {own_id!r}.")
