"""Instants as text: RFC 3339 in UTC, with milliseconds."""

from __future__ import annotations

from datetime import UTC, datetime


def instant_text(instant: datetime) -> str:
    """Return RFC 3339 in UTC with milliseconds.

    >>> instant_text(datetime(2026, 1, 1, 12, 30, 0, 250_000, tzinfo=UTC))
    '2026-01-01T12:30:00.250Z'
    """
    text = instant.astimezone(UTC).isoformat(timespec="milliseconds")
    return text.removesuffix("+00:00") + "Z"
