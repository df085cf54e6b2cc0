"""All that a forced opportunity displaces for battery and recorder to keep their limits too."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.jit import borrowing, borrowing_inner
from planner_core.mdp.resource_columns import STRICT, ResourceColumns, take
from planner_core.mdp.track import NO_TASK, Track
from planner_core.problem import Bools, Bytes, Ints
from planner_core.reasons.forcing import (
    BATTERY,
    FITS,
    RECORDER,
    Forced,
    PlannedSatellite,
    Sequence,
    follows,
    waited,
)

AT_END: Final = -2
_MAX_DROPS: Final = 4
_LOOK_BACK: Final = 30  # how many collects may be considered for dropping


class Displaced(NamedTuple):
    """All that each opportunity displaces so that it fits.

    Attributes
    ----------
    dropped
        Which tasks of the plan; shape ``(n, num_tasks)``.
    is_settled
        Whether the rest then keeps the limits; if not, only tasks in its way are dropped.
    broken, break_row
        Which limit breaks first if only the tasks in its way are dropped, and at which task: a
        local row, or ``AT_END``.
    """

    dropped: Bools
    is_settled: Bools
    broken: Bytes
    break_row: Ints


def displace_each(planned: PlannedSatellite, candidates: Ints, forced: Forced) -> Displaced:
    """Return what these opportunities displace, with battery and recorder taken into account.

    Tasks in the way are dropped first. Then the collects before the break that earn least (the
    latest of equals) are dropped one by one, and those that prove unnecessary are restored.
    """
    n = len(candidates)
    displaced = Displaced(
        dropped=np.zeros((n, len(planned.sequence.rows)), dtype=np.bool_),
        is_settled=np.zeros(n, dtype=np.bool_),
        broken=np.zeros(n, dtype=np.uint8),
        break_row=np.full(n, AT_END, dtype=np.int32),
    )
    for c in range(n):
        displaced.dropped[c, forced.first[c] : forced.last[c]] = True
    drops = np.empty(_MAX_DROPS, dtype=np.int32)
    _displace_each(planned.track, planned.sequence, candidates, forced, displaced, drops)
    return displaced


@borrowing
def _displace_each(
    track: Track,
    plan: Sequence,
    candidates: Ints,
    forced: Forced,
    displaced: Displaced,
    drops: Ints,
) -> None:
    n = len(plan.rows)
    dropped = displaced.dropped
    for c in range(len(candidates)):
        row, first = candidates[c], forced.first[c]
        is_free = forced.loss[c] < np.inf
        displaced.is_settled[c] = is_free
        if not track.use_resources or forced.broken[c] == FITS:
            continue
        begin, end = first, forced.last[c]
        at, broken = _first_break(track.resources, plan, dropped, c, row, first, begin, end)
        if at < 0:
            continue
        displaced.broken[c] = broken
        if at != n:
            displaced.break_row[c] = row if at == n + 1 else plan.rows[at]
        num_drops = 0
        while is_free and at >= 0 and num_drops < _MAX_DROPS:
            until = first - 1 if at == n + 1 else min(at, n - 1)
            found = _least(track, plan, dropped, c, row, first, until)
            if found < 0:
                break
            dropped[c, found] = True
            drops[num_drops] = found
            num_drops += 1
            begin, end = min(begin, found), max(end, found + 1)
            at, broken = _first_break(track.resources, plan, dropped, c, row, first, begin, end)
        displaced.is_settled[c] = is_free and at < 0
        for i in range(num_drops):
            dropped[c, drops[i]] = False
            if at >= 0 or i == num_drops - 1:
                dropped[c, drops[i]] = at < 0
                continue
            is_needed = not _may_stand(track, plan, dropped, c, row, first, drops[i], True)
            if not is_needed:
                again, broken = _first_break(
                    track.resources, plan, dropped, c, row, first, begin, end
                )
                is_needed = again >= 0
            dropped[c, drops[i]] = is_needed


@borrowing_inner
def _first_break(
    resources: ResourceColumns,
    plan: Sequence,
    dropped: Bools,
    c: int,
    row: int,
    at: int,
    begin: int,
    end: int,
) -> tuple[int, int]:
    """Return the task at which a limit breaks, and the limit; n for the end, n + 1 for ``row``.

    Returns -1 and ``FITS`` if none breaks. ``row`` comes before task ``at``; other changes lie
    between ``begin`` and ``end``.
    """
    n = len(plan.rows)
    battery, recorder = plan.battery[begin], plan.recorder[begin]
    last = plan.rows[begin - 1] if begin > 0 else NO_TASK
    for i in range(begin, n + 1):
        if i == at:
            battery, recorder, is_within = take(resources, last, row, battery, recorder)
            if not is_within:
                is_low = battery <= resources.battery_floor[row] + STRICT
                return n + 1, BATTERY if is_low else RECORDER
            last = row
        if i == n or dropped[c, i]:
            continue
        battery, recorder, is_within = take(resources, last, plan.rows[i], battery, recorder)
        if not is_within:
            is_low = battery <= resources.battery_floor[plan.rows[i]] + STRICT
            return i, BATTERY if is_low else RECORDER
        last = plan.rows[i]
        if i == max(at, end):
            # Nothing changes from here on.
            lowest = min(plan.cap[i], battery + plan.drop[i])
            highest = max(plan.floor[i], recorder + plan.rise[i])
            if (
                lowest > resources.battery_min + STRICT
                and highest < resources.recorder_max - STRICT
            ):
                return -1, FITS
    if recorder + waited(resources, last, resources.data_end_s) >= resources.recorder_max - STRICT:
        return n, RECORDER
    return -1, FITS


@borrowing_inner
def _least(
    track: Track, plan: Sequence, dropped: Bools, c: int, row: int, at: int, until: int
) -> int:
    """Return the collect up to ``until`` that earns least, the latest of equals; -1 for none."""
    found, num_seen = -1, 0
    i = until
    while i >= 0 and num_seen < _LOOK_BACK:
        if not (dropped[c, i] or plan.is_fixed[i] or track.is_contact[plan.rows[i]]):
            num_seen += 1
            is_less = found < 0 or plan.earned[i] < plan.earned[found]
            if is_less and _may_stand(track, plan, dropped, c, row, at, i, False):
                found = i
        i -= 1
    return found


@borrowing_inner
def _may_stand(
    track: Track,
    plan: Sequence,
    dropped: Bools,
    c: int,
    row: int,
    at: int,
    i: int,
    is_taken: bool,
) -> bool:
    """Return whether the tasks around task ``i`` may follow each other, with or without it."""
    before, after = i - 1, i + 1
    while before >= 0 and dropped[c, before]:
        before -= 1
    while after < len(plan.rows) and dropped[c, after]:
        after += 1
    previous = plan.rows[before] if before >= 0 else NO_TASK
    following = plan.rows[after] if after < len(plan.rows) else NO_TASK
    if before < at <= i:
        previous = row
    if i < at <= after:
        following = row
    if not is_taken:
        return following < 0 or follows(track, previous, following)
    return follows(track, previous, plan.rows[i]) and (
        following < 0 or follows(track, plan.rows[i], following)
    )
