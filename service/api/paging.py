"""Lists: opaque cursors, a limit, and a Link header to the next page."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Generic, TypeVar

import sqlalchemy as sa
from fastapi import Depends, Query, Request, Response
from sqlalchemy.orm import InstrumentedAttribute, Session

from service.problems.kinds import ServiceError

T = TypeVar("T")
R = TypeVar("R")
K = TypeVar("K", str, int)


@dataclass(frozen=True, slots=True)
class Page(Generic[R]):
    """The rows of one page, and the cursor of the next."""

    rows: Sequence[R]
    next: str | None


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
            raise _invalid_cursor()
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
        raise _invalid_cursor() from None
    if not key.isprintable():
        raise _invalid_cursor()
    return key


def _invalid_cursor() -> ServiceError:
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
) -> Page[R]:
    """Return one page of a statement's rows, newest first; ids sort by the time they were made."""
    if paging.after is not None:
        statement = statement.where(key < paging.after)
    rows = session.scalars(statement.order_by(key.desc()).limit(paging.limit + 1)).all()
    return paging.answer(rows, lambda row: getattr(row, key.key))
