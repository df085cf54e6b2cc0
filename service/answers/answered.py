"""The source of every export: a finished job, read piece by piece as the export is written."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime
from functools import wraps
from typing import ParamSpec

from service.answers.chunks import (
    Document,
    Entry,
    batches,
    head_in,
    items_in,
    rest_in,
    satellite_in,
)
from service.scenarios.stored_question import StoredQuestion

__all__ = ["Answered", "Document", "chunked", "compact", "in_chunks", "listed"]

P = ParamSpec("P")

Texts = Callable[[Iterable[Entry]], Iterator[tuple[Entry, str]]]
"""Yields chunks with their texts."""

_CHUNK = 1 << 16


@dataclass(frozen=True, slots=True, kw_only=True)
class _Satellite:
    """Id and name, the chunks of its actions, and those of the fields after them."""

    about: Document
    entries: list[Entry]
    rest: list[Entry]


class Answered:
    """A finished job.

    Parameters
    ----------
    contents
        The table of contents of its answer.
    texts
        Reads chunks.
    content
        The frozen question: a canonical scenario file.

    Attributes
    ----------
    head
        The timeline document without its satellites.
    finished_at
        When the answer was stored, in UTC.
    """

    def __init__(
        self, contents: Iterable[Entry], texts: Texts, content: str, finished_at: datetime
    ):
        self._texts = texts
        self.question = StoredQuestion(content)
        self.finished_at = finished_at
        known = list(contents)
        self._targets = [entry for entry in known if entry.kind == "targets"]
        self._satellites: list[_Satellite] = []
        told = [entry for entry in known if entry.kind in ("head", "satellite")]
        names = {entry.position: text for entry, text in texts(told)}
        self.head = head_in(names[told[0].position])
        for entry in known:
            if entry.kind == "satellite":
                about = satellite_in(names[entry.position])
                self._satellites.append(_Satellite(about=about, entries=[], rest=[]))
            elif entry.kind == "actions":
                self._satellites[-1].entries.append(entry)
            elif entry.kind == "rest":
                self._satellites[-1].rest.append(entry)

    @property
    def satellites(self) -> list[Document]:
        """Return id and name of each satellite, as in the timeline."""
        return [satellite.about for satellite in self._satellites]

    def actions_of(self, number: int) -> Iterator[Document]:
        """Yield the actions of the satellite with this index."""
        for _, text in self._texts(self._satellites[number].entries):
            yield from items_in(text)

    def each_action(self) -> Iterator[tuple[Document, Document]]:
        """Yield each satellite and action as a pair."""
        for number, satellite in enumerate(self._satellites):
            for action in self.actions_of(number):
                yield satellite.about, action

    def each_image_on_board(self) -> Iterator[Document]:
        """Yield the outcome of each image that was on board at the start."""
        began_with = {one.satellite_id for one in self.question.states if one.on_board}
        for satellite in self._satellites:
            if satellite.about["id"] in began_with:
                text = "".join(text for _, text in self._texts(satellite.rest))
                yield from rest_in(text).get("on_board", ())

    def each_target(self) -> Iterator[Document]:
        """Yield each target with its outcome."""
        for _, text in self._texts(self._targets):
            yield from items_in(text)


def compact(value: object) -> str:
    """Return JSON without white space."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def listed(items: Iterable[str]) -> Iterator[str]:
    """Yield the items separated by commas."""
    separator = ""
    for item in items:
        yield separator + item
        separator = ",\n"


def in_chunks(parts: Iterable[str]) -> Iterator[str]:
    """Join small parts of a text, since sending a piece costs the same whatever its size.

    >>> list(in_chunks(["a", "b"]))
    ['ab']
    """
    return map("".join, batches(parts, len, _CHUNK))


def chunked(write: Callable[P, Iterable[str]]) -> Callable[P, Iterator[str]]:
    """Let a writer yield parts of any size: they are joined to chunks for sending."""

    @wraps(write)
    def written(*arguments: P.args, **named: P.kwargs) -> Iterator[str]:
        return in_chunks(write(*arguments, **named))

    return written
