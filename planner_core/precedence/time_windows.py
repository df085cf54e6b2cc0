"""One satellite's tasks with continuous starts: their time windows and lines of sight.

A task that must be kept, or a contact, has a single start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.problem import (
    COLLECT,
    Bools,
    Floats,
    Ints,
    Problem,
)
from planner_core.problem.plan import Action
from planner_core.problem.pointing import Agile, Path, agile_of

_LEAST_S = 5e-4  # half a millisecond


@bundle
class TimeWindows(NamedTuple):
    """Tasks in order of their first start; shape ``(n,)`` each.

    Attributes
    ----------
    row
        An opportunity of the access.
    site
        Row of ``View.sites_m``: the target, or a station after all targets.
    open_s, close_s
        The first and the last start.
    is_kept
        Whether the plan must take it.
    """

    row: Ints
    site: Ints
    open_s: Floats
    close_s: Floats
    length_s: Floats
    is_kept: Bools


@bundle
class View(NamedTuple):
    """The data that one satellite's lines of sight and slews are computed from.

    Attributes
    ----------
    sites_m
        Earth-fixed positions of the targets, then of the stations. Shape ``(num_sites, 3)``.
    """

    path: Path
    sites_m: Floats
    agile: Agile


def view_of(problem: Problem, index: int) -> View:
    """Return how one satellite of a problem with continuous starts sees and turns."""
    pointing = problem.pointing
    if pointing is None:
        raise ValueError("The problem has no continuous starts.")
    agility = problem.satellites[index].agility
    agile = agile_of(agility.slew_rate_deg_s, agility.acceleration_deg_s2, agility.settle_s)
    sites_m = np.concatenate([pointing.targets_m, pointing.stations_m])
    return View(pointing.paths[index], sites_m, agile)


def time_windows_of(problem: Problem, index: int) -> TimeWindows:
    """Return the windows of one satellite's collects: its accesses, or what pins leave of them."""
    table, pinned = problem.opportunities, problem.pinned
    rows = problem.satellites[index].rows
    rows = rows[table.kind[rows] == COLLECT]
    _, first = np.unique(table.access[rows], return_index=True)
    rows = rows[first]
    is_kept = np.zeros(len(table), dtype=np.bool_)
    is_kept[problem.kept_rows] = True
    length_s = table.end_s[rows] - table.start_s[rows]
    open_s = np.maximum(table.access_start_s[rows], 0.0)
    close_s = np.minimum(table.access_end_s[rows], problem.horizon_s) - length_s
    kept = is_kept[rows]
    open_s = np.where(kept, table.start_s[rows], open_s)
    close_s = np.where(kept, table.start_s[rows], close_s)
    for blocked in pinned.blocked:
        if blocked.satellite != index or COLLECT not in blocked.kinds:
            continue
        before = np.minimum(close_s, np.floor((blocked.start_s - length_s) * 1e3 + 1e-4) / 1e3)
        after = np.maximum(open_s, np.ceil(blocked.end_s * 1e3 - 1e-4) / 1e3)
        rows, length_s, kept = (np.concatenate([x, x]) for x in (rows, length_s, kept))
        open_s, close_s = np.concatenate([open_s, after]), np.concatenate([before, close_s])
        # An access after the blocked span has no part before it, and vice versa.
        is_left = close_s > open_s - _LEAST_S
        rows, length_s, kept = rows[is_left], length_s[is_left], kept[is_left]
        open_s, close_s = open_s[is_left], close_s[is_left]
    close_s = np.maximum(np.round(close_s, 3), open_s)
    order = np.lexsort((rows, close_s, open_s))
    return TimeWindows(
        row=rows[order],
        site=table.site[rows[order]],
        open_s=open_s[order],
        close_s=close_s[order],
        length_s=length_s[order],
        is_kept=kept[order],
    )


def part_of(spans: TimeWindows, rows: npt.NDArray[np.integer] | slice) -> TimeWindows:
    """Return some of the tasks."""
    return TimeWindows(
        row=spans.row[rows],
        site=spans.site[rows],
        open_s=spans.open_s[rows],
        close_s=spans.close_s[rows],
        length_s=spans.length_s[rows],
        is_kept=spans.is_kept[rows],
    )


def with_contacts(problem: Problem, spans: TimeWindows, rows: Ints) -> TimeWindows:
    """Return the tasks together with contacts, each at its own start only."""
    table = problem.opportunities
    joined = TimeWindows(
        row=np.concatenate([spans.row, rows]).astype(np.int32),
        site=np.concatenate(
            [spans.site, table.site[rows] + np.int32(len(problem.target_ids))]
        ).astype(np.int32),
        open_s=np.concatenate([spans.open_s, table.start_s[rows]]),
        close_s=np.concatenate([spans.close_s, table.start_s[rows]]),
        length_s=np.concatenate([spans.length_s, table.end_s[rows] - table.start_s[rows]]),
        is_kept=np.concatenate([spans.is_kept, np.ones(len(rows), dtype=np.bool_)]),
    )
    order = np.lexsort((joined.row, joined.close_s, joined.open_s))
    return part_of(joined, order)


def action_of(problem: Problem, row: int, start_s: float) -> Action:
    """Return a task at a start, as the opportunity of its access that is nearest to that start."""
    table = problem.opportunities
    if table.kind[row] != COLLECT:
        return Action(float(table.start_s[row]), float(table.end_s[row]), row)
    rows = problem.collects_of(int(table.site[row]))
    rows = rows[table.access[rows] == table.access[row]]
    nearest = int(rows[np.argmin(np.abs(table.start_s[rows] - start_s))])
    if abs(table.start_s[nearest] - start_s) < _LEAST_S:
        return Action(float(table.start_s[nearest]), float(table.end_s[nearest]), nearest)
    length_s = float(table.end_s[nearest] - table.start_s[nearest])
    return Action(round(start_s, 3), round(start_s + length_s, 3), nearest)
