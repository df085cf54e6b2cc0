"""The suite's CSV: one row per case, in the order in which they were run."""

from __future__ import annotations

import csv
import math
import subprocess
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from benchmarks.suite.engine import Case, Result


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One line: the case, its result, and the revision.

    Attributes
    ----------
    gap_percent, to_2_s, to_1_s, to_half_s, to_0_s
        Gap at the end; CPU seconds until it was first within 2, 1, 0.5 and 0 %, None if it never
        was.
    revision, date
        The output of ``git describe``, and the day, UTC.
    failure
        How a run without an answer ended; empty if there is one.
    """

    family: str
    draw: int
    seed: int
    budget_s: float
    reward: float | None = None
    bound: float | None = None
    gap_percent: float | None = None
    to_2_s: float | None = None
    to_1_s: float | None = None
    to_half_s: float | None = None
    to_0_s: float | None = None
    used_s: float | None = None
    peak_mb: float | None = None
    revision: str = ""
    date: str = ""
    failure: str = ""

    @property
    def case(self) -> Case:
        """The case, by which rows of two files are matched."""
        return Case(family=self.family, draw=self.draw, seed=self.seed, budget_s=self.budget_s)

    @property
    def to_level_s(self) -> tuple[float | None, ...]:
        """The seconds to the gaps of ``LEVELS``."""
        return self.to_2_s, self.to_1_s, self.to_half_s, self.to_0_s


R = TypeVar("R", bound=Row)


def row_of(case: Case, result: Result | str, kind: type[R], **more: str) -> R:
    """Return the line of a case: its result or failure, and further fields of its kind."""
    told: dict[str, Any] = {**more, "revision": revision(), "date": f"{datetime.now(UTC):%Y-%m-%d}"}
    if isinstance(result, str):
        return kind(**asdict(case), **told, failure=result)
    is_proven = math.isfinite(result.bound)
    gap = 0.0 if result.bound <= 0.0 else 1.0 - result.reward / result.bound
    to_2_s, to_1_s, to_half_s, to_0_s = (_rounded(s, 2) for s in result.to_level_s)
    return kind(
        **asdict(case),
        reward=_rounded(result.reward, 3),
        bound=_rounded(result.bound, 3) if is_proven else None,
        gap_percent=_rounded(100.0 * gap, 3) if is_proven else None,
        to_2_s=to_2_s,
        to_1_s=to_1_s,
        to_half_s=to_half_s,
        to_0_s=to_0_s,
        used_s=_rounded(result.used_s, 2),
        peak_mb=_rounded(result.peak_mb, 0),
        **told,
    )


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits) + 0.0


def revision() -> str:
    """Return git's description of the sources, or nothing outside a repository."""
    command = ["git", "describe", "--always", "--tags", "--dirty"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def read(path: Path, kind: type[R]) -> list[R]:
    """Return the rows of a file; none if it does not exist."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as lines:
        return [_parsed(record, kind) for record in csv.DictReader(lines)]


def _parsed(record: dict[str, str], kind: type[R]) -> R:
    values: dict[str, Any] = {}
    for field in fields(kind):
        text = record[field.name]
        if field.type == "str":
            values[field.name] = text
        elif field.type == "int":
            values[field.name] = int(text)
        else:
            values[field.name] = float(text) if text else None
    return kind(**values)


def append(path: Path, row: Row) -> None:
    """Append one row, below the header if it is the first."""
    path.parent.mkdir(parents=True, exist_ok=True)
    is_new = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as lines:
        writer = csv.DictWriter(lines, [field.name for field in fields(row)], lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow(asdict(row))
