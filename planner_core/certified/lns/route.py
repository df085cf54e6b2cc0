"""One satellite's sequence of tasks, with the earliest and the latest start of each.

Earliest starts follow from the tasks before, latest starts from those after. A task may move freely
between the two, so another may be inserted wherever it fits after the earliest start of the one
before it and before the latest start of the one after it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import borrowing, borrowing_inner
from planner_core.precedence.time_windows import TimeWindows, View
from planner_core.problem import Floats, Ints
from planner_core.problem.pointing import earliest_start_s, latest_start_s, sight


@bundle
class Route(NamedTuple):
    """A sequence of tasks in arrays with spare room; the first ``size[0]`` entries count.

    Attributes
    ----------
    task
        Indices of tasks (rows of ``TimeWindows``) in order.
    early_s, late_s
        Earliest and latest start of each.
    """

    size: Ints
    task: Ints
    early_s: Floats
    late_s: Floats


def empty_route(room: int) -> Route:
    """Return an empty route with room for ``room`` tasks."""
    return Route(
        size=np.zeros(1, dtype=np.int32),
        task=np.zeros(room, dtype=np.int32),
        early_s=np.zeros(room),
        late_s=np.zeros(room),
    )


@borrowing_inner
def early_after(spans: TimeWindows, view: View, before: int, start_s: float, task: int) -> float:
    """Return the earliest start of a task after another, or as the first (``before`` of -1)."""
    if before < 0:
        return float(spans.open_s[task])
    end_s = start_s + spans.length_s[before]
    looked = sight(view.path, view.sites_m, spans.site[before], end_s)
    return earliest_start_s(
        view.agile, end_s, looked, view.path, view.sites_m,
        spans.site[task], spans.open_s[task], spans.close_s[task],
    )  # fmt: skip


@borrowing_inner
def late_before(spans: TimeWindows, view: View, task: int, after: int, start_s: float) -> float:
    """Return the latest start of a task before another, or as the last (``after`` of -1)."""
    if after < 0:
        return float(spans.close_s[task])
    looks = sight(view.path, view.sites_m, spans.site[after], start_s)
    return latest_start_s(
        view.agile, start_s, looks, view.path, view.sites_m,
        spans.site[task], spans.length_s[task], spans.open_s[task], spans.close_s[task],
    )  # fmt: skip


@borrowing
def update_early(spans: TimeWindows, view: View, route: Route, first: int, until: int) -> bool:
    """Compute earliest starts from ``first`` on; from ``until`` on only while they change.

    Returns whether every task can still start in time.
    """
    for p in range(first, route.size[0]):
        before, start_s = -1, 0.0
        if p > 0:
            before, start_s = route.task[p - 1], route.early_s[p - 1]
        now_s = early_after(spans, view, before, start_s, route.task[p])
        if now_s == np.inf:
            return False
        if p >= until and now_s == route.early_s[p]:
            break
        route.early_s[p] = now_s
    return True


@borrowing
def update_late(spans: TimeWindows, view: View, route: Route, last: int, until: int) -> bool:
    """Compute latest starts from ``last`` back; from ``until`` back only while they change."""
    for p in range(last, -1, -1):
        after, start_s = -1, 0.0
        if p + 1 < route.size[0]:
            after, start_s = route.task[p + 1], route.late_s[p + 1]
        now_s = late_before(spans, view, route.task[p], after, start_s)
        if now_s == -np.inf:
            return False
        if p <= until and now_s == route.late_s[p]:
            break
        route.late_s[p] = now_s
    return True


@borrowing
def remove(spans: TimeWindows, view: View, route: Route, p: int) -> None:
    """Remove the task at a position, and widen the starts of the tasks around it."""
    n = route.size[0]
    for q in range(p, n - 1):
        route.task[q] = route.task[q + 1]
        route.early_s[q] = route.early_s[q + 1]
        route.late_s[q] = route.late_s[q + 1]
    route.size[0] = n - 1
    update_early(spans, view, route, p, p)
    update_late(spans, view, route, p - 1, p - 1)


@borrowing_inner
def position_of(route: Route, task: int, begin: int, end: int) -> int:
    """Return the position of a task outside ``begin`` up to ``end``, or -1."""
    for p in range(route.size[0]):
        if route.task[p] == task and not begin <= p < end:
            return p
    return -1
