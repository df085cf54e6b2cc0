"""One satellite's tasks with continuous starts, cut into cells of starts.

What labels over these cells need is computed once: the tasks that each task can lead to, the bit by
which it is remembered while its access is open, and how much earlier a chain is that leaves a task
out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.certified.sizes import OPENING_LEVELS, SLOWER
from planner_core.jit import kernel
from planner_core.precedence.earliest_starts import EarliestStarts, earliest_starts_of
from planner_core.precedence.time_windows import TimeWindows, View
from planner_core.problem import Ints
from planner_core.problem.pointing import Agile, needed_s, position_m, sight
from planner_core.problem.slew import INSTANT, angle_between_deg, slew_s

Masks = npt.NDArray[np.uint64]


@bundle
class Cells(NamedTuple):
    """One satellite's tasks cut into cells, ready for labels.

    Attributes
    ----------
    order
        Cells by left edge. Shape ``(num_cells,)``.
    task
        Of each cell. Shape ``(num_cells,)``.
    bit
        By which a task is remembered while its access is open; 0 for not at all. Shape ``(n,)``.
    opened
        Bits of the accesses that open in each second and the 0, 1, 3, 7, ... seconds after it.
    alive
        Bits of the accesses that are open at some time of each second.
    is_first
        Whether the task may come first: no other one can be done before it.
    spare_s
        How much later a chain may start if it leaves out its next task.
    """

    spans: TimeWindows
    pointing: View
    earliest: EarliestStarts
    order: Ints
    task: Ints
    bit: Masks
    opened: Masks
    alive: Masks
    is_first: npt.NDArray[np.bool_]
    spare_s: float


def cells_of(spans: TimeWindows, view: View, width_s: float) -> Cells:
    """Return a satellite's cells.

    If it turns more slowly than lines of sight do, or accelerates slowly, a later start may allow
    an earlier start of the next task. So acceleration is ignored here, and it turns a little faster
    than lines of sight at least: every chain remains one.
    """
    greatest_deg_s = greatest_rate_deg_s(spans, view)
    rate_deg_s = max(view.agile.rate_deg_s, greatest_deg_s / SLOWER)
    view = view._replace(agile=Agile(rate_deg_s, INSTANT, view.agile.settle_s))
    share = greatest_deg_s / rate_deg_s
    least_s = float(spans.length_s.min()) if len(spans.row) else 1.0
    earliest = earliest_starts_of(spans, view, min(width_s, 0.9 * least_s))
    count = np.diff(earliest.first_cell)
    task = np.repeat(np.arange(len(spans.row), dtype=np.int32), count)
    edge_s = spans.open_s[task] + earliest.width_s * (
        np.arange(len(task)) - earliest.first_cell[task]
    )
    bit = _bits(spans)
    num_seconds = int((spans.close_s + spans.length_s).max(initial=0.0)) + 2
    return Cells(
        spans=spans,
        pointing=view,
        earliest=earliest,
        order=np.argsort(edge_s, kind="stable").astype(np.int32),
        task=task,
        bit=bit,
        opened=_opened(spans, bit, num_seconds),
        alive=_alive(spans, bit, num_seconds),
        is_first=_first_tasks(spans, view),
        spare_s=least_s * (1.0 - share) / (1.0 + share),
    )


@kernel
def greatest_rate_deg_s(spans: TimeWindows, view: View) -> float:
    """Return a rate that the lines of sight of tasks never exceed.

    It is the mean rate over a second, plus what the rate can gain within one: the second derivative
    of a direction is at most twice the square of its rate, plus acceleration over range.
    """
    most = 0.0
    for i in range(len(spans.open_s)):
        t_s = spans.open_s[i]
        end_s = spans.close_s[i] + spans.length_s[i]
        site = spans.site[i]
        before = sight(view.path, view.sites_m, site, t_s)
        while t_s < end_s:
            t_s += 1.0
            now = sight(view.path, view.sites_m, site, t_s)
            x, y, z = position_m(view.path, t_s)
            x, y, z = (
                x - view.sites_m[site, 0],
                y - view.sites_m[site, 1],
                z - view.sites_m[site, 2],
            )
            rate = math.radians(angle_between_deg(before, now))
            gain = 3.0 * rate * rate + 25.0 / math.sqrt(x * x + y * y + z * z)
            most = max(most, math.degrees(rate + gain))
            before = now
    return most


@kernel
def _bits(spans: TimeWindows) -> Masks:
    """Return a bit for each task that no other one has while both accesses are open; 0 for none."""
    bit = np.zeros(len(spans.open_s), dtype=np.uint64)
    free_s = np.full(64, -np.inf)
    for i in range(len(spans.open_s)):
        for b in range(64):
            # Whole seconds apart, because ``opened`` counts in seconds.
            if free_s[b] < math.floor(spans.open_s[i]) - 1.0:
                free_s[b] = spans.close_s[i] + spans.length_s[i]
                bit[i] = np.uint64(1) << np.uint64(b)
                break
    return bit


@kernel
def _opened(spans: TimeWindows, bit: Masks, num_seconds: int) -> Masks:
    opened = np.zeros((OPENING_LEVELS, num_seconds), dtype=np.uint64)
    for i in range(len(spans.open_s)):
        opened[0, int(spans.open_s[i])] |= bit[i]
    for level in range(1, OPENING_LEVELS):
        half = 1 << (level - 1)
        for t in range(num_seconds):
            later = min(t + half, num_seconds - 1)
            opened[level, t] = opened[level - 1, t] | opened[level - 1, later]
    return opened


@kernel
def _alive(spans: TimeWindows, bit: Masks, num_seconds: int) -> Masks:
    alive = np.zeros(num_seconds, dtype=np.uint64)
    for i in range(len(spans.open_s)):
        for t in range(int(spans.open_s[i]), int(spans.close_s[i]) + 1):
            alive[t] |= bit[i]
    return alive


@kernel
def _first_tasks(spans: TimeWindows, view: View) -> npt.NDArray[np.bool_]:
    """Return which tasks no other one can precede; only those may begin a chain."""
    n = len(spans.open_s)
    is_first = np.ones(n, dtype=np.bool_)
    agile = view.agile
    turn_s = slew_s(180.0, agile.rate_deg_s, agile.acceleration_deg_s2) + agile.settle_s
    far_s = np.inf
    for b in range(n):
        if spans.open_s[b] >= far_s:
            is_first[b:] = False
            break
        looks = sight(view.path, view.sites_m, spans.site[b], spans.open_s[b])
        for a in range(b):
            end_s = spans.open_s[a] + spans.length_s[a]
            looked = sight(view.path, view.sites_m, spans.site[a], end_s)
            if end_s + needed_s(agile, looked, looks) <= spans.open_s[b]:
                is_first[b] = False
                break
        far_s = min(far_s, spans.open_s[b] + spans.length_s[b] + turn_s)
    return is_first
