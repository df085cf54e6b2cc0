"""Two files of the suite side by side, as a Markdown table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.suite.engine import LEVELS
from benchmarks.suite.rows import Row

WORSE_POINTS: Final = 0.1  # of gap
WORSE_RATIO: Final = 1.1  # of time
_SHIFT_S: Final = 0.1  # of the geometric means, so that hundredths of a second do not decide
_SLACK: Final = 1e-9  # tolerance for what is just not worse

Pair = tuple[Row, Row]


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One family: its figures before and after, and which of them are worse.

    Attributes
    ----------
    ratios
        CPU seconds to each gap of ``LEVELS``, after over before; None if neither reached it.
    failures
        Cases with an answer before and none after.
    """

    family: str
    num_cases: int
    gap_before: float
    gap_after: float
    ratios: tuple[float | None, ...]
    memory: float
    failures: int

    @property
    def points(self) -> float:
        """By how many percentage points the gap has grown."""
        if self.gap_before == self.gap_after:
            return 0.0
        return self.gap_after - self.gap_before

    @property
    def worse(self) -> tuple[str, ...]:
        """The figures that are worse by more than the suite allows."""
        found = ["gap"] if self.points > WORSE_POINTS + _SLACK else []
        for level, ratio in zip(LEVELS, self.ratios, strict=True):
            if ratio is not None and ratio > WORSE_RATIO + _SLACK:
                found.append(f"time to {100.0 * level:g} %")
        if self.failures:
            found.append(f"{self.failures} without an answer")
        return tuple(found)


def markdown(before: Sequence[Row], after: Sequence[Row]) -> str:
    """Return the table, a line per family, and below it the cases that only one file holds."""
    pairs, lonely = matched(before, after)
    levels = [f"time to {100.0 * level:g} %" for level in LEVELS]
    head = ["family", "cases", "gap % before", "after", "points", *levels, "memory", "worse"]
    lines = [head, ["---", *["---:"] * (len(head) - 2), "---"]]
    families = list(dict.fromkeys(row.family for row, _ in pairs))
    table = [line_of([pair for pair in pairs if pair[0].family == name]) for name in families]
    lines += [_cells(line) for line in table]
    text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    num_worse = sum(bool(line.worse) for line in table)
    text += f"\n\n{_revisions(before)} before, {_revisions(after)} after; "
    text += f"{num_worse} of {len(table)} families worse.\n"
    if lonely:
        text += "\nIn one file only: " + ", ".join(lonely) + ".\n"
    return text


def matched(before: Iterable[Row], after: Iterable[Row]) -> tuple[list[Pair], list[str]]:
    """Return the rows of the same case in pairs, and the names of cases without a partner."""
    old, new = ({row.case: row for row in rows} for rows in (before, after))
    pairs = [(row, new[case]) for case, row in old.items() if case in new]
    return pairs, [
        f"{case.family} draw {case.draw} seed {case.seed} in {case.budget_s:g} s"
        for case in (*old, *new)
        if (case in old) != (case in new)
    ]


def line_of(pairs: Sequence[Pair]) -> Line:
    """Return the comparison of one family."""
    both = [(a, b) for a, b in pairs if not a.failure and not b.failure]
    return Line(
        family=pairs[0][0].family,
        num_cases=len(pairs),
        gap_before=_mean(_gap(a) for a, _ in both),
        gap_after=_mean(_gap(b) for _, b in both),
        ratios=tuple(_time_ratio(both, i) for i in range(len(LEVELS))),
        memory=math.exp(_mean(math.log(_known(b.peak_mb) / _known(a.peak_mb)) for a, b in both)),
        failures=sum(bool(b.failure) and not a.failure for a, b in pairs),
    )


def _time_ratio(pairs: Sequence[Pair], level: int) -> float | None:
    """Return the ratio of shifted geometric means of the seconds to a gap.

    A run that did not reach it counts with all the time it used, less than it would need.
    """
    logs = []
    for a, b in pairs:
        before_s, after_s = a.to_level_s[level], b.to_level_s[level]
        if before_s is None and after_s is None:
            continue
        before_s = _known(a.used_s) if before_s is None else before_s
        after_s = _known(b.used_s) if after_s is None else after_s
        logs.append(math.log((after_s + _SHIFT_S) / (before_s + _SHIFT_S)))
    return math.exp(_mean(logs)) if logs else None


def _gap(row: Row) -> float:
    return math.inf if row.gap_percent is None else row.gap_percent


def _known(value: float | None) -> float:
    assert value is not None, "a row with an answer has its seconds and its memory"
    return value


def _mean(values: Iterable[float]) -> float:
    known = list(values)
    return math.fsum(known) / len(known) if known else math.nan


def _cells(line: Line) -> list[str]:
    ratios = ["-" if ratio is None else f"x {ratio:.2f}" for ratio in line.ratios]
    gaps = [f"{line.gap_before:.2f}", f"{line.gap_after:.2f}", f"{line.points:+.2f}"]
    worse = "**" + ", ".join(line.worse) + "**" if line.worse else ""
    return [line.family, str(line.num_cases), *gaps, *ratios, f"x {line.memory:.2f}", worse]


def _revisions(rows: Iterable[Row]) -> str:
    return ", ".join(dict.fromkeys(row.revision or "unknown" for row in rows)) or "nothing"
