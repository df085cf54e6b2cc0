"""Bring a database to this version's schema; many processes may call it at once."""

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

    If two processes call it, the second waits for the first (SQLite's write lock, an advisory
    lock on PostgreSQL) and then has nothing to do.
    """
    # No timeout: changing a large table may take long, as may waiting for another process.
    engine = make_engine(database_url, timeout_s=None)
    try:
        with engine.begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_ADVISORY_LOCK)))
            command.upgrade(config_on(connection), "head")
    finally:
        engine.dispose()


def config_on(connection: sa.Connection) -> Config:
    """Return the Alembic configuration for working on a connection, in its transaction."""
    config = Config()
    folder = Path(migrations.__file__).parent
    # Alembic reads "%" in options as interpolation.
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.attributes["connection"] = connection
    return config
