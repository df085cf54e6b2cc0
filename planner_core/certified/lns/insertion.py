"""Insertion: tasks that fit between those of a route, if these may move, are put in."""

from __future__ import annotations

import numpy as np

from planner_core.certified.lns.route import (
    Route,
    early_after,
    late_before,
    update_early,
    update_late,
)
from planner_core.certified.signs import UNASSIGNED
from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.precedence.time_windows import TimeWindows, View
from planner_core.problem import Bools, Bytes, Ints


@borrowing_inner
def first_near(route: Route, instant_s: float) -> int:
    """Return the position of the first task that may still start at an instant or later."""
    low, high = 0, route.size[0]
    while low < high:
        middle = (low + high) // 2
        if route.late_s[middle] < instant_s:
            low = middle + 1
        else:
            high = middle
    return low


@borrowing_inner
def fits_at(spans: TimeWindows, view: View, route: Route, task: int, p: int) -> float:
    """Return the earliest start of a task inserted before position ``p``; infinite if it cannot be.

    Minus infinity if its window closes before the task ahead allows it, there and further on.
    """
    before, start_s = -1, 0.0
    if p > 0:
        before, start_s = route.task[p - 1], route.early_s[p - 1]
    then_s = early_after(spans, view, before, start_s, task)
    if then_s == np.inf:
        return -np.inf
    if p < route.size[0]:
        if then_s + spans.length_s[task] > route.late_s[p]:
            return np.inf
        if then_s > late_before(spans, view, task, route.task[p], route.late_s[p]):
            return np.inf
    return then_s


@borrowing
def insert_each(
    spans: TimeWindows, view: View, order: Ints, imaged_by: Ints, route: Route, stop: Bytes
) -> None:
    """Insert each task of ``order`` whose target is unassigned at the first position it fits."""
    for task in order:
        if stop[0]:
            return
        if imaged_by[spans.site[task]] != UNASSIGNED:
            continue
        for p in range(first_near(route, spans.open_s[task]), route.size[0] + 1):
            then_s = fits_at(spans, view, route, task, p)
            if then_s == -np.inf:
                break
            if then_s < np.inf:
                _put_in(spans, view, route, task, p, then_s)
                imaged_by[spans.site[task]] = task
                break


@borrowing_inner
def _put_in(
    spans: TimeWindows, view: View, route: Route, task: int, p: int, start_s: float
) -> None:
    for q in range(route.size[0], p, -1):
        route.task[q] = route.task[q - 1]
        route.early_s[q] = route.early_s[q - 1]
        route.late_s[q] = route.late_s[q - 1]
    route.size[0] += 1
    route.task[p], route.early_s[p] = task, start_s
    update_early(spans, view, route, p + 1, p + 1)
    update_late(spans, view, route, p, p - 1)


@kernel
def fitting(spans: TimeWindows, view: View, route: Route, is_free: Bools) -> tuple[Ints, Ints]:
    """Return the tasks on free sites that fit by agility, once for each position, and these."""
    tasks, positions = [np.int32(0) for _ in range(0)], [np.int32(0) for _ in range(0)]
    for task in range(len(spans.row)):
        if not is_free[spans.site[task]]:
            continue
        for p in range(first_near(route, spans.open_s[task]), route.size[0] + 1):
            then_s = fits_at(spans, view, route, task, p)
            if then_s == -np.inf:
                break
            if then_s < np.inf:
                tasks.append(np.int32(task))
                positions.append(np.int32(p))
    return np.array(tasks, dtype=np.int32), np.array(positions, dtype=np.int32)
