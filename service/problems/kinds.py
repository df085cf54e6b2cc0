"""Every kind of problem the service answers with: status, title, and what to do about it."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import Final

from planner_core.errors import Fault


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A row of the table that ``GET /problems/{code}`` explains."""

    status: int
    title: str
    explanation: str


class ServiceError(Exception):
    """An error of the service itself, as opposed to one of the planner.

    Parameters
    ----------
    code
        A key of ``KINDS``; gives the status.
    detail
        One sentence for people.
    faults
        Places in the body or file, where there are any.
    headers
        Extra response headers, such as ``Retry-After``.
    """

    def __init__(
        self,
        code: str,
        detail: str,
        *,
        faults: tuple[Fault, ...] = (),
        headers: dict[str, str] | None = None,
    ):
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.faults = faults
        self.headers = headers or {}


def _table() -> dict[str, ProblemKind]:
    text = (files(__package__) / "kinds.csv").read_text(encoding="utf-8")
    return {
        row["code"]: ProblemKind(int(row["status"]), row["title"], row["explanation"])
        for row in csv.DictReader(text.splitlines())
    }


KINDS: Final = _table()
"""All codes. `kind_of` also serves one that is missing here: as data that is wrong, 422."""


def kind_of(code: str) -> ProblemKind:
    """Return the kind of a code.

    >>> kind_of("tle_checksum").title
    'TLE checksum mismatch'
    """
    known = KINDS.get(code)
    if known is not None:
        return known
    title = code.replace("_", " ").capitalize()
    return ProblemKind(422, title, "The data is wrong in the place that the problem names.")
