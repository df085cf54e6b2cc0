"""The database: one engine per process, with transactions committed where they are opened."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from service.db.columns import Row
from service.db.postgresql import make_postgresql_engine
from service.db.timeouts import DEFAULT_TIMEOUT_S

_SQLITE_PRAGMAS = ("busy_timeout = 30000", "synchronous = FULL", "foreign_keys = ON")
_NO_TRANSACTION = "no_transaction"


class Database:
    """Sessions on one database. Whoever opens a transaction ends it; nobody else commits.

    Parameters
    ----------
    url
        SQLAlchemy URL: a SQLite file (its folder is created) or PostgreSQL.
    timeout_s
        Time limit of a statement on PostgreSQL.
    """

    def __init__(self, url: str, timeout_s: float = DEFAULT_TIMEOUT_S):
        self.engine = make_engine(url, timeout_s)
        self._reader = self.engine.execution_options(read_only=True)
        # One query needs no transaction. On PostgreSQL that saves two round trips to the server.
        alone: dict[str, Any] = {"isolation_level": "AUTOCOMMIT"}
        if self.engine.dialect.name == "sqlite":
            alone = {_NO_TRANSACTION: True}
        self._asker = self._reader.execution_options(**alone)
        self._untested: sa.Engine = self._asker
        if self.engine.dialect.name == "postgresql":
            # Testing a connection before each use costs as much as a small query. Nor is one set
            # up before or reset after each use: there is no transaction to end.
            self._untested = make_postgresql_engine(
                url, timeout_s, pool_size=1, max_overflow=1, pool_pre_ping=False,
                pool_reset_on_return=None, **alone,
            )  # fmt: skip

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """Yield a session that may write: committed at the end, rolled back on an error."""
        with Session(self.engine, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Yield a read-only session on one snapshot; it never waits for a writer."""
        with Session(self._reader, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def asking(self) -> Iterator[sa.Connection]:
        """Yield a connection for one query, which is cheaper than a session."""
        with self._asker.begin() as connection:
            yield connection

    @contextmanager
    def asking_untested(self) -> Iterator[sa.Connection]:
        """Yield the same without testing that it works: for callers that can ask another way."""
        with self._untested.begin() as connection:
            yield connection

    def close(self) -> None:
        """Close all pooled connections."""
        self.engine.dispose()
        self._untested.dispose()


def take_turns(session: Session, name: str) -> None:
    """Make other transactions that call this with the same name wait until this one has ended.

    For rules that no constraint can express. SQLite has only one writer at a time anyway.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.execute(sa.select(sa.func.pg_advisory_xact_lock(sa.func.hashtext(name))))


def inserted(session: Session, table: type[Row], **values: Any) -> bool:
    """Insert a row unless one with its keys exists or is inserted now; return whether it was."""
    dialect = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    statement = dialect.insert(table).values(**values).on_conflict_do_nothing()
    own = statement.returning(*sa.inspect(table).primary_key)
    return session.execute(own).first() is not None


def changed(
    session: Session,
    table: type[Row],
    guard: sa.ColumnElement[bool],
    *columns: sa.SQLColumnExpression[Any],
    **values: Any,
) -> sa.Row[*tuple[Any, ...]] | None:
    """Change the row that meets a condition; return these columns, or None if there is none."""
    statement = sa.update(table).where(guard).values(**values).returning(*columns)
    statement = statement.execution_options(synchronize_session=False)
    return session.execute(statement).one_or_none()


def make_engine(url: str, timeout_s: float | None = DEFAULT_TIMEOUT_S) -> sa.Engine:
    """Return an engine configured for the service (SQLite: WAL, every commit synced)."""
    address = sa.make_url(url)
    if address.get_backend_name() != "sqlite":
        return make_postgresql_engine(url, timeout_s, pool_size=10, max_overflow=40)
    if address.database and address.database != ":memory:":
        Path(address.database).parent.mkdir(parents=True, exist_ok=True)
    engine = sa.create_engine(url, pool_size=10, max_overflow=40)
    sa.event.listen(engine, "connect", _prepare_sqlite)
    sa.event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: Any, _record: object) -> None:
    # Python's driver would begin transactions itself, and too late; see _begin_sqlite.
    connection.isolation_level = None
    cursor = connection.cursor()
    for pragma in _SQLITE_PRAGMAS:
        cursor.execute(f"PRAGMA {pragma}")
    if cursor.execute("PRAGMA journal_mode").fetchone()[0] != "wal":
        cursor.execute("PRAGMA journal_mode = WAL")
    cursor.close()


def _begin_sqlite(connection: sa.Connection) -> None:
    # SQLite at once refuses a transaction that read first and now wants to write while another
    # writes. Taking the write lock first makes it wait up to busy_timeout instead.
    options = connection.get_execution_options()
    if options.get(_NO_TRANSACTION):
        return
    read_only = options.get("read_only", False)
    connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")
