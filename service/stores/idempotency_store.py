"""Answers kept under the keys of their callers, so that a request can be sent again safely."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, cast

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.db.clock import utc_now
from service.db.rows import IdempotencyKeyRow
from service.db.session import inserted

_SWEPT_AT_ONCE: Final = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptAnswer:
    """What was answered. ``body`` is JSON text."""

    status: int
    headers: dict[str, str]
    body: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Keyed:
    """A request that came under a key.

    Attributes
    ----------
    request_sha256
        Of everything that makes it the same request: call, query and body.
    keep_s
        How long its answer is kept.
    """

    tenant: str
    key: str
    request_sha256: str
    keep_s: float


class KeyReused(Exception):
    """The key belongs to another request."""


def find(session: Session, keyed: Keyed) -> KeptAnswer | None:
    """Return what this request was answered before, or None.

    Raises
    ------
    KeyReused
        Where the key was used for another request.
    """
    wanted = sa.select(IdempotencyKeyRow.request_sha256, IdempotencyKeyRow.answer).where(
        _own(keyed), IdempotencyKeyRow.created_at >= utc_now(-keyed.keep_s)
    )
    found = session.execute(wanted).one_or_none()
    if found is None:
        return None
    if found.request_sha256 != keyed.request_sha256:
        raise KeyReused
    return KeptAnswer(**cast("dict[str, Any]", found.answer))


def claim(session: Session, keyed: Keyed) -> KeptAnswer | None:
    """Take the key for this transaction; return the answer where somebody else had it first.

    Of two requests at the same moment the second waits here until the first has ended, and
    then sees its answer, or takes the key where the first has failed.
    """
    _sweep(session, keyed)
    is_claimed = inserted(
        session,
        IdempotencyKeyRow,
        tenant=keyed.tenant,
        key=keyed.key,
        request_sha256=keyed.request_sha256,
        created_at=utc_now(),
    )
    return None if is_claimed else find(session, keyed)


def keep(session: Session, keyed: Keyed, answer: KeptAnswer) -> None:
    """Store the answer under the key that this transaction has claimed."""
    kept = {"status": answer.status, "headers": answer.headers, "body": answer.body}
    session.execute(sa.update(IdempotencyKeyRow).where(_own(keyed)).values(answer=kept))


def _own(keyed: Keyed) -> sa.ColumnElement[bool]:
    return sa.and_(IdempotencyKeyRow.tenant == keyed.tenant, IdempotencyKeyRow.key == keyed.key)


def _sweep(session: Session, keyed: Keyed) -> None:
    """Forget this key where it has expired, and some others, so that they do not pile up."""
    has_expired = IdempotencyKeyRow.created_at < utc_now(-keyed.keep_s)
    session.execute(sa.delete(IdempotencyKeyRow).where(_own(keyed), has_expired))
    names = (IdempotencyKeyRow.tenant, IdempotencyKeyRow.key)
    # Rows that somebody else is sweeping are left to them (PostgreSQL; SQLite has one writer).
    old = sa.select(*names).where(has_expired).limit(_SWEPT_AT_ONCE)
    old = old.with_for_update(skip_locked=True)
    expired = [tuple(row) for row in session.execute(old)]
    if expired:
        session.execute(sa.delete(IdempotencyKeyRow).where(sa.tuple_(*names).in_(expired)))
