"""The documents of an answer in chunks: neither readers nor writers need to hold a whole one.

The texts of a document's chunks, concatenated, are the document (JSON). Each chunk also describes
its content, so that a reader can take only the chunks that it needs.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final, Literal, TypeVar

Document = dict[str, Any]
T = TypeVar("T")

Kind = Literal["head", "satellite", "actions", "rest", "tail", "targets", "proof"]
TIMELINE: Final[tuple[Kind, ...]] = ("head", "satellite", "actions", "rest", "tail")
"""The kinds of chunks in a timeline."""

NUM_ITEMS: Final = 200
"""Actions or targets per chunk: about 80 kB."""
NUM_CHARS: Final = 1 << 16
"""Characters per chunk that holds no items."""

_HEAD_ENDS: Final = ', "satellites": ['
_SATELLITE_ENDS: Final = ', "actions": ['
_BETWEEN: Final = ", "


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk:
    """A piece of a document.

    Attributes
    ----------
    kind
        ``head``: a timeline without its satellites. ``satellite``: id and name of one.
        ``actions``: some actions of the satellite before it. ``rest``: more text of that
        satellite, cut anywhere. ``tail``: a timeline's end. ``targets``: some outcomes.
        ``proof``: text, cut anywhere.
    first
        Index of the first action, target or satellite, from 0 through the whole document.
    num_items
        Number of actions or targets.
    tally
        For targets: the number of each ``outcome/code of the reason``.
    """

    kind: Kind
    text: str
    first: int = 0
    num_items: int = 0
    tally: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A chunk in a table of contents: without its text, whose length is ``size``."""

    position: int
    kind: Kind
    first: int
    num_items: int
    size: int
    tally: Mapping[str, int]


_TOLD: Final = ("kind", "first", "num_items", "tally")
"""Fields that a chunk and its entry share."""


def contents_of(chunks: Iterable[Chunk]) -> list[Entry]:
    """Return the table of contents of chunks in this order."""
    return [
        Entry(position=position, size=len(chunk.text), **{n: getattr(chunk, n) for n in _TOLD})
        for position, chunk in enumerate(chunks)
    ]


def timeline_chunks(
    head: Document, satellites: Iterable[tuple[Document, Iterable[Document], Document]]
) -> Iterator[Chunk]:
    """Yield the chunks of a timeline.

    Parameters
    ----------
    head
        The timeline without its satellites.
    satellites
        For each, the fields before its actions, its actions, and the fields after them.
    """
    yield Chunk(kind="head", text=json.dumps(head)[:-1] + _HEAD_ENDS)
    num_actions = 0
    for number, (about, actions, rest) in enumerate(satellites):
        comma = _BETWEEN if number else ""
        text = comma + json.dumps(about)[:-1] + _SATELLITE_ENDS
        yield Chunk(kind="satellite", text=text, first=number)
        own_first = num_actions
        for some in _groups(actions):
            text = _items_text(some, is_first=num_actions == own_first)
            yield Chunk(kind="actions", text=text, first=num_actions, num_items=len(some))
            num_actions += len(some)
        text = f"], {json.dumps(rest)[1:]}" if rest else "]}"
        yield from (Chunk(kind="rest", text=part, first=number) for part in _parts(text))
    yield Chunk(kind="tail", text="]}")


def target_chunks(targets: Iterable[Document]) -> Iterator[Chunk]:
    """Yield the chunks of a list of targets with outcomes; `targets_text` adds the brackets."""
    first = 0
    for some in _groups(targets):
        yield Chunk(
            kind="targets",
            text=_items_text(some, is_first=first == 0),
            first=first,
            num_items=len(some),
            tally=Counter(
                f"{target['outcome']}/{(target['reason'] or {}).get('code', '')}" for target in some
            ),
        )
        first += len(some)


def proof_chunks(proof: str) -> Iterator[Chunk]:
    """Yield the chunks of a proof document, given as text."""
    return (Chunk(kind="proof", text=part) for part in _parts(proof))


def holds(tally: Mapping[str, int], outcome: str | None, reason: str | None) -> bool:
    """Return whether a chunk of targets has one with this outcome and reason; None matches any.

    >>> holds({"unscheduled/battery": 2}, "unscheduled", None), holds({"collected/": 1}, None, "x")
    (True, False)
    """
    for key in tally:
        own_outcome, _, own_reason = key.partition("/")
        if outcome in (None, own_outcome) and reason in (None, own_reason):
            return True
    return False


def head_in(text: str) -> Document:
    """Return the content of a ``head``."""
    return _object(f"{text}]}}", "satellites")


def satellite_in(text: str) -> Document:
    """Return the content of a ``satellite``."""
    return _object(f"{text.removeprefix(_BETWEEN)}]}}", "actions")


def rest_in(text: str) -> Document:
    """Return the content of a satellite's ``rest``, from its joined texts."""
    rest: Document = json.loads("{" + text.removeprefix("], ")) if text != "]}" else {}
    return rest


def items_in(text: str) -> list[Document]:
    """Return the items of ``actions`` or ``targets``."""
    items: list[Document] = json.loads(f"[{text.removeprefix(_BETWEEN)}]")
    return items


def batches(items: Iterable[T], size_of: Callable[[T], int], most: int) -> Iterator[list[T]]:
    """Yield items in batches of at most this total size; a larger item is alone in its batch."""
    batch: list[T] = []
    size = 0
    for item in items:
        if batch and size + size_of(item) > most:
            yield batch
            batch, size = [], 0
        batch.append(item)
        size += size_of(item)
    if batch:
        yield batch


def timeline_text(chunks: Iterable[Chunk]) -> str:
    """Return the whole timeline among chunks."""
    return "".join(chunk.text for chunk in chunks if chunk.kind in TIMELINE)


def targets_text(chunks: Iterable[Chunk]) -> str:
    """Return the whole list of targets among chunks."""
    return f"[{''.join(chunk.text for chunk in chunks if chunk.kind == 'targets')}]"


def _items_text(items: Iterable[Document], *, is_first: bool) -> str:
    text = _BETWEEN.join(json.dumps(item) for item in items)
    return text if is_first else _BETWEEN + text


def _groups(items: Iterable[T]) -> Iterator[list[T]]:
    remaining = iter(items)
    while some := list(islice(remaining, NUM_ITEMS)):
        yield some


def _parts(text: str) -> Iterator[str]:
    return (text[at : at + NUM_CHARS] for at in range(0, len(text), NUM_CHARS))


def _object(text: str, without: str) -> Document:
    found: Document = json.loads(text)
    del found[without]
    return found
