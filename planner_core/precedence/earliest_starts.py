"""Earliest starts of one satellite's next task, tabulated over cells of starts.

Each task's starts are cut into cells. For each cell the table lists the tasks that may come next,
in order of their earliest start after a start at the cell's left edge. While lines of sight turn
more slowly than the satellite, a later start never allows the next task to start earlier: each
entry is a lower bound for every start in the cell.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.precedence.time_windows import TimeWindows, View
from planner_core.problem import (
    Bytes,
    Floats,
    Ints,
    Longs,
)
from planner_core.problem.pointing import earliest_start_s, needed_s, sight
from planner_core.problem.slew import slew_s
from planner_core.sorting import first_not_below

Singles = npt.NDArray[np.float32]

EARLY_S: Final = 3e-3
"""The most by which ``earliest_start_s`` may exceed the earliest instant, rounding to whole
milliseconds and tolerance included."""


@bundle
class EarliestStarts(NamedTuple):
    """Cells, and the tasks that may follow each.

    Attributes
    ----------
    width_s
        Of a cell; a task's last one may be narrower.
    first_cell
        First cell of each task. Shape ``(n + 1,)``.
    first_arc
        First entry of each cell in ``to``. Shape ``(num_cells + 1,)``.
    to
        Tasks that may follow. Shape ``(num_arcs,)``.
    after_s
        Seconds from the cell's left edge to their earliest start after it, less ``EARLY_S``.
    slope
        An estimate of how much later they start per second that the start in the cell is later.
    """

    width_s: float
    first_cell: Ints
    first_arc: Longs
    to: Ints
    after_s: Singles
    slope: Singles


def num_cells(spans: TimeWindows, width_s: float) -> Ints:
    """Return the number of cells of each task. Shape ``(n,)``."""
    count = np.ceil((spans.close_s - spans.open_s) / width_s - 1e-9)
    return np.maximum(count, 1.0).astype(np.int32)


def earliest_starts_of(
    spans: TimeWindows, view: View, width_s: float, stop: Bytes | None = None
) -> EarliestStarts:
    """Return the table of one satellite's tasks.

    Once ``stop[0]`` is non-zero it ends early, and the remaining tasks have no followers.
    """
    stop = np.zeros(1, dtype=np.uint8) if stop is None else stop
    first_cell = np.concatenate([[0], np.cumsum(num_cells(spans, width_s))]).astype(np.int32)
    first_arc, to, after_s, slope = _tabulate(spans, view, width_s, first_cell, stop)
    return EarliestStarts(width_s, first_cell, first_arc, to, after_s, slope)


@borrowing_inner
def cell_of(earliest: EarliestStarts, spans: TimeWindows, task: int, start_s: float) -> int:
    """Return the cell that a start of a task falls into."""
    k = int((start_s - spans.open_s[task]) / earliest.width_s)
    first, end = earliest.first_cell[task], earliest.first_cell[task + 1]
    return int(min(max(first + k, first), end - 1))


@borrowing_inner
def edge_s(earliest: EarliestStarts, spans: TimeWindows, task: int, cell: int) -> float:
    """Return the left edge of a task's cell."""
    return float(spans.open_s[task] + (cell - earliest.first_cell[task]) * earliest.width_s)


@borrowing
def follows_at_s(spans: TimeWindows, view: View, a: int, start_s: float, b: int) -> float:
    """Return the earliest start of ``b`` after ``a`` at ``start_s``; infinite if there is none."""
    end_s = start_s + spans.length_s[a]
    looked = sight(view.path, view.sites_m, spans.site[a], end_s)
    return earliest_start_s(
        view.agile, end_s, looked, view.path, view.sites_m,
        spans.site[b], spans.open_s[b], spans.close_s[b],
    )  # fmt: skip


@kernel
def _tabulate(
    spans: TimeWindows, view: View, width_s: float, first_cell: Ints, stop: Bytes
) -> tuple[Longs, Ints, Singles, Singles]:
    n = len(spans.open_s)
    agile = view.agile
    turn_s = slew_s(180.0, agile.rate_deg_s, agile.acceleration_deg_s2) + agile.settle_s
    longest_s, least_s = 0.0, np.inf
    for i in range(n):
        longest_s = max(longest_s, spans.close_s[i] - spans.open_s[i])
        least_s = min(least_s, spans.length_s[i])
    opens = np.empty((n, 3))
    for i in range(n):
        opens[i] = sight(view.path, view.sites_m, spans.site[i], spans.open_s[i])
    first_arc = np.zeros(first_cell[n] + 1, dtype=np.int64)
    room = 32 * max(1, first_cell[n])
    to = np.empty(room, dtype=np.int32)
    after_s, slope = np.empty(room, dtype=np.float32), np.empty(room, dtype=np.float32)
    count = 0
    # Earliest starts after the left and after the right edge of the current cell.
    left, right = np.full(n, np.inf), np.full(n, np.inf)
    own = np.empty(n, dtype=np.int32)
    own_end_s = np.empty(n)
    own_looked = np.empty((n, 3))
    for a in range(n):
        if stop[0]:
            first_arc[first_cell[a] :] = count
            break
        from_s = spans.open_s[a] + spans.length_s[a] + agile.settle_s
        low = first_not_below(spans.open_s, from_s - longest_s)
        high = low
        for cell in range(first_cell[a], first_cell[a + 1]):
            edge = spans.open_s[a] + (cell - first_cell[a]) * width_s
            next_edge = min(edge + width_s, spans.close_s[a])
            if count + n > len(to):
                more = len(to) + n
                to = np.concatenate((to, np.empty(more, dtype=np.int32)))
                after_s = np.concatenate((after_s, np.empty(more, dtype=np.float32)))
                slope = np.concatenate((slope, np.empty(more, dtype=np.float32)))
            begin, num_own = count, 0
            far_s = np.inf
            b = low
            while b < n and spans.open_s[b] < far_s:
                if b >= high:
                    left[b] = follows_at_s(spans, view, a, edge, b)
                    right[b] = np.inf
                    if left[b] < np.inf:
                        right[b] = follows_at_s(spans, view, a, next_edge, b)
                elif cell > first_cell[a]:
                    left[b] = right[b]
                    if left[b] < np.inf:
                        right[b] = follows_at_s(spans, view, a, next_edge, b)
                if (
                    b != a
                    and left[b] < np.inf
                    and not (
                        right[b] <= spans.open_s[b] + 1e-9
                        and _is_covered(spans, view, own_end_s, own_looked, num_own, b, opens)
                    )
                ):
                    at = count
                    gap = np.float32(left[b] - edge - EARLY_S)
                    while at > begin and after_s[at - 1] > gap:
                        to[at], after_s[at], slope[at] = to[at - 1], after_s[at - 1], slope[at - 1]
                        at -= 1
                    to[at] = b
                    after_s[at] = gap
                    slope[at] = 1.0
                    if next_edge > edge + 1e-9 and right[b] < np.inf:
                        slope[at] = (right[b] - left[b]) / (next_edge - edge)
                    count += 1
                    if right[b] < np.inf:
                        end_s = right[b] + spans.length_s[b]
                        own[num_own], own_end_s[num_own] = b, end_s
                        own_looked[num_own] = sight(view.path, view.sites_m, spans.site[b], end_s)
                        num_own += 1
                        far_s = min(far_s, end_s + turn_s)
                b += 1
            high = max(high, b)
            first_arc[cell + 1] = count
    return first_arc, to[:count].copy(), after_s[:count].copy(), slope[:count].copy()


@borrowing_inner
def _is_covered(
    spans: TimeWindows,
    view: View,
    end_s: Floats,
    looked: Floats,
    count: int,
    b: int,
    opens: Floats,
) -> bool:
    """Return whether one of these tasks fits on the way to a start of ``b`` as it opens."""
    u = (opens[b, 0], opens[b, 1], opens[b, 2])
    for i in range(count):
        room_s = spans.open_s[b] - end_s[i]
        if room_s >= 0.0:
            v = (looked[i, 0], looked[i, 1], looked[i, 2])
            if needed_s(view.agile, v, u) <= room_s:
                return True
    return False
