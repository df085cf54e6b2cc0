"""Bring a database to the schema of this version; safe to call from many processes at once."""

from __future__ import annotations

from pathlib import Path

import sqlalchemy as sa
from alembic import command
from alembic.config import Config

import migrations
from service.db.session import make_engine

_ADVISORY_LOCK = 0x736C_6577


def upgrade(database_url: str) -> None:
    """Create or update the schema in one transaction.

    The second of two processes waits for the first (SQLite's write lock, an advisory lock on
    PostgreSQL) and then finds nothing left to do.
    """
    # A change of a large table takes as long as it takes, and so does the turn before.
    engine = make_engine(database_url, timeout_s=None)
    try:
        with engine.begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_ADVISORY_LOCK)))
            command.upgrade(config_on(connection), "head")
    finally:
        engine.dispose()


def config_on(connection: sa.Connection) -> Config:
    """Return what Alembic needs to work on a connection, in its transaction."""
    config = Config()
    folder = Path(migrations.__file__).parent
    # Alembic reads "%" in options as interpolation.
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.attributes["connection"] = connection
    return config
