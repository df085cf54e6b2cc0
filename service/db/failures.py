"""Temporary database errors, no fault of the service: unreachable, full or read-only."""

from __future__ import annotations

import sqlite3
from typing import Final

import sqlalchemy as sa

_AWAY: Final = "The database cannot be reached."
_BUSY: Final = "The database is too busy."
_FULL: Final = "The database has no room left."
_READ_ONLY: Final = "The database cannot be written to at the moment."
_BROKEN_DISK: Final = "The database cannot use its files."

_SQLITE: Final = {
    sqlite3.SQLITE_BUSY: _BUSY,
    sqlite3.SQLITE_LOCKED: _BUSY,
    sqlite3.SQLITE_FULL: _FULL,
    sqlite3.SQLITE_NOMEM: _FULL,
    sqlite3.SQLITE_READONLY: _READ_ONLY,
    sqlite3.SQLITE_CANTOPEN: _AWAY,
    sqlite3.SQLITE_IOERR: _BROKEN_DISK,
}

# SQLSTATE: whole codes first, then classes.
_POSTGRESQL: Final = {
    "25006": _READ_ONLY,  # read_only_sql_transaction
    "53100": _FULL,  # disk_full
    "25P03": _AWAY,  # idle_in_transaction_session_timeout
    "57014": _BUSY,  # query_canceled: a time limit of the server
    "08": _AWAY,  # connection exception
    "57": _AWAY,  # operator intervention: shutdown, recovery
    "40": _BUSY,  # transaction rollback: deadlock, serialization
    "53": _BUSY,  # insufficient resources
    "55": _BUSY,  # object not in prerequisite state: a lock not available
    "58": _BROKEN_DISK,  # system error: input or output
}


def why_unavailable(error: BaseException) -> str | None:
    """Return why the database could not serve, or None for a lasting error.

    The same work may be tried again: its transaction left no trace, unless the connection was
    lost during its commit.
    """
    if isinstance(error, sa.exc.TimeoutError):  # no free connection
        return _BUSY
    if not isinstance(error, sa.exc.DBAPIError):
        return None
    driver_error = error.orig
    if isinstance(driver_error, sqlite3.Error):
        # The low byte is the error; the higher bits are its variants.
        code = getattr(driver_error, "sqlite_errorcode", None)
        return None if code is None else _SQLITE.get(code & 0xFF)
    state = getattr(driver_error, "sqlstate", None)
    if state is None:
        # The error comes from the driver itself, not from the server.
        lost = error.connection_invalidated or isinstance(error, sa.exc.OperationalError)
        return _AWAY if lost else None
    return _POSTGRESQL.get(state) or _POSTGRESQL.get(state[:2])
