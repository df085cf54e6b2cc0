"""A copy of a SQLite database in use: complete, consistent, and checked."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from pathlib import Path

import sqlalchemy as sa


class CannotBackUp(Exception):
    """There is no backup; the message says why and what to do."""


def back_up(database_url: str, file: Path) -> None:
    """Copy the database to a new file, which gets its name only when it is complete.

    Jobs, queue and keys are in one file and copied in one transaction. Writers do not wait.

    Raises
    ------
    CannotBackUp
        If it is not a SQLite database, the file exists, or the copy is damaged.
    """
    source = _source(database_url)
    if file.exists():
        raise CannotBackUp(f"{file} exists and is not overwritten.")
    part = file.with_name(file.name + ".part")
    try:
        # The copy holds the whole database, so only its owner may read it.
        os.close(os.open(part, os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o600))
        with closing(sqlite3.connect(source)) as origin, closing(sqlite3.connect(part)) as copy:
            origin.backup(copy)
            # A single file, without a journal that could be lost or confused with another's.
            copy.execute("PRAGMA journal_mode = DELETE")
            _check(copy)
        _sync(part)
        part.rename(file)
        _sync(file.parent)
    except (OSError, sqlite3.Error) as error:
        raise CannotBackUp(f"{file}: {error}") from error
    finally:
        part.unlink(missing_ok=True)


def _source(database_url: str) -> Path:
    address = sa.make_url(database_url)
    if address.get_backend_name() != "sqlite":
        raise CannotBackUp(
            "This command copies SQLite files. For PostgreSQL: "
            "pg_dump --format=custom --file=FILE (see docs/deploy.md)."
        )
    source = Path(address.database or "")
    if not source.is_file():
        raise CannotBackUp(f"There is no database {source}.")
    return source


def _check(copy: sqlite3.Connection) -> None:
    found = [row[0] for row in copy.execute("PRAGMA integrity_check")]
    if found != ["ok"]:
        raise CannotBackUp(f"The database is damaged: {found[0]}")
    orphans = copy.execute("PRAGMA foreign_key_check").fetchall()
    if orphans:
        raise CannotBackUp(f"The database is damaged: a row of {orphans[0][0]} refers to nothing.")


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
