"""What all tables share: how they are called, their types of columns, and who was made when."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import DeclarativeBase, Mapped, declared_attr, mapped_column

from service.db.ids import new_id

Json = dict[str, Any]


class UtcDateTime(sa.TypeDecorator[datetime]):
    """An aware UTC instant on every database (SQLite itself forgets the zone)."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        """Refuse naive instants and store UTC."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("naive datetime")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        """Give back an aware instant."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Row(DeclarativeBase):
    """Base of all rows. Unless it says otherwise, ``ElementSetRow`` is one of ``element_set``."""

    type_annotation_map = {Json: sa.JSON, datetime: UtcDateTime, str: sa.Text}  # noqa: RUF012 - as SQLAlchemy reads it

    @declared_attr.directive
    def __tablename__(cls) -> str:  # noqa: N805 - as SQLAlchemy calls it
        """Return the name of the table."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", cls.__name__.removesuffix("Row")).lower()


class Made(Row):
    """A thing with an id of its own, which it has from the moment that it is made."""

    __abstract__ = True

    id: Mapped[str] = mapped_column(sa.String(36), primary_key=True)
    created_at: Mapped[datetime]

    def __init__(self, **values: Any):
        super().__init__(**{"id": new_id(), "created_at": datetime.now(UTC)} | values)


class Kept(Made):
    """A thing whose row stays when it is deleted: scenarios and plans name it."""

    __abstract__ = True

    deleted_at: Mapped[datetime | None]

    def delete(self) -> None:
        """Note that it is deleted now."""
        self.deleted_at = datetime.now(UTC)


class Owned(Made):
    """A thing of an owner's."""

    __abstract__ = True

    owner: Mapped[str] = mapped_column(sa.String(64))


class Reported(Row):
    """What somebody has reported of a plan. Rows are added, never changed."""

    __abstract__ = True

    id: Mapped[str] = mapped_column(sa.String(36), primary_key=True)
    plan_id: Mapped[str] = mapped_column(sa.ForeignKey("plan.id"), index=True)
    owner: Mapped[str] = mapped_column(sa.String(64))
    key_name: Mapped[str | None] = mapped_column(sa.String(64))
    reported_at: Mapped[datetime]
