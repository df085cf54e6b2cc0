"""Moves on a route: a few consecutive tasks are replanned by label setting over cells of starts.

A label is a chain of tasks from the task before the window on, each as early as possible. The best
label in each cell of a task's starts is kept. Targets imaged outside the window may be taken at
next to no gain: the other image is then dropped, which leaves room for something else. Starts in
labels are estimates from the table of earliest starts; those of the chosen chain are computed
exactly, and the move is given up if the chain does not fit.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.lns.route import (
    Route,
    early_after,
    position_of,
    remove,
    update_early,
    update_late,
)
from planner_core.certified.signs import FIXED, NOWHERE, UNASSIGNED
from planner_core.certified.sizes import ROUTE_BUCKETS, ROUTE_LABELS, ROUTE_TASKS
from planner_core.certified.tuning import TUNING
from planner_core.draws import Uint64s, next_draw
from planner_core.jit import borrowing, borrowing_inner
from planner_core.precedence.earliest_starts import EarliestStarts, cell_of, edge_s
from planner_core.precedence.time_windows import TimeWindows, View
from planner_core.problem import Bytes, Floats, Ints
from planner_core.problem.pointing import needed_s, sight

_TIE: Final = TUNING.tie
_AIMED: Final = TUNING.aimed
_ATTEMPTS: Final = TUNING.patience

Within = tuple[float, float]
"""When a window begins, and the latest start of the task after it (s)."""


@bundle
class Scratch(NamedTuple):
    """Working memory for the labels of one move.

    ``mark`` counts the moves: entries with another mark are stale. Labels: ``task``, ``start_s``,
    ``value`` (with random ties), ``gain`` (without), ``parent`` and ``following`` in the bucket.
    """

    mark: Ints
    task: Ints
    start_s: Floats
    value: Floats
    gain: Floats
    parent: Ints
    following: Ints
    bucket: Ints
    label: Ints
    label_mark: Ints
    worth: Floats
    worth_mark: Ints
    inside_mark: Ints
    chosen: Ints
    chosen_s: Floats
    old: Route


@bundle
class RouteSearch(NamedTuple):
    """What moves on one satellite's route read, and what they change.

    Attributes
    ----------
    worth
        Of each task; a kept task is worth more than all others together. Shape ``(n,)``.
    imaged_by
        The task that images each target, or ``UNASSIGNED``, ``ELSEWHERE`` or ``FIXED``.
        Shape ``(num_targets,)``.
    """

    spans: TimeWindows
    looks: View  # Numba has a meaning of its own for an attribute ``view``
    earliest: EarliestStarts
    worth: Floats
    imaged_by: Ints
    route: Route
    scratch: Scratch
    draws: Uint64s


def scratch_of(num_tasks: int, num_cells: int, num_targets: int) -> Scratch:
    """Return working memory for the moves on a route."""
    return Scratch(
        mark=np.zeros(1, dtype=np.int32),
        task=np.empty(ROUTE_LABELS, dtype=np.int32),
        start_s=np.empty(ROUTE_LABELS),
        value=np.empty(ROUTE_LABELS),
        gain=np.empty(ROUTE_LABELS),
        parent=np.empty(ROUTE_LABELS, dtype=np.int32),
        following=np.empty(ROUTE_LABELS, dtype=np.int32),
        bucket=np.full(ROUTE_BUCKETS, -1, dtype=np.int32),
        label=np.empty(num_cells, dtype=np.int32),
        label_mark=np.zeros(num_cells, dtype=np.int32),
        worth=np.empty(num_tasks),
        worth_mark=np.zeros(num_tasks, dtype=np.int32),
        inside_mark=np.zeros(num_targets, dtype=np.int32),
        chosen=np.empty(ROUTE_TASKS, dtype=np.int32),
        chosen_s=np.empty(ROUTE_TASKS),
        old=Route(
            size=np.zeros(1, dtype=np.int32),
            task=np.empty(num_tasks + ROUTE_TASKS, dtype=np.int32),
            early_s=np.empty(num_tasks + ROUTE_TASKS),
            late_s=np.empty(num_tasks + ROUTE_TASKS),
        ),
    )


@borrowing
def make_moves(
    search: RouteSearch,
    num_moves: int,
    longest: int,
    stop: Bytes,
) -> None:
    """Make moves in place, on windows of at most ``longest`` tasks."""
    spans, route, draws = search.spans, search.route, search.draws
    worth, imaged_by = search.worth, search.imaged_by
    n = len(spans.open_s)
    for _ in range(num_moves):
        if stop[0] or n == 0:
            return
        task = int(next_draw(draws) * n)
        if next_draw(draws) < _AIMED:
            for _ in range(_ATTEMPTS):
                if imaged_by[spans.site[task]] == UNASSIGNED and worth[task] > 0.0:
                    break
                task = int(next_draw(draws) * n)
        at_s = spans.open_s[task] + next_draw(draws) * (spans.close_s[task] - spans.open_s[task])
        low, high = 0, route.size[0]
        while low < high:
            middle = (low + high) // 2
            if route.early_s[middle] < at_s:
                low = middle + 1
            else:
                high = middle
        size = int(next_draw(draws) * (longest + 1))
        first = max(0, low - int(next_draw(draws) * (size + 1)))
        _replan(search, first, min(first + size, route.size[0]))


@borrowing_inner
def _replan(
    search: RouteSearch,
    first: int,
    end: int,
) -> bool:
    """Replan the tasks from ``first`` up to ``end``; return whether the route has changed."""
    spans, view, route, scratch = search.spans, search.looks, search.route, search.scratch
    worth, imaged_by = search.worth, search.imaged_by
    scratch.mark[0] += 1
    mark = scratch.mark[0]
    old_gain = 0.0
    for p in range(first, end):
        old_gain += worth[route.task[p]]
        scratch.inside_mark[spans.site[route.task[p]]] = mark
    last = _best_chain(search, first, end, old_gain)
    if last == NOWHERE:
        return False
    size = 0
    while last >= 0:
        if size == ROUTE_TASKS:
            return False
        scratch.chosen[size] = scratch.task[last]
        size += 1
        last = scratch.parent[last]
    if not _time_chain(spans, view, route, scratch, first, end, size):
        return False
    for p in range(first, end):
        imaged_by[spans.site[route.task[p]]] = UNASSIGNED
    _put_in(spans, view, route, scratch, first, end, size)
    for i in range(size - 1, -1, -1):
        task = scratch.chosen[i]
        held = imaged_by[spans.site[task]]
        imaged_by[spans.site[task]] = task
        if held >= 0:
            # The target is imaged twice now: drop the other image, perhaps of the same access.
            p = position_of(route, held, first, first + size)
            if p >= 0:
                remove(spans, view, route, p)
                if p < first:
                    first -= 1
    return True


@borrowing_inner
def _time_chain(
    spans: TimeWindows, view: View, route: Route, scratch: Scratch, first: int, end: int, size: int
) -> bool:
    """Compute the chain's earliest starts; return whether it fits before the next task."""
    before, start_s = -1, 0.0
    if first > 0:
        before, start_s = route.task[first - 1], route.early_s[first - 1]
    for i in range(size - 1, -1, -1):
        start_s = early_after(spans, view, before, start_s, scratch.chosen[i])
        if start_s == np.inf:
            return False
        scratch.chosen_s[i] = start_s
        before = scratch.chosen[i]
    if end < route.size[0]:
        start_s = early_after(spans, view, before, start_s, route.task[end])
        return bool(start_s <= route.late_s[end] + 1e-9)
    return True


@borrowing_inner
def _put_in(
    spans: TimeWindows, view: View, route: Route, scratch: Scratch, first: int, end: int, size: int
) -> None:
    """Replace the tasks from ``first`` up to ``end`` by the chain."""
    n, shift = route.size[0], size - (end - first)
    if shift > 0:
        for p in range(n - 1, end - 1, -1):
            route.task[p + shift] = route.task[p]
            route.early_s[p + shift] = route.early_s[p]
            route.late_s[p + shift] = route.late_s[p]
    elif shift < 0:
        for p in range(end, n):
            route.task[p + shift] = route.task[p]
            route.early_s[p + shift] = route.early_s[p]
            route.late_s[p + shift] = route.late_s[p]
    route.size[0] = n + shift
    for i in range(size):
        route.task[first + size - 1 - i] = scratch.chosen[i]
        route.early_s[first + size - 1 - i] = scratch.chosen_s[i]
    update_early(spans, view, route, first + size, first + size)
    update_late(spans, view, route, first + size - 1, first - 1)


@borrowing_inner
def _best_chain(
    search: RouteSearch,
    first: int,
    end: int,
    old_gain: float,
) -> int:
    """Return the last label of the best chain: -1 if it is empty, ``NOWHERE`` if all are worse."""
    spans, view, route, scratch = search.spans, search.looks, search.route, search.scratch
    after, late_s = -1, np.inf
    looks = (1.0, 0.0, 0.0)
    if end < route.size[0]:
        after, late_s = route.task[end], route.late_s[end]
        looks = sight(view.path, view.sites_m, spans.site[after], late_s)
    count = 0
    from_s = 0.0
    if first > 0:
        before, start_s = route.task[first - 1], route.early_s[first - 1]
        from_s = start_s + spans.length_s[before]
        count = _extend(search, count, before, start_s, -1, (from_s, late_s))
    else:
        from_s = spans.open_s[0] if len(spans.open_s) else 0.0
        until_s = min(late_s, from_s + ROUTE_BUCKETS * 4.0)
        for task in range(len(spans.open_s)):
            if spans.open_s[task] >= until_s:
                break
            count = _offer(search, count, task, spans.open_s[task], -1, (from_s, late_s))
    best, best_value = NOWHERE, -1.0
    if old_gain <= 1e-9 and end > first:
        best, best_value = -1, 0.0
    for b in range(ROUTE_BUCKETS):
        at = scratch.bucket[b]
        while at >= 0:
            scratch.bucket[b] = scratch.following[at]
            task, start_s = scratch.task[at], scratch.start_s[at]
            cell = cell_of(search.earliest, spans, task, start_s)
            if scratch.label[cell] == at:
                if scratch.value[at] > best_value and scratch.gain[at] >= old_gain - 1e-9:
                    done_s = start_s + spans.length_s[task]
                    fits = after < 0
                    if not fits and done_s <= late_s:
                        looked = sight(view.path, view.sites_m, spans.site[task], done_s)
                        fits = done_s + needed_s(view.agile, looked, looks) <= late_s + 0.02
                    if fits:
                        best, best_value = at, scratch.value[at]
                count = _extend(search, count, task, start_s, at, (from_s, late_s))
            at = scratch.bucket[b]
    return best


@borrowing_inner
def _extend(
    search: RouteSearch, count: int, task: int, start_s: float, parent: int, within_s: Within
) -> int:
    """Offer every task that may follow a task at a start; return the new number of labels."""
    spans, earliest = search.spans, search.earliest
    cell = cell_of(earliest, spans, task, start_s)
    edge = edge_s(earliest, spans, task, cell)
    for arc in range(earliest.first_arc[cell], earliest.first_arc[cell + 1]):
        other = earliest.to[arc]
        then_s = edge + earliest.after_s[arc] + earliest.slope[arc] * (start_s - edge)
        then_s = max(then_s, spans.open_s[other])
        if then_s > spans.close_s[other]:
            continue
        count = _offer(search, count, other, then_s, parent, within_s)
    return count


@borrowing_inner
def _offer(
    search: RouteSearch, count: int, task: int, start_s: float, parent: int, within_s: Within
) -> int:
    """Add the label of a chain that continues to a task if it is the best up to its cell.

    Returns the new number of labels.
    """
    spans, earliest, scratch = search.spans, search.earliest, search.scratch
    worth, imaged_by = search.worth, search.imaged_by
    from_s, late_s = within_s
    if start_s + spans.length_s[task] > late_s or count == ROUTE_LABELS:
        return count
    mark, site = scratch.mark[0], spans.site[task]
    is_inside = scratch.inside_mark[site] == mark
    held = imaged_by[site]
    if held == FIXED:
        return count
    is_new = is_inside or held == UNASSIGNED
    if not is_new and held >= 0 and spans.is_kept[held]:
        return count
    if scratch.worth_mark[task] != mark:
        scratch.worth_mark[task] = mark
        luck = next_draw(search.draws)
        extra = 1.0 + _TIE * luck if is_new else _TIE * (2.0 * luck - 1.0)
        scratch.worth[task] = worth[task] * extra
    if scratch.worth[task] <= 0.0:
        return count
    value = scratch.worth[task]
    if parent >= 0:
        value += scratch.value[parent]
    cell = cell_of(earliest, spans, task, start_s)
    for other in range(earliest.first_cell[task], cell + 1):
        if scratch.label_mark[other] == mark and scratch.value[scratch.label[other]] >= value:
            return count
    at = parent
    while at >= 0:
        if spans.site[scratch.task[at]] == site:
            return count
        at = scratch.parent[at]
    bucket = int((start_s - from_s) * 0.25)
    if bucket >= ROUTE_BUCKETS:
        return count
    scratch.label[cell], scratch.label_mark[cell] = count, mark
    scratch.task[count], scratch.start_s[count] = task, start_s
    scratch.value[count], scratch.parent[count] = value, parent
    scratch.gain[count] = (scratch.gain[parent] if parent >= 0 else 0.0) + (
        worth[task] if is_new else 0.0
    )
    scratch.following[count] = scratch.bucket[bucket]
    scratch.bucket[bucket] = count
    return count + 1
