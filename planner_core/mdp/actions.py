"""A(s) of eq. 4, compiled: what one satellite may do next, in time order.

The readable model and the compiled search loops share it.
"""

from __future__ import annotations

from planner_core.jit import borrowing, borrowing_inner, inlined
from planner_core.mdp.resource_columns import STRICT, take
from planner_core.mdp.track import Track, is_safe
from planner_core.problem import (
    Bytes,
    Floats,
    Ints,
    may_follow,
)


@borrowing
def next_action(
    track: Track,
    last: int,
    from_row: int,
    battery: float,
    recorder: float,
    is_hard: bool,
    collected: Bytes,
    unimaged_only: bool,
    contact_above: float,
) -> int:
    """Return the first row from ``from_row`` on that may be taken after ``last``, or ``m``.

    With ``is_hard`` an action must also keep the limits, now and (see ``is_safe``) to the end of
    the horizon. Contacts that may be skipped (see ``contact_may_pass``) are left out. A(s) ends
    with the next task that must be taken, and leaves out tasks that this one could not follow.
    """
    # Rows that start before the last task ends need not be examined.
    first = from_row if last < 0 else max(from_row, track.near_from[last])
    m = len(track.start_s)
    kept = track.next_kept[last + 1]
    end = min(m, kept + 1)
    affordable = first
    if track.use_resources and is_hard:
        affordable = first_affordable(track, last, first, end, battery, recorder)
    row = first - 1
    while True:
        row += 1
        if row < affordable:
            row = min(affordable, track.next_contact[row], kept)
        if row >= end:
            return m
        if row != kept:
            if track.blocked[row]:
                continue
            if unimaged_only and not track.is_contact[row] and collected[track.site[row]]:
                continue
            if kept < m and not may_follow(track.transitions, row, kept):
                continue
        if not may_follow(track.transitions, last, row):
            continue
        if row != kept and contact_may_pass(track, last, row, battery, recorder, contact_above):
            continue
        # If there is no way to keep the limits, tasks that must be taken override them.
        if track.use_resources and is_hard and (row != kept or track.is_guarded):
            battery_after, recorder_after, is_within = take(
                track.resources, last, row, battery, recorder
            )
            if not is_within or (
                track.is_guarded and not is_safe(track, row, row, battery_after, recorder_after)
            ):
                continue
        return row


@inlined
def contact_may_pass(
    track: Track, last: int, row: int, battery: float, recorder: float, contact_above: float
) -> bool:
    """Return whether ``row`` is a contact that is not worth its power and time yet.

    That is so while the recorder is less full than ``contact_above`` and has room for what will be
    written until the next contact, and the limits can be kept without this one.
    """
    if not (track.use_resources and track.is_contact[row] and recorder < contact_above):
        return False
    if recorder + track.fill_ahead[row] >= track.resources.recorder_max:
        return False
    return not track.is_guarded or is_safe(track, last, row, battery, recorder)


@inlined
def first_affordable(
    track: Track, last: int, first: int, end: int, battery: float, recorder: float
) -> int:
    """Return a row from ``first`` on before which every collect breaks a limit; at most ``end``.

    Before that row a search need examine contacts only. If the battery is the limit, that skips
    most of the rows of accesses that offer many starts.
    """
    # Idle time never empties the recorder.
    resources = track.resources
    if recorder + track.least_fill >= resources.recorder_max - STRICT:
        return end
    charge_from_s = resources.charge_from_s[last] if last >= 0 else 0.0
    return _first_charged(
        resources.charge_top_s, charge_from_s, resources.charge_per_s, battery,
        track.least_cost, resources.battery_min + STRICT, first, end,
    )  # fmt: skip


@inlined
def _is_charged(
    charge_s: float, charge_per_s: float, battery: float, cost: float, least: float
) -> bool:
    """Return whether the battery can pay ``cost``, computed as in ``take`` without idle draw."""
    return min(1.0, battery + charge_per_s * max(0.0, charge_s)) - cost > least


@borrowing_inner
def _first_charged(
    charge_top_s: Floats,
    charge_from_s: float,
    charge_per_s: float,
    battery: float,
    cost: float,
    least: float,
    first: int,
    end: int,
) -> int:
    """Return a row before which the battery cannot pay ``cost``, or ``end``.

    If idle time draws nothing and the sun needs no slew, it is the first row at whose start the
    battery can pay; otherwise it may be an earlier one. As ``charge_top_s`` never falls, steps of
    doubling length find a row beyond it, and bisection then finds it.
    """
    before, beyond, stride = first - 1, first, 1
    while beyond < end and not _is_charged(
        charge_top_s[beyond] - charge_from_s, charge_per_s, battery, cost, least
    ):
        before, beyond, stride = beyond, min(end, beyond + stride), 2 * stride
    while beyond - before > 1:
        middle = (before + beyond) // 2
        if _is_charged(charge_top_s[middle] - charge_from_s, charge_per_s, battery, cost, least):
            beyond = middle
        else:
            before = middle
    return beyond


@inlined
def is_repeated(track: Track, chosen: Ints, begin: int, end: int, row: int) -> bool:
    """Return whether ``chosen[begin:end]``, in time order, has an earlier collect of this access.

    A(s) holds only the first feasible collect of each access: later ones would push other targets
    out of its ``breadth``, and are offered again after the next action.
    """
    first = track.first_offer[row]
    at = end - 1
    while at >= begin and chosen[at] >= first:
        if track.first_offer[chosen[at]] == first:
            return True
        at -= 1
    return False


@inlined
def may_wait(
    track: Track, last: int, cursor: int, battery: float, recorder: float, is_hard: bool
) -> bool:
    """Return whether sun-pointing past row ``cursor`` leaves a way to keep pins and limits."""
    if track.next_kept[last + 1] == cursor:
        return False
    if not (track.use_resources and is_hard and track.is_guarded):
        return True
    return is_safe(track, last, cursor, battery, recorder)
