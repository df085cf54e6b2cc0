"""Answers stored under callers' idempotency keys, so that requests can be resent safely."""

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
    """A stored answer. ``body`` is JSON text."""

    status: int
    headers: dict[str, str]
    body: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Keyed:
    """A request with an idempotency key.

    Attributes
    ----------
    request_sha256
        Hash of everything that identifies the request: call, query and body.
    keep_s
        How long its answer is kept.
    """

    tenant: str
    key: str
    request_sha256: str
    keep_s: float


class KeyReused(Exception):
    """The key was used for another request."""


def find(session: Session, keyed: Keyed) -> KeptAnswer | None:
    """Return the earlier answer to this request, or None.

    Raises
    ------
    KeyReused
        If the key was used for another request.
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
    """Claim the key for this transaction; return the answer if another request has one.

    Of two simultaneous requests, the second waits here until the first has ended, and then sees
    its answer, or claims the key if the first has failed.
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
    """Delete this key if it has expired, and some other expired ones, to limit their number."""
    has_expired = IdempotencyKeyRow.created_at < utc_now(-keyed.keep_s)
    session.execute(sa.delete(IdempotencyKeyRow).where(_own(keyed), has_expired))
    names = (IdempotencyKeyRow.tenant, IdempotencyKeyRow.key)
    # Rows that another transaction is sweeping are skipped (PostgreSQL; SQLite has one writer).
    old = sa.select(*names).where(has_expired).limit(_SWEPT_AT_ONCE)
    old = old.with_for_update(skip_locked=True)
    expired = [tuple(row) for row in session.execute(old)]
    if expired:
        session.execute(sa.delete(IdempotencyKeyRow).where(sa.tuple_(*names).in_(expired)))
