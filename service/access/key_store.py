"""API keys in the database: create, list, revoke, look up."""

from __future__ import annotations

import hmac
from collections.abc import Collection, Sequence
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.access.callers import Caller, Scope
from service.access.tokens import digest_of, key_id_of, new_token
from service.db.clock import utc_now
from service.db.rows import ApiKeyRow
from service.db.session import changed

_SECONDS_A_DAY: Final = 86_400.0

_OF_A_CALLER: Final = (
    ApiKeyRow.id, ApiKeyRow.owner, ApiKeyRow.scope, ApiKeyRow.name, ApiKeyRow.token_sha256
)  # fmt: skip


def create(
    session: Session, *, name: str, owner: str, scope: Scope, expires_days: float
) -> tuple[str, str]:
    """Store a new key. Return its id and its token, which cannot be recovered later."""
    key_id, token = new_token()
    session.execute(
        sa.insert(ApiKeyRow).values(
            id=key_id,
            name=name,
            owner=owner,
            scope=scope.value,
            token_sha256=digest_of(token),
            created_at=utc_now(),
            expires_at=utc_now(expires_days * _SECONDS_A_DAY),
        )
    )
    return key_id, token


def every_key(session: Session) -> Sequence[tuple[ApiKeyRow, bool]]:
    """Return all keys, oldest first, each with whether it is valid now."""
    rows = session.execute(
        sa.select(ApiKeyRow, _is_good()).order_by(ApiKeyRow.created_at, ApiKeyRow.id)
    )
    return [(row, bool(is_good)) for row, is_good in rows]


def revoke(session: Session, key_id: str) -> bool:
    """Invalidate a key from now on; return whether it existed and was not yet revoked."""
    is_good = sa.and_(ApiKeyRow.id == key_id, ApiKeyRow.revoked_at.is_(None))
    return changed(session, ApiKeyRow, is_good, ApiKeyRow.id, revoked_at=utc_now()) is not None


def has_key(session: Session, key_id: str) -> bool:
    """Return whether there is a key with this id, valid or not."""
    return session.scalar(sa.select(ApiKeyRow.id).where(ApiKeyRow.id == key_id)) is not None


def ended_of(connection: sa.Connection, key_ids: Collection[str]) -> set[str]:
    """Return which of these stored keys are revoked or expired by now."""
    ended = sa.select(ApiKeyRow.id).where(ApiKeyRow.id.in_(key_ids), ~_is_good())
    return set(connection.scalars(ended))


def has_good_key(session: Session) -> bool:
    """Return whether any key is valid now."""
    return session.scalar(sa.select(ApiKeyRow.id).where(_is_good()).limit(1)) is not None


def callers_of(connection: sa.Connection, tokens: Collection[str]) -> dict[str, Caller]:
    """Return the callers of these tokens, without wrong, expired or revoked ones."""
    key_ids = {token: key_id for token in tokens if (key_id := key_id_of(token)) is not None}
    if not key_ids:
        return {}
    good = sa.select(*_OF_A_CALLER).where(ApiKeyRow.id.in_(set(key_ids.values())), _is_good())
    rows = {row.id: row for row in connection.execute(good)}
    return {
        token: Caller(owner=row.owner, scope=Scope(row.scope), key_id=row.id, key_name=row.name)
        for token, key_id in key_ids.items()
        if (row := rows.get(key_id)) is not None
        and hmac.compare_digest(row.token_sha256, digest_of(token))
    }


def _is_good() -> sa.ColumnElement[bool]:
    return sa.and_(ApiKeyRow.revoked_at.is_(None), ApiKeyRow.expires_at > utc_now())
