"""Lists: cursors, a limit, a Link header to the next page, and filters."""

from __future__ import annotations

import base64
import binascii
import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Annotated, Any, Final, Generic, TypeVar

import sqlalchemy as sa
from fastapi import Depends, Query, Request, Response
from sqlalchemy.orm import InstrumentedAttribute, Session

from service.problems.kinds import ServiceError
from service.wire.base import Instant, Listed

T = TypeVar("T")
R = TypeVar("R")

MOST_BYTES: Final = 2_000_000
"""Largest page of rows that may be large; a page holds at least one row, whatever its size."""


@dataclass(frozen=True, slots=True)
class Page(Generic[R]):
    """The rows of one page, and the cursor of the next."""

    rows: Sequence[R]
    next: str | None

    def listed(self, show: Callable[[R], T]) -> Listed[T]:
        """Return the page as clients see it."""
        return Listed(items=[show(row) for row in self.rows], next=self.next)


@dataclass(frozen=True, slots=True)
class Paging:
    """The page that the client asked for. ``after`` is the key of the last row it has."""

    limit: int
    after: str | None
    request: Request
    response: Response

    def after_number(self) -> int:
        """Return ``after`` as a row number, -1 at the start."""
        if self.after is None:
            return -1
        if not self.after.isdigit():
            raise invalid_cursor()
        return int(self.after[:18])

    def answer(self, rows: Sequence[R], key: Callable[[R], object]) -> Page[R]:
        """Return the page of up to ``limit + 1`` rows that were read, and set the Link header."""
        if len(rows) <= self.limit:
            return Page(rows, None)
        last = str(key(rows[self.limit - 1]))
        cursor = base64.urlsafe_b64encode(last.encode()).decode().rstrip("=")
        url = self.request.url.include_query_params(cursor=cursor)
        self.response.headers["Link"] = f'<{url.path}?{url.query}>; rel="next"'
        return Page(rows[: self.limit], cursor)


def decode_cursor(cursor: str) -> str:
    """Return the key of a cursor; 422 ``invalid_cursor`` if it is malformed."""
    try:
        padded = cursor + "=" * (-len(cursor) % 4)
        key = base64.b64decode(padded, altchars=b"-_", validate=True).decode("ascii")
    except (binascii.Error, ValueError):
        raise invalid_cursor() from None
    if not key.isprintable():
        raise invalid_cursor()
    return key


def invalid_cursor() -> ServiceError:
    """Return the error for a cursor that this list has not given."""
    return ServiceError("invalid_cursor", "The cursor was not issued by this list.")


async def _paging(
    request: Request,
    response: Response,
    cursor: Annotated[
        str | None, Query(description="`next` of the previous page.", max_length=200)
    ] = None,
    limit: Annotated[int, Query(ge=1, le=500, description="Most items on a page.")] = 50,
) -> Paging:
    after = None if cursor is None else decode_cursor(cursor)
    return Paging(limit=limit, after=after, request=request, response=response)


PagingDep = Annotated[Paging, Depends(_paging)]


def newest_first(
    session: Session,
    statement: sa.Select[R],
    key: InstrumentedAttribute[str],
    paging: Paging,
    weight: sa.ColumnElement[Any] | None = None,
) -> Page[R]:
    """Return one page of a statement's rows, newest first; ids sort by the time they were made.

    Parameters
    ----------
    weight
        Bytes that a row adds to the answer, if these may be many: the page may then end early.
    """
    if paging.after is not None:
        statement = statement.where(key < paging.after)
    statement = statement.order_by(key.desc()).limit(paging.limit + 1)
    if weight is not None:
        weights = session.scalars(
            statement.with_only_columns(sa.func.coalesce(weight, 0), maintain_column_froms=True)
        )
        paging = replace(paging, limit=_num_fitting(weights, paging.limit))
        statement = statement.limit(paging.limit + 1)
    rows = session.scalars(statement).all()
    return paging.answer(rows, lambda row: getattr(row, key.key))


def size_of(column: InstrumentedAttribute[Any]) -> sa.ColumnElement[int]:
    """Return how many characters a JSON column holds."""
    return sa.func.length(sa.cast(column, sa.Text))


def _num_fitting(weights: Iterable[int], most: int) -> int:
    """Return how many rows fit on a page; always one, or the list would never end.

    >>> _num_fitting([1, 1, 1], 2), _num_fitting([MOST_BYTES, 1], 2), _num_fitting([], 2)
    (2, 1, 2)
    """
    for number, total in enumerate(itertools.accumulate(weights)):
        if total > MOST_BYTES:
            return max(1, min(number, most))
    return most


SatelliteQuery = Annotated[
    str | None, Query(max_length=200, description="Only with this satellite (its id).")
]
StationQuery = Annotated[
    str | None, Query(max_length=200, description="Only with this ground station (its id).")
]
NameQuery = Annotated[
    str | None,
    Query(max_length=200, description="Only names that contain this text, ignoring case."),
]
_From = Annotated[
    Instant | None,
    Query(alias="from", description="Only what was stored at this instant or later."),
]
_To = Annotated[Instant | None, Query(description="Only what was stored before this instant.")]


@dataclass(frozen=True, slots=True)
class Stored:
    """A span of storage times: from an instant on, and before another."""

    start: datetime | None
    end: datetime | None

    def narrow(self, query: sa.Select[Any], column: sa.SQLColumnExpression[Any]) -> sa.Select[Any]:
        """Return a query narrowed to what was stored in this span."""
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
    """Return a query narrowed to names that contain this text."""
    return query if name is None else query.where(column.icontains(name, autoescape=True))
