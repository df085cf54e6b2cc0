"""Answers of jobs, written and read chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from datetime import datetime
from operator import attrgetter
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from service.answers.chunks import TIMELINE, Chunk, Entry, Kind, batches, contents_of
from service.db.clock import utc_now
from service.db.rows import JobChunkRow, JobResultRow

_AT_ONCE: Final = 1 << 17
"""Characters per statement that reads or writes."""
_SIZE: Final = attrgetter("size")
_TOLD: Final = ("position", "kind", "first", "num_items", "size")
"""Fields that a table of contents and its row share."""


def save(
    session: Session, job_id: str, chunks: Sequence[Chunk], figures: Mapping[str, Any] | None
) -> None:
    """Store the answer of a job."""
    session.execute(
        sa.insert(JobResultRow).values(
            job_id=job_id,
            figures=sa.null() if figures is None else dict(figures),
            created_at=utc_now(),
        )
    )
    for some in batches(contents_of(chunks), _SIZE, _AT_ONCE):
        rows = [
            {name: getattr(entry, name) for name in _TOLD}
            | {"job_id": job_id, "tally": dict(entry.tally) or None}
            | {"text": chunks[entry.position].text}
            for entry in some
        ]
        session.execute(sa.insert(JobChunkRow), rows)


def answered_at(session: Session, job_id: str) -> datetime | None:
    """Return when a job's answer was stored, or None if it has none (yet)."""
    return session.scalar(sa.select(JobResultRow.created_at).where(JobResultRow.job_id == job_id))


def contents(session: Session, job_id: str, *kinds: Kind) -> list[Entry]:
    """Return the chunks of these kinds in the table of contents of a job's answer."""
    row = JobChunkRow
    columns = [getattr(row, name) for name in _TOLD]
    wanted = sa.select(row.tally, *columns).where(row.job_id == job_id, row.kind.in_(kinds))
    return [
        Entry(tally=tally or {}, **dict(zip(_TOLD, told, strict=True)))
        for tally, *told in session.execute(wanted.order_by(row.position))
    ]


def texts(
    reading: Callable[[], AbstractContextManager[Session]], job_id: str, entries: Iterable[Entry]
) -> Iterator[tuple[Entry, str]]:
    """Yield chunks with their texts, a few at a time.

    Each batch is read in a transaction of its own, so that a slow reader keeps no connection
    from others; this is safe because answers never change.
    """
    for some in batches(entries, _SIZE, _AT_ONCE):
        wanted = sa.select(JobChunkRow.position, JobChunkRow.text).where(
            JobChunkRow.job_id == job_id,
            JobChunkRow.position.in_([entry.position for entry in some]),
        )
        with reading() as session:
            found = {row.position: row.text for row in session.execute(wanted)}
        for entry in some:
            yield entry, found.pop(entry.position)


def timeline_of(session: Session, job_id: str) -> str | None:
    """Return a job's whole timeline document, or None if there is none (yet)."""
    return _whole(session, job_id, *TIMELINE)


def proof_of(session: Session, job_id: str) -> str | None:
    """Return the proof of a job's bound as JSON text, or None if there is none."""
    return _whole(session, job_id, "proof")


def _whole(session: Session, job_id: str, *kinds: Kind) -> str | None:
    wanted = sa.select(JobChunkRow.text).where(
        JobChunkRow.job_id == job_id, JobChunkRow.kind.in_(kinds)
    )
    return "".join(session.scalars(wanted.order_by(JobChunkRow.position))) or None
