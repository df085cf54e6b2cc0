"""What lists are narrowed by: parts of names, and when things were stored."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any

import sqlalchemy as sa
from fastapi import Depends, Query

from service.wire.base import Instant

SatelliteQuery = Annotated[
    str | None, Query(max_length=200, description="Only with this satellite, by its id.")
]
StationQuery = Annotated[
    str | None, Query(max_length=200, description="Only with this ground station, by its id.")
]
NameQuery = Annotated[
    str | None, Query(max_length=200, description="Only names that hold this text, in any case.")
]
_From = Annotated[
    Instant | None, Query(alias="from", description="Only what was stored then or later.")
]
_To = Annotated[Instant | None, Query(description="Only what was stored before.")]


@dataclass(frozen=True, slots=True)
class Stored:
    """When things were stored: from an instant on, and before another."""

    start: datetime | None
    end: datetime | None

    def narrow(self, query: sa.Select[Any], column: sa.SQLColumnExpression[Any]) -> sa.Select[Any]:
        """Return a query of what was stored then."""
        if self.start is not None:
            query = query.where(column >= self.start)
        if self.end is not None:
            query = query.where(column < self.end)
        return query


async def _stored(from_: _From = None, to: _To = None) -> Stored:
    return Stored(from_, to)


StoredDep = Annotated[Stored, Depends(_stored)]


def by_name(
    query: sa.Select[Any], column: sa.SQLColumnExpression[Any], name: str | None
) -> sa.Select[Any]:
    """Return a query of what has this text in its name."""
    return query if name is None else query.where(column.icontains(name, autoescape=True))
