"""The ablation's rows as a page: the gain of each strategy, and the effect of the constants."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.ablation.constants import FACTORS
from benchmarks.ablation.strategies import NOTHING
from benchmarks.ablation.trials import Trial
from benchmarks.suite.compare import Line, line_of
from benchmarks.suite.engine import LEVELS, Case

POINTS: Final = 0.2  # of gap
RATIO: Final = 1.1  # of time
LABELS: Final = tuple(f" {label}" for label in FACTORS)
"""Endings of the names of changed constants."""

_CONSTANTS: Final = """\
One draw of each family, with half and double of each constant that acts there. One image is 0.1 to
0.4 points, and on a busy machine times vary by a third: a "yes" counts only if both other values
are worse, or one of them by several images. If no line marks a constant, any value in a wide range
is as good as its own.

Left out are `aimed` and `tie`, which are compiled into kernels, and two families in which the last
big step of the search comes near the end of the time (`weights-1000`, `fleet-stations-4x2000`): run
beside other work, their results depended more on that work than on the constants.
"""

_HEAD: Final = """\
# What the engine's parts are worth

`python -m benchmarks.ablation` plans cases of the suite with one thing changed: a strategy left
out, or a constant halved or doubled (for a share above one half, its distance from 1). Its rows are
in [ablation.csv](ablation.csv), from which this page is generated. Each change is compared with the
unchanged solver on the same draws, with the same seeds and CPU seconds.

A strategy earns its place if, without it, the gap grows by more than 0.2 percentage points on some
family, or the time to some gap by more than 10 %. One image is 0.1 to 0.3 points, and when the last
image is found is a matter of luck: the time to 0 % varies by a factor of two between seeds, so that
column decides nothing with two draws alone. Strategies that were not missed have since been removed
from the engine, unless they are missed elsewhere; their rows stay, with the revision that still had
them. `exhaust` matters only on smaller missions: of 240 drawn as in the tests, all were closed with
it and 222 without. `preference` saves time on the 24 satellites of `benchmarks/fleet`: they are
within 1.5 % after 28, 36 and 41 CPU seconds without it, after 35, 20 and 27 with it (seeds 0 to 2).
`a fleet's contacts exchanged` matters for real satellites over few stations (docs/bounds.md).
The strategy `windows of the first plan` is now a part of `forward search`.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A change on one family, compared with the unchanged solver."""

    change: str
    line: Line

    @property
    def is_worse(self) -> bool:
        """Whether the solver is worse with the change."""
        slower = (ratio is not None and ratio > RATIO for ratio in self.line.ratios)
        return self.line.points > POINTS or any(slower) or self.line.failures > 0

    @property
    def time(self) -> float | None:
        """The geometric mean of the ratios of times to each gap, if any was reached."""
        known = [math.log(ratio) for ratio in self.line.ratios if ratio is not None]
        return math.exp(sum(known) / len(known)) if known else None


def findings(trials: Iterable[Trial]) -> list[Finding]:
    """Return the effect of each change on each family, in the order of the rows.

    The latest row of a change and case counts, compared with the latest unchanged one before it.
    """
    plain: dict[Case, Trial] = {}
    by_change: dict[str, dict[Case, tuple[Trial, Trial]]] = {}
    for trial in trials:
        if trial.change == NOTHING:
            plain[trial.case] = trial
        elif trial.case in plain:
            pair = plain[trial.case], trial
            by_change.setdefault(trial.change, {})[trial.case] = pair
    found = []
    for change, cases in by_change.items():
        pairs = list(cases.values())
        for family in dict.fromkeys(row.family for _, row in pairs):
            own = [pair for pair in pairs if pair[1].family == family]
            found.append(Finding(change=change, line=line_of(own)))
    return found


def page(trials: Sequence[Trial]) -> str:
    """Return the page as Markdown."""
    found = findings(trials)
    about_constants = [finding for finding in found if finding.change.endswith(LABELS)]
    about_strategies = [finding for finding in found if finding not in about_constants]
    revisions = ", ".join(dict.fromkeys(trial.revision for trial in trials))
    parts = [
        _HEAD,
        f"Revisions: {revisions}.\n",
        "## Strategies\n",
        strategy_table(about_strategies),
    ]
    if about_constants:
        parts += ["## Constants\n", _CONSTANTS, constant_table(about_constants)]
    return "\n".join(parts)


def strategy_table(found: Sequence[Finding]) -> str:
    """Return a line for each strategy and family: the result without it."""
    levels = [f"time to {100.0 * level:g} %" for level in LEVELS]
    head = ["without", "family", "cases", "gap %", "then", "points", *levels, "missed"]
    rows = []
    for finding in found:
        line = finding.line
        gaps = [f"{line.gap_before:.2f}", f"{line.gap_after:.2f}", f"{line.points:+.2f}"]
        times = [_times(ratio) for ratio in line.ratios]
        missed = "**yes**" if finding.is_worse else "no"
        rows.append([finding.change, line.family, str(line.num_cases), *gaps, *times, missed])
    return _table(head, rows)


def constant_table(found: Sequence[Finding]) -> str:
    """Return a line for each constant and family: the effect of halving and doubling it."""
    pairs: dict[tuple[str, str], dict[str, Finding]] = {}
    for finding in found:
        constant, _, label = finding.change.rpartition(" ")
        pairs.setdefault((constant, finding.line.family), {})[label] = finding
    head = ["constant", "family", "half: points", "time", "double: points", "time", "matters"]
    rows = [
        [f"`{constant}`", family, *_cells(of.get("half")), *_cells(of.get("double")), _matters(of)]
        for (constant, family), of in pairs.items()
    ]
    return _table(head, rows)


def _cells(finding: Finding | None) -> list[str]:
    if finding is None:
        return ["", ""]
    if finding.line.failures:
        return ["fails", ""]
    return [f"{finding.line.points:+.2f}", _times(finding.time)]


def _times(ratio: float | None) -> str:
    return "-" if ratio is None else f"x {ratio:.2f}"


def _matters(of: Mapping[str, Finding]) -> str:
    return "**yes**" if any(finding.is_worse for finding in of.values()) else "no"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"
