"""Every kind of problem in the service's answers: status, title, and what to do about it."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import Final

from planner_core.errors import Fault


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A row of the table behind ``GET /problems/{code}``."""

    status: int
    title: str
    explanation: str


class ServiceError(Exception):
    """An error of the service itself, as opposed to one of the planner.

    Parameters
    ----------
    code
        A key of ``KINDS``, which gives the status.
    detail
        One sentence for people.
    faults
        Locations in the body or file, if there are any.
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
"""All known codes. For any other code, `kind_of` returns wrong data, 422."""


def kind_of(code: str) -> ProblemKind:
    """Return the kind of a code.

    >>> kind_of("tle_checksum").title
    'TLE checksum mismatch'
    """
    known = KINDS.get(code)
    if known is not None:
        return known
    title = code.replace("_", " ").capitalize()
    return ProblemKind(422, title, "The data is wrong at the location that the problem names.")
