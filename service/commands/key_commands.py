"""``slewline keys``: make, list and revoke API keys in the database."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from datetime import datetime

from service.access import key_store
from service.access.audit import BY_COMMAND_LINE
from service.access.callers import Scope
from service.commands.summary import table
from service.db.migrate import upgrade
from service.db.rows import ApiKeyRow
from service.db.session import Database
from service.settings import Settings

_HEADER = ("id", "name", "owner", "scope", "made", "expires", "state")


class NoSuchKey(Exception):
    """There is no key of this id."""


def create_key(
    settings: Settings, *, name: str, owner: str, scope: Scope, expires_days: float
) -> None:
    """Store a key and print its token, this once: the token alone on standard output."""
    database = _migrated(settings)
    with database.transaction() as session:
        key_id, token = key_store.create(
            session, name=name, owner=owner, scope=scope, expires_days=expires_days
        )
        BY_COMMAND_LINE.record(session, "create", "key", key_id)
    database.close()
    print(token, flush=True)
    print(
        f"This is key {key_id} of {owner}, good for {expires_days:g} days. "
        "Keep it safe: it is not shown again.",
        file=sys.stderr,
    )


def list_keys(settings: Settings) -> None:
    """Print a table of all keys, those that are no longer good included."""
    database = _migrated(settings)
    with database.reading() as session:
        keys = key_store.every_key(session)
    database.close()
    print(table([_HEADER, *_lines(keys)]))


def revoke_key(settings: Settings, key_id: str) -> None:
    """Make a key worthless at once.

    Raises
    ------
    NoSuchKey
        Where there never was one of this id.
    """
    database = _migrated(settings)
    with database.transaction() as session:
        is_new = key_store.revoke(session, key_id)
        if is_new:
            BY_COMMAND_LINE.record(session, "revoke", "key", key_id)
        is_known = key_store.has_key(session, key_id)
    database.close()
    if not is_known:
        raise NoSuchKey
    print(f"Key {key_id} is revoked." if is_new else f"Key {key_id} was revoked before.")


def _migrated(settings: Settings) -> Database:
    upgrade(settings.database_url)
    return Database(settings.database_url)


def _lines(keys: Sequence[tuple[ApiKeyRow, bool]]) -> list[tuple[str, ...]]:
    return [
        (
            key.id,
            key.name,
            key.owner,
            key.scope,
            _day(key.created_at),
            _day(key.expires_at),
            "good" if is_good else "revoked" if key.revoked_at else "expired",
        )
        for key, is_good in keys
    ]


def _day(instant: datetime) -> str:
    return instant.date().isoformat()
