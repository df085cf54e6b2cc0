"""One satellite's problem in plain arrays, and whether limits can be kept from a state on."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import borrowing, inlined
from planner_core.mdp.resource_columns import STRICT, ResourceColumns, resource_columns, take
from planner_core.problem import (
    CONTACT,
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
    Transitions,
    may_follow,
)
from planner_core.problem.transitions import near_spans

NO_TASK: Final = -1
_SLACK: Final = 1e-12  # a fallback computed backward must also hold when replayed forward
_MAX_LABELS: Final = 8
_MAX_AHEAD: Final = 12


@bundle
class Track(NamedTuple):
    """One satellite's problem as plain arrays; shape ``(m,)`` unless said otherwise.

    ``first_offer`` is the first row of the same access: itself, unless the access offers several
    tasks to choose from. ``next_kept[i]`` and ``next_contact[i]`` are the first row from ``i``
    on that must be taken and the first contact, m if there is none (shape ``(m + 1,)``).
    ``fill_ahead[i]`` estimates what is written between the start of row ``i`` and that of the next
    contact, at least one image; ``least_cost`` and ``least_fill`` are the least that a collect
    takes from the battery and writes. ``fallbacks`` lists the usable contact rows and those
    that must be taken; ``fallback_after[i]`` is the index in it of the first one after row
    ``i - 1`` (shape ``(m + 1,)``).
    ``fallback_battery`` and ``fallback_recorder`` hold, for each of them, up to eight pairs
    (battery needed, recorder allowed) after it, from which the satellite can keep its limits to
    the end by these rows alone; shape ``(num_fallbacks, 8)``.
    """

    start_s: Floats
    end_s: Floats
    is_contact: Bytes
    site: Ints
    first_offer: Ints
    blocked: Bytes
    near_from: Ints
    transitions: Transitions
    use_resources: bool
    resources: ResourceColumns
    next_kept: Ints
    next_contact: Ints
    fill_ahead: Floats
    least_cost: float
    least_fill: float
    fallbacks: Ints
    fallback_after: Ints
    fallback_battery: Floats
    fallback_recorder: Floats
    is_guarded: bool


def compile_track(problem: Problem, satellite: SatelliteProblem, blocked: Bytes) -> Track:
    """Return a satellite's arrays; ``blocked`` rows (shape ``(m,)``) may not be taken."""
    m = len(satellite)
    is_contact = (satellite.kind == CONTACT).astype(np.uint8)
    is_kept = np.zeros(m, dtype=np.bool_)
    is_kept[problem.kept_local(satellite)] = True
    access = problem.opportunities.access[satellite.rows]
    contacts = np.flatnonzero((is_contact == 1) & (blocked == 0))
    # Of the contacts of a pass, the whole one begins first.
    fallbacks = np.union1d(
        contacts[np.unique(access[contacts], return_index=True)[1]], np.flatnonzero(is_kept)
    ).astype(np.int32)
    _, first_of_access, access_of = np.unique(access, return_index=True, return_inverse=True)
    first_offer = first_of_access[access_of].astype(np.int32)
    resources = resource_columns(problem, satellite)
    is_collect = is_contact == 0
    track = Track(
        start_s=satellite.start_s,
        end_s=satellite.end_s,
        is_contact=is_contact,
        site=satellite.site,
        first_offer=first_offer,
        blocked=blocked,
        near_from=near_spans(satellite.transitions)[0],
        transitions=satellite.transitions,
        use_resources=problem.use_resources,
        resources=resources,
        next_kept=_next_of(is_kept),
        next_contact=_next_of(~is_collect),
        fill_ahead=_fill_ahead(problem, satellite, first_offer, blocked),
        least_cost=float(resources.battery_cost[is_collect].min(initial=np.inf)),
        least_fill=float(resources.recorder_gain[is_collect].min(initial=np.inf)),
        fallbacks=fallbacks,
        fallback_after=np.searchsorted(fallbacks, np.arange(m + 1)).astype(np.int32),
        fallback_battery=np.full((len(fallbacks), _MAX_LABELS), np.inf),
        fallback_recorder=np.full((len(fallbacks), _MAX_LABELS), -np.inf),
        is_guarded=problem.use_resources,
    )
    if not problem.use_resources:
        return track
    _fill_fallbacks(track)
    # If even contacts alone cannot keep the limits, plan task by task and let the referee report
    # what breaks: there is no safe plan to protect.
    safe = is_safe(track, NO_TASK, NO_TASK, resources.battery_start, resources.recorder_start)
    lasts = resources.battery_start > resources.battery_min + resources.reserve_start
    return track._replace(is_guarded=bool(safe and (lasts or resources.reserve_start == 0.0)))


def _next_of(is_such: Bools) -> Ints:
    """Return, for each row and for the end, the first row from there on that is such, or ``m``."""
    m = len(is_such)
    found = np.where(np.append(is_such, True), np.arange(m + 1), m)
    return np.minimum.accumulate(found[::-1])[::-1].astype(np.int32)


def _fill_ahead(
    problem: Problem, satellite: SatelliteProblem, first_offer: Ints, blocked: Bytes
) -> Floats:
    r = satellite.resources
    m = len(satellite)
    rows = np.arange(m)
    usable = np.flatnonzero((satellite.kind == CONTACT) & (blocked == 0))
    after = np.searchsorted(usable, rows, side="right")
    wait_s = np.append(satellite.start_s[usable], problem.horizon_s)[after] - satellite.start_s
    # In the long run the battery pays for imaging a part of the time, and each access only once.
    busy = r.sunpoint_charge_per_s + r.collect_drain_per_s
    duty = r.sunpoint_charge_per_s / busy if busy > 0.0 else 1.0
    is_collect = (satellite.kind != CONTACT) & (first_offer == rows)
    collects_s = np.where(is_collect, satellite.end_s - satellite.start_s, 0.0)
    until_s = np.concatenate([[0.0], np.cumsum(collects_s)])
    offered_s = until_s[np.append(usable, m)[after]] - until_s[rows]
    # Even if contacts follow each other closely, none may be skipped once no image fits on board.
    image_s = collects_s[is_collect].min() if is_collect.any() else 0.0
    written_s: Floats = np.maximum(image_s, np.minimum(offered_s, duty * wait_s))
    return r.collect_fill_per_s * written_s + r.telemetry_per_s * wait_s


@inlined
def _ahead(track: Track, first: int, step: int, kept: int) -> int:
    """Return the index of the fallback to examine at a step from ``first`` on; -1 for no more.

    These are ``_MAX_AHEAD`` rows in order, but none beyond the next task that must be taken, and
    that task in any case.
    """
    end = len(track.fallbacks)
    at = first + step
    if kept < len(track.start_s):
        end = track.fallback_after[kept] + 1
        if step == _MAX_AHEAD:
            return end - 1 if at < end else -1
    return at if step < _MAX_AHEAD and at < end else -1


@borrowing
def is_safe(track: Track, last: int, cursor: int, battery: float, recorder: float) -> bool:
    """Return whether limits can be kept to the end from here by idling and contacts alone.

    A battery above its floor lasts as long as the satellite idles, so only the recorder can fail:
    either it has room for the telemetry to the end, or some contact after row ``cursor`` must be
    reached. Tasks that must be taken are treated like contacts, and none may be skipped.
    The check is sufficient, not necessary (it looks a limited number of contacts ahead).
    """
    resources = track.resources
    data_from_s = resources.data_from_s[last] if last >= 0 else 0.0
    room = resources.recorder_max - 2.0 * STRICT - recorder
    m = len(track.start_s)
    kept = track.next_kept[cursor + 1]
    if (
        kept == m
        and resources.telemetry_per_s * max(0.0, resources.data_end_s - data_from_s) <= room
    ):
        return True
    first = track.fallback_after[cursor + 1]
    for step in range(_MAX_AHEAD + 1):
        at = _ahead(track, first, step, kept)
        if at < 0:
            return False
        row = track.fallbacks[at]
        if resources.telemetry_per_s * max(0.0, resources.data_peak_s[row] - data_from_s) > room:
            return False
        if not may_follow(track.transitions, last, row):
            continue
        battery_after, recorder_after, is_within = take(resources, last, row, battery, recorder)
        if not is_within:
            continue
        for label in range(_MAX_LABELS):
            if (
                battery_after >= track.fallback_battery[at, label]
                and recorder_after <= track.fallback_recorder[at, label]
            ):
                return True
    return False


@borrowing
def _fill_fallbacks(track: Track) -> None:
    """Compute, backward over the fallbacks, the levels after each from which limits can be kept."""
    resources = track.resources
    m = len(track.start_s)
    for at in range(len(track.fallbacks) - 1, -1, -1):
        row = track.fallbacks[at]
        kept = track.next_kept[row + 1]
        data_from_s = resources.data_from_s[row]
        top = resources.recorder_max - 2.0 * STRICT
        idle = top - resources.telemetry_per_s * max(0.0, resources.data_end_s - data_from_s)
        num_labels = 0
        if idle >= 0.0 and kept == m:
            track.fallback_battery[at, 0] = 0.0
            track.fallback_recorder[at, 0] = idle
            num_labels = 1
        for step in range(_MAX_AHEAD + 1):
            after = _ahead(track, at + 1, step, kept)
            if after < 0:
                break
            following = track.fallbacks[after]
            if not may_follow(track.transitions, row, following):
                continue
            charge = resources.charge_per_s * max(
                0.0, resources.charge_to_s[following] - resources.charge_from_s[row]
            )
            waited_s = max(0.0, resources.data_to_s[following] - data_from_s)
            peak_s = max(0.0, resources.data_peak_s[following] - data_from_s)
            for label in range(_MAX_LABELS):
                allowed_after = track.fallback_recorder[after, label]
                if allowed_after < 0.0:
                    continue
                needed_after = max(
                    track.fallback_battery[after, label],
                    resources.battery_floor[following] + 2.0 * STRICT,
                )
                if (
                    resources.battery_full[following] - resources.battery_cost[following]
                    < needed_after
                ):
                    continue
                needed = needed_after + resources.battery_cost[following] - charge
                needed = max(0.0, needed + resources.idle_per_s * waited_s) + _SLACK
                allowed = (
                    min(
                        allowed_after
                        - resources.recorder_gain[following]
                        - resources.telemetry_per_s * waited_s,
                        top - resources.telemetry_per_s * peak_s,
                    )
                    - _SLACK
                )
                if allowed < 0.0 or num_labels == _MAX_LABELS:
                    continue
                is_dominated = False
                for other in range(num_labels):
                    if (
                        track.fallback_battery[at, other] <= needed
                        and track.fallback_recorder[at, other] >= allowed
                    ):
                        is_dominated = True
                        break
                if not is_dominated:
                    track.fallback_battery[at, num_labels] = needed
                    track.fallback_recorder[at, num_labels] = allowed
                    num_labels += 1
