"""Lists: opaque cursors, a limit, and a Link header to the next page."""

from __future__ import annotations

import base64
import binascii
import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Generic, TypeVar

import sqlalchemy as sa
from fastapi import Depends, Query, Request, Response
from sqlalchemy.orm import InstrumentedAttribute, Session

from service.problems.kinds import ServiceError
from service.wire.base import Listed

T = TypeVar("T")
R = TypeVar("R")

MOST_BYTES: Final = 2_000_000
"""Of a page whose rows may be large; one row more, where a single one is larger."""


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
    """What the client asked for. ``after`` is the key of the last row it has."""

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
        cursor = encode_cursor(str(key(rows[self.limit - 1])))
        url = self.request.url.include_query_params(cursor=cursor)
        self.response.headers["Link"] = f'<{url.path}?{url.query}>; rel="next"'
        return Page(rows[: self.limit], cursor)


def encode_cursor(key: str) -> str:
    """Return the opaque form of a key."""
    return base64.urlsafe_b64encode(key.encode()).decode().rstrip("=")


def decode_cursor(cursor: str) -> str:
    """Return the key of a cursor; 422 ``invalid_cursor`` where it is none."""
    try:
        padded = cursor + "=" * (-len(cursor) % 4)
        key = base64.b64decode(padded, altchars=b"-_", validate=True).decode("ascii")
    except (binascii.Error, ValueError):
        raise invalid_cursor() from None
    if not key.isprintable():
        raise invalid_cursor()
    return key


def invalid_cursor() -> ServiceError:
    """Return what a cursor of another list is refused with."""
    return ServiceError("invalid_cursor", "The cursor is not one that this list has given.")


async def _paging(
    request: Request,
    response: Response,
    cursor: Annotated[
        str | None, Query(description="`next` of the page before.", max_length=200)
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
        What a row adds to the answer, in bytes, where that may be much: the page ends early.
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
