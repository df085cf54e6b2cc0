"""The database's clock: one clock for the leases and heartbeats of several machines."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import Session
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.functions import FunctionElement

from service.db.columns import UtcDateTime


class utc_now(FunctionElement[datetime]):  # noqa: N801 - reads as an SQL function
    """``utc_now()`` or ``utc_now(offset_s)``: the present instant, plus an offset in seconds.

    It advances within a transaction, so that one that waited for a lock sees the later time.
    """

    type = UtcDateTime()
    inherit_cache = True

    def __init__(self, offset_s: float = 0.0):
        super().__init__(sa.literal(float(offset_s), sa.Float))


def now(session: Session, offset_s: float = 0.0) -> datetime:
    """Return the database's time, plus an offset in seconds."""
    return session.execute(sa.select(utc_now(offset_s))).scalar_one()


@compiles(utc_now, "sqlite")
def _sqlite(element: utc_now, compiler: SQLCompiler, **kw: Any) -> str:
    # Six decimals of the second, as rows store instants, since SQLite compares them as text.
    offset = compiler.process(element.clauses, **kw)
    return f"(strftime('%Y-%m-%d %H:%M:%f', 'now', {offset} || ' seconds') || '000')"


@compiles(utc_now, "postgresql")
def _postgresql(element: utc_now, compiler: SQLCompiler, **kw: Any) -> str:
    offset = compiler.process(element.clauses, **kw)
    return f"(clock_timestamp() + make_interval(secs => {offset}))"


class seconds_between(FunctionElement[float]):  # noqa: N801 - reads as an SQL function
    """``seconds_between(start, end)``: the seconds from one instant to another."""

    type = sa.Double()
    inherit_cache = True

    def __init__(
        self, start: sa.ColumnExpressionArgument[Any], end: sa.ColumnExpressionArgument[Any]
    ):
        super().__init__(start, end)


@compiles(seconds_between, "sqlite")
def _sqlite_between(element: seconds_between, compiler: SQLCompiler, **kw: Any) -> str:
    # A Julian day is accurate to 0.04 ms, and SQLite's clock to 1 ms.
    start, end = (compiler.process(clause, **kw) for clause in element.clauses)
    return f"((julianday({end}) - julianday({start})) * 86400.0)"


@compiles(seconds_between, "postgresql")
def _postgresql_between(element: seconds_between, compiler: SQLCompiler, **kw: Any) -> str:
    start, end = (compiler.process(clause, **kw) for clause in element.clauses)
    return f"CAST(EXTRACT(EPOCH FROM ({end}) - ({start})) AS double precision)"
