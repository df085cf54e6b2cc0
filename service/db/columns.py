"""What all tables share: naming, column types, and base classes with ids and times."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import DeclarativeBase, Mapped, declared_attr, mapped_column

from service.db.ids import new_id

Json = dict[str, Any]


class UtcDateTime(sa.TypeDecorator[datetime]):
    """An aware UTC instant on every database (SQLite itself drops the zone)."""

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
        """Return an aware instant."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Row(DeclarativeBase):
    """Base of all rows. By default, the table of ``ElementSetRow`` is ``element_set``."""

    # SQLAlchemy reads this from the class.
    type_annotation_map = {Json: sa.JSON, datetime: UtcDateTime, str: sa.Text}  # noqa: RUF012

    @declared_attr.directive
    def __tablename__(cls) -> str:  # noqa: N805 - as SQLAlchemy calls it
        """Return the name of the table."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", cls.__name__.removesuffix("Row")).lower()


class Made(Row):
    """A row with an id of its own, assigned on construction."""

    __abstract__ = True

    id: Mapped[str] = mapped_column(sa.String(36), primary_key=True)
    created_at: Mapped[datetime]

    def __init__(self, **values: Any):
        super().__init__(**{"id": new_id(), "created_at": datetime.now(UTC)} | values)


class Kept(Made):
    """A row that is kept after deletion, because scenarios and plans refer to it."""

    __abstract__ = True

    deleted_at: Mapped[datetime | None]

    def delete(self) -> None:
        """Mark it as deleted now."""
        self.deleted_at = datetime.now(UTC)


class Owned(Made):
    """A row that belongs to an owner."""

    __abstract__ = True

    owner: Mapped[str] = mapped_column(sa.String(64))


class Reported(Row):
    """A report by somebody about a plan. Rows are added, never changed."""

    __abstract__ = True

    id: Mapped[str] = mapped_column(sa.String(36), primary_key=True)
    plan_id: Mapped[str] = mapped_column(sa.ForeignKey("plan.id"), index=True)
    owner: Mapped[str] = mapped_column(sa.String(64))
    key_name: Mapped[str | None] = mapped_column(sa.String(64))
    reported_at: Mapped[datetime]
