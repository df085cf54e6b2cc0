"""Answers of jobs built from whole documents, which the service itself never holds."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from datetime import datetime

from service.answers.answered import Answered
from service.answers.blocks import (
    Block,
    Document,
    Entry,
    contents_of,
    target_blocks,
    timeline_blocks,
)


def blocks_of_timeline(timeline: Document) -> Iterator[Block]:
    """Yield the blocks of a complete timeline."""

    def parts(satellite: Document) -> tuple[Document, list[Document], Document]:
        about = {name: satellite[name] for name in ("id", "name")}
        rest = {k: v for k, v in satellite.items() if k not in ("id", "name", "actions")}
        return about, satellite["actions"], rest

    head = {name: value for name, value in timeline.items() if name != "satellites"}
    return timeline_blocks(head, (parts(one) for one in timeline["satellites"]))


def answered_of(timeline: str, targets: str, content: str, finished_at: datetime) -> Answered:
    """Return a job's answer from its texts; ``content`` is its scenario file."""
    blocks: list[Block] = [
        *blocks_of_timeline(json.loads(timeline)),
        *target_blocks(json.loads(targets)),
    ]

    def texts(entries: Iterable[Entry]) -> Iterator[tuple[Entry, str]]:
        return ((entry, blocks[entry.position].text) for entry in entries)

    return Answered(contents_of(blocks), texts, content, finished_at)
