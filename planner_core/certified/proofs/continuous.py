r"""A bound on plans with continuous starts.

Weak duality as in ``planner_core.certified.proofs.lagrangian``: multipliers of targets, and for
each satellite the heaviest chain of its tasks, here with starts anywhere in the accesses and each
access used at most once. ``planner_core.certified.dp.start_labels`` explains why its labels are
never worth less than the heaviest chain. Satellites turn faster than lines of sight do (those that
do not are bounded as if they did): then the earliest start is the best one, and chains are
sequences of accesses.

Battery, recorder, stations and antennas are left out, which can only raise the bound.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from planner_core.certified.dp.start_cells import Cells, cells_of
from planner_core.certified.dp.start_labels import Labels, heaviest, labels_of
from planner_core.certified.proofs.bound import Bound, accessible
from planner_core.certified.proofs.totals import totals_bound
from planner_core.certified.sizes import LABELS_PER_CELL, MAX_PAIRS
from planner_core.certified.tuning import TUNING
from planner_core.precedence.time_windows import (
    TimeWindows,
    part_of,
    time_windows_of,
    view_of,
)
from planner_core.problem import (
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
)
from planner_core.worth import surplus, weights


def quick_bound(problem: Problem) -> Bound:
    """Return the lower of the bounds that take next to no time."""
    totals, every = totals_bound(problem), accessible(problem)
    return every if totals is None or every.value <= totals.value else totals


def continuous_value(problem: Problem, multipliers: Floats, cell_s: float | None) -> float:
    """Return the bound that ``multipliers`` prove. This is the whole proof: it needs no search.

    Parameters
    ----------
    cell_s
        Width of cells. Narrow ones usually prove more, but not at all multipliers.
    """
    if np.any(multipliers < problem.best_worth):
        dual = ContinuousDual.of(problem, cell_s or width_for(problem))
        if dual is not None:
            value, _ = dual.at(multipliers)
            return value
    # Multipliers of the targets' best worth leave nothing to earn on any chain.
    return float(problem.best_worth.sum())


def width_for(problem: Problem) -> float:
    """Return the width of cells at which tables are small enough for a machine."""
    width_s = TUNING.widths_s[0] * num_followers(problem, TUNING.widths_s[0]) / MAX_PAIRS
    return float(np.clip(width_s, *TUNING.widths_s))


def rough_cell_s() -> float:
    """Return the width of cells for a search that only needs a rough direction."""
    return TUNING.several * TUNING.widths_s[0]


def num_followers(problem: Problem, width_s: float) -> float:
    """Return an estimate of how many followers the tables of all satellites have."""
    count = 0.0
    for index in range(len(problem.satellites)):
        spans = time_windows_of(problem, index)
        free_s = spans.close_s - spans.open_s
        # About four times as many tasks may come next as are open at a time.
        mean_open = float((free_s + spans.length_s).sum()) / problem.horizon_s
        count += 4.0 * mean_open * float((free_s / width_s + 1.0).sum())
    return count


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ContinuousDual:
    """The dual function: its value at any multipliers is a bound.

    Attributes
    ----------
    parts
        Pieces of the satellites' days, of which one chain each is taken. A chain of a whole day
        consists of at most one chain of each piece, so their worths together bound it.
    is_offered
        Whether any access images the target. Shape ``(num_targets,)``.
    """

    problem: Problem
    parts: tuple[tuple[Cells, Labels], ...]
    is_offered: Bools

    @classmethod
    def of(
        cls, problem: Problem, width_s: float, stop: Bytes | None = None
    ) -> ContinuousDual | None:
        """Return it; None if ``stop`` is set."""
        parts = []
        is_offered = np.zeros(len(problem.target_ids), dtype=np.bool_)
        for index in range(len(problem.satellites)):
            spans = time_windows_of(problem, index)
            is_offered[spans.site] = True
            for piece in pieces_of(spans):
                if stop is not None and stop[0]:
                    return None
                if len(piece.row) == 0:
                    continue
                cells = cells_of(piece, view_of(problem, index), width_s)
                parts.append((cells, labels_of(cells, LABELS_PER_CELL)))
        return cls(problem=problem, parts=tuple(parts), is_offered=is_offered)

    def clipped(self, multipliers: Floats) -> Floats:
        """Return multipliers within 0 and the best worth; 0 for targets without an access."""
        return np.where(self.is_offered, surplus(multipliers, self.problem.best_worth), 0.0)

    def at(self, multipliers: Floats, *, is_exact: bool = True) -> tuple[float, Ints]:
        """Return the value at these multipliers, and how often their chains take each target.

        Only the exact value is a bound.
        """
        multiplier = self.clipped(multipliers)
        total = float(multiplier.sum())
        counts = np.zeros(len(multiplier), dtype=np.int32)
        for number in range(len(self.parts)):
            value, taken = self.chain(number, multiplier, is_exact=is_exact)
            total += value
            np.add.at(counts, taken, 1)
        return total, counts

    def chain(self, number: int, multiplier: Floats, *, is_exact: bool) -> tuple[float, Ints]:
        """Return the worth of one part's heaviest chain, and the targets that it is paid for."""
        cells, labels = self.parts[number]
        worth = self.problem.worth[cells.spans.row]
        weight = weights(worth, multiplier[cells.spans.site])
        value, slot = heaviest(cells, weight, labels, LABELS_PER_CELL, is_exact)
        taken = []
        while slot >= 0:
            task = cells.task[slot // LABELS_PER_CELL]
            if labels.is_paid[slot] and worth[task] >= multiplier[cells.spans.site[task]]:
                taken.append(cells.spans.site[task])
            slot = int(labels.parent[slot])
        return value, np.array(taken, dtype=np.int32)


def pieces_of(spans: TimeWindows) -> list[TimeWindows]:
    """Return tasks in pieces of a day: cut where nothing is open, and long ones where little is."""
    ends_s = np.maximum.accumulate(spans.close_s + spans.length_s)
    is_clear = spans.open_s[1:] >= ends_s[:-1] + TUNING.tidy_s
    pieces: list[TimeWindows] = []
    left = [
        part_of(spans, slice(a, b))
        for a, b in itertools.pairwise([0, *(np.flatnonzero(is_clear) + 1), len(spans.row)])
    ]
    while left:
        piece = left.pop()
        if len(piece.row) < 2 or piece.open_s[-1] - piece.open_s[0] < TUNING.longest_piece_s:
            pieces.append(piece)
            continue
        inner = np.flatnonzero(
            (piece.open_s > piece.open_s[0] + TUNING.longest_piece_s / 3.0)
            & (piece.open_s < piece.open_s[-1] - TUNING.longest_piece_s / 3.0)
        )
        if len(inner) == 0:
            inner = np.array([len(piece.row) // 2])
        still_open = [np.count_nonzero(piece.close_s[:at] >= piece.open_s[at]) for at in inner]
        cut = int(inner[np.argmin(still_open)])
        left += [part_of(piece, slice(0, cut)), part_of(piece, slice(cut, None))]
    return pieces
