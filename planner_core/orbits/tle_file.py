"""A text of element sets, two or three lines each, grouped line by line."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

from planner_core.errors import Fault, InvalidElements
from planner_core.orbits.element_ranges import (
    LONGEST_TEXT,
    MOST_SETS,
    is_plain_text,
    too_many_sets,
)
from planner_core.orbits.tle import TleReading, read_tle

_LONGEST_NAME = 24  # columns of a name line; a line this short is never an element line
_LONGEST_SHOWN = 40
_MOST_LINES = 3 * MOST_SETS


@dataclass(frozen=True, slots=True, kw_only=True)
class TleRecord:
    """An element set of a file; ``row`` is the line of the file that holds its line 1."""

    reading: TleReading
    row: int


@dataclass(frozen=True, slots=True)
class _Line:
    row: int
    text: str

    @property
    def kind(self) -> str:
        """``1`` or ``2`` for an element line, ``name`` for any other."""
        is_element = self.text[0] in "12" and self.text[1:2] in (" ", "\t")
        return self.text[0] if is_element and len(self.text) > _LONGEST_NAME else "name"


def read_tle_text(text: str) -> tuple[list[TleRecord], list[Fault]]:
    """Return the element sets of a text (TLE, 2LE or 3LE), and faults of what was refused.

    Blank lines and lines that start with ``#`` are skipped; a name may start with ``0``
    and a blank. After a refused set, reading resumes at the next line that can start one.

    Parameters
    ----------
    text
        Lines end in LF.
    """
    lines = list(itertools.islice(_lines(text), _MOST_LINES + 1))
    if len(lines) > _MOST_LINES:
        return [], [too_many_sets()]
    if not any(line.kind != "name" for line in lines):
        return [], [Fault("no_elements", "The text holds no line of an element set", row=1)]
    return _Grouping(lines).read()


def _lines(text: str) -> Iterator[_Line]:
    for row, line in enumerate(io.StringIO(text), start=1):
        if line.strip() and not line.startswith("#"):
            yield _Line(row, line.rstrip())


class _Grouping:
    """One pass over the lines; ``_name`` is a name line whose element set is still to come."""

    def __init__(self, lines: list[_Line]):
        self._lines = lines
        self._name: _Line | None = None
        self._records: list[TleRecord] = []
        self._faults: list[Fault] = []

    def read(self) -> tuple[list[TleRecord], list[Fault]]:
        at = 0
        while at < len(self._lines):
            at += self._step(at)
        self._drop_name()
        return self._records, self._faults

    def _step(self, at: int) -> int:
        """Read what starts at a line and return how many lines it took."""
        line = self._lines[at]
        after = self._lines[at + 1] if at + 1 < len(self._lines) else None
        if line.kind == "name":
            self._drop_name()
            self._name = line
            return 1
        if line.kind == "1" and after is not None and _start(after) == "2":
            return self._pair(line, after)
        if line.kind == "2" and after is not None and self._is_swapped(at):
            return self._pair(line, after)
        self._name = None
        missing = "2" if line.kind == "1" else "1"
        detail = f"Line {line.kind} of an element set has no line {missing} beside it"
        self._faults.append(Fault("tle_missing_line", detail, row=line.row))
        return 1

    def _is_swapped(self, at: int) -> bool:
        # In "2 1 2" the first line may be stray, before a whole set: the catalogue number decides.
        two, one = self._lines[at], self._lines[at + 1]
        third = self._lines[at + 2] if at + 2 < len(self._lines) else None
        if one.kind != "1" or two.text[2:7] != one.text[2:7]:
            return False
        return third is None or third.kind != "2" or third.text[2:7] != one.text[2:7]

    def _pair(self, first: _Line, second: _Line) -> int:
        name, self._name = self._name, None
        try:
            reading = read_tle([first.text, second.text])
        except InvalidElements as error:
            self._faults.append(_at_row(error.fault, first, second))
            return 2
        named = replace(reading.elements, name=_name(name))
        if name is not None and not is_plain_text(named.name or ""):
            detail = f"The name must be printable text of at most {LONGEST_TEXT} characters"
            self._faults.append(Fault("tle_name", detail, row=name.row))
            return 2
        warnings = tuple(_at_row(warning, first, second) for warning in reading.warnings)
        reading = replace(reading, elements=named, warnings=warnings)
        self._records.append(TleRecord(reading=reading, row=first.row))
        return 2

    def _drop_name(self) -> None:
        if self._name is None:
            return
        shown = ascii(self._name.text[:_LONGEST_SHOWN])
        detail = f"No element set follows the line {shown}"
        self._faults.append(Fault("tle_missing_line", detail, row=self._name.row))
        self._name = None


def _start(line: _Line) -> str:
    # A line 2 that was cut short still counts as one after a line 1.
    return line.text[0] if line.text[1:2] in (" ", "\t") else ""


def _at_row(fault: Fault, first: _Line, second: _Line) -> Fault:
    row = second.row if fault.pointer == "/tle/1" else first.row
    return Fault(fault.code, fault.detail, row=row)


def _name(line: _Line | None) -> str | None:
    if line is None:
        return None
    return f"{line.text} ".removeprefix("0 ").strip() or None
