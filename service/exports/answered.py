"""What every export is made of: the documents of a finished job, read once."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import Any

from planner_core.domain import Scenario
from service.scenarios.translate import scenario_from_content

Document = dict[str, Any]

_CHUNK = 1 << 16


@dataclass(frozen=True, kw_only=True, eq=False)
class Answered:
    """A finished job.

    Attributes
    ----------
    timeline
        The timeline document.
    targets
        Every target with its outcome.
    scenario
        The frozen question.
    finished_at
        When the answer was stored, in UTC.
    """

    timeline: Document
    targets: list[Document]
    scenario: Scenario
    finished_at: datetime

    @classmethod
    def of(cls, timeline: str, targets: str, content: str, finished_at: datetime) -> Answered:
        """Return what the stored texts of a job say; ``content`` is its scenario file."""
        return cls(
            timeline=json.loads(timeline),
            targets=json.loads(targets),
            scenario=scenario_from_content(json.loads(content)),
            finished_at=finished_at,
        )

    @cached_property
    def actions(self) -> dict[str, Document]:
        """Return the actions by id."""
        return {action["id"]: action for _, action in self.each_action()}

    def each_action(self) -> Iterator[tuple[Document, Document]]:
        """Yield each action behind its satellite, as the timeline has them."""
        for satellite in self.timeline["satellites"]:
            for action in satellite["actions"]:
                yield satellite, action


def compact(value: object) -> str:
    """Return JSON without blanks."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def listed(items: Iterable[str]) -> Iterator[str]:
    """Yield the items with a comma between them."""
    separator = ""
    for item in items:
        yield separator + item
        separator = ",\n"


def in_chunks(parts: Iterable[str]) -> Iterator[str]:
    """Join small parts of a text: each piece that is sent costs the same, whatever its size.

    >>> list(in_chunks(["a", "b"]))
    ['ab']
    """
    waiting: list[str] = []
    size = 0
    for part in parts:
        waiting.append(part)
        size += len(part)
        if size >= _CHUNK:
            yield "".join(waiting)
            waiting, size = [], 0
    if waiting:
        yield "".join(waiting)
