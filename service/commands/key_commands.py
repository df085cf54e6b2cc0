"""``slewline keys``: create, list and revoke API keys in the database."""

from __future__ import annotations

import argparse
import sys
from contextlib import closing
from datetime import datetime

from service.access import key_store
from service.access.audit import BY_COMMAND_LINE
from service.access.callers import Scope
from service.commands.outcome import OK, WrongInput
from service.commands.serving import settings_of
from service.commands.summary import table
from service.db.migrate import upgrade
from service.db.session import Database

_HEADER = ("id", "name", "owner", "scope", "made", "expires", "state")


def create_key(options: argparse.Namespace) -> int:
    """Store a key and print its token for the only time, alone on standard output."""
    with _database(options) as database, database.transaction() as session:
        key_id, token = key_store.create(
            session, name=options.name, owner=options.owner, scope=Scope(options.scope),
            expires_days=options.expires_days,
        )  # fmt: skip
        BY_COMMAND_LINE.record(session, "create", "key", key_id)
    print(token, flush=True)
    print(
        f"This is key {key_id} of {options.owner}, valid for {options.expires_days:g} days. Keep "
        "it safe: it is not shown again.",
        file=sys.stderr,
    )
    return OK


def list_keys(options: argparse.Namespace) -> int:
    """Print a table of all keys, including those no longer valid."""
    with _database(options) as database, database.reading() as session:
        keys = key_store.every_key(session)
    rows = [
        (key.id, key.name, key.owner, key.scope, _day(key.created_at), _day(key.expires_at),
         "good" if is_good else "revoked" if key.revoked_at else "expired")
        for key, is_good in keys
    ]  # fmt: skip
    print(table([_HEADER, *rows]))
    return OK


def revoke_key(options: argparse.Namespace) -> int:
    """Invalidate a key at once."""
    key_id = options.key_id
    with _database(options) as database, database.transaction() as session:
        is_new = key_store.revoke(session, key_id)
        if is_new:
            BY_COMMAND_LINE.record(session, "revoke", "key", key_id)
        is_known = key_store.has_key(session, key_id)
    if not is_known:
        raise WrongInput(f"there is no key {key_id!r}; see slewline keys list")
    print(f"Key {key_id} is revoked." if is_new else f"Key {key_id} was already revoked.")
    return OK


def _database(options: argparse.Namespace) -> closing[Database]:
    """Return the database with its tables created; the caller closes it."""
    url = settings_of(options).database_url
    upgrade(url)
    return closing(Database(url))


def _day(instant: datetime) -> str:
    return instant.date().isoformat()
