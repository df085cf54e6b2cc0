"""Ways to make a database refuse to be written, and to make it writable again."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import sqlalchemy as sa

NO_LIMIT = resource.RLIM_INFINITY


@contextmanager
def sqlite_pragma(engine: sa.Engine, while_broken: str, again: str) -> Iterator[None]:
    """Set a pragma on each connection that this engine hands out, and undo it afterwards."""
    now = while_broken

    def prepare(connection: Any, *_: object) -> None:
        connection.execute(f"PRAGMA {now}")

    sa.event.listen(engine, "checkout", prepare)
    try:
        yield
    finally:
        now = again
        with engine.connect():
            pass  # the one idle connection
        sa.event.remove(engine, "checkout", prepare)
        engine.dispose()


@contextmanager
def no_room_for(*pids: int) -> Iterator[None]:
    """Let no file of these processes grow, as on a full disk; works only on Linux."""
    for pid in pids:
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (1, NO_LIMIT))
    try:
        yield
    finally:
        for pid in pids:
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (NO_LIMIT, NO_LIMIT))


@contextmanager
def read_only_server(server_url: str) -> Iterator[None]:
    """Make all sessions of a PostgreSQL server begin read-only transactions only."""
    _set_read_only(server_url, "SET default_transaction_read_only = on")
    try:
        yield
    finally:
        _set_read_only(server_url, "RESET default_transaction_read_only")


def _set_read_only(server_url: str, change: str) -> None:
    engine = sa.create_engine(server_url, isolation_level="AUTOCOMMIT", poolclass=sa.pool.NullPool)
    wanted = "on" if change.endswith("on") else "off"
    with engine.connect() as connection:
        connection.execute(sa.text(f"ALTER SYSTEM {change}"))
        connection.execute(sa.text("SELECT pg_reload_conf()"))
    while True:
        with engine.connect() as connection:
            if connection.scalar(sa.text("SHOW default_transaction_read_only")) == wanted:
                return
        time.sleep(0.02)
