"""A clock that older SQLite versions lack, for all engines of this process.

With Python 3.12 and later, DBOS asks SQLite for ``unixepoch('subsec')``, which came with SQLite
3.42 and is NULL before. Python may be linked with an older one (Debian 12 has 3.40).
DBOS makes engines of its own, so the function is added to all.
"""

from __future__ import annotations

import sqlite3
import time
from typing import Final

import sqlalchemy as sa

FIRST_WITH_SUBSEC: Final = (3, 42)


def add_sqlite_clock() -> None:
    """Give every new SQLite connection ``unixepoch('subsec')`` if SQLite lacks it."""
    if sqlite3.sqlite_version_info < FIRST_WITH_SUBSEC:
        sa.event.listen(sa.Engine, "connect", _add_clock)


def unixepoch(argument: object) -> float | int | None:
    """Return seconds since 1970 like SQLite's ``unixepoch(argument)``, but only for now."""
    if argument == "subsec":
        return time.time()
    return int(time.time()) if argument == "now" else None


def _add_clock(connection: object, _record: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        connection.create_function("unixepoch", 1, unixepoch)
