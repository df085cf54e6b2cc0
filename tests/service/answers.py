"""Answers of jobs built from whole documents, which the service itself never holds."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from datetime import datetime

from service.answers.answered import Answered
from service.answers.chunks import (
    Chunk,
    Document,
    Entry,
    contents_of,
    target_chunks,
    timeline_chunks,
)


def chunks_of_timeline(timeline: Document) -> Iterator[Chunk]:
    """Yield the chunks of a complete timeline."""

    def parts(satellite: Document) -> tuple[Document, list[Document], Document]:
        about = {name: satellite[name] for name in ("id", "name")}
        rest = {k: v for k, v in satellite.items() if k not in ("id", "name", "actions")}
        return about, satellite["actions"], rest

    head = {name: value for name, value in timeline.items() if name != "satellites"}
    return timeline_chunks(head, (parts(one) for one in timeline["satellites"]))


def answered_of(timeline: str, targets: str, content: str, finished_at: datetime) -> Answered:
    """Return a job's answer from its texts; ``content`` is its scenario file."""
    chunks: list[Chunk] = [
        *chunks_of_timeline(json.loads(timeline)),
        *target_chunks(json.loads(targets)),
    ]

    def texts(entries: Iterable[Entry]) -> Iterator[tuple[Entry, str]]:
        return ((entry, chunks[entry.position].text) for entry in entries)

    return Answered(contents_of(chunks), texts, content, finished_at)
