"""One satellite's problem in plain arrays, and what a step on it does and may do.

The readable model and the compiled search loops share it, so that the physics of a step
stands here once.

Both dynamics of the plan model become the same arithmetic. After task ``i`` its battery and
recorder are known at two clocks; the next task ``j`` then costs a lump:

==================  ============================  =====================================
column              ``physical``                  ``paper`` (event model)
==================  ============================  =====================================
``charge_from[i]``  sunlit time when the sun is   sunlit time at the start of i
                    reached after i (its end,
                    where the sun needs no turn)
``charge_to[j]``    sunlit time when the sun is   sunlit time at the start of the event
                    left for j                    before j (j's own segment is forgone)
``data_from[i]``    end of i                      start of i
``data_to[j]``      start of j                    start of j
``data_peak[j]``    start of j                    start of the event before j
``battery_cost``    draw over the task            the same, booked at its start
``recorder_gain``   fill and telemetry, or        fill, or minus downlink (telemetry is
                    telemetry minus downlink      booked for all elapsed time)
``data_end``        end of the horizon            start of the last event
==================  ============================  =====================================
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.domain import Resources
from planner_core.jit import borrowing, inlined
from planner_core.mdp.idle_energy import idle_energy
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
from planner_core.problem.sun_turns import SunTurns
from planner_core.problem.transitions import near_spans

STRICT: Final = 1e-9
"""How far inside its limits a planned state stays, so that rounding cannot cross them."""

NO_TASK: Final = -1
_SLACK: Final = 1e-12  # a fallback worked out backward must also hold when replayed forward
_MAX_LABELS: Final = 8
_MAX_AHEAD: Final = 12


@bundle
class Track(NamedTuple):
    """One satellite's problem as plain arrays; shape ``(m,)`` unless said otherwise.

    ``first_offer`` is the first row of the same access: itself, unless the access offers several
    collects to choose from. ``next_kept[i]`` and ``next_contact[i]`` are the first row from ``i``
    on that must be taken and the first contact, m where there is none (shape ``(m + 1,)``).
    ``fill_ahead[i]`` is about what may be written between the start of row ``i`` and that of the
    next contact, an image at least; ``least_cost`` and ``least_fill`` are what the cheapest
    collect takes of the battery and writes. ``fallbacks`` lists the usable contact rows and those
    that must be taken; ``fallback_after[i]`` is the place in it of the first one after row
    ``i - 1`` (shape ``(m + 1,)``).
    ``charge_top[i]`` is the greatest of ``charge_to_s`` up to row ``i``, as turns from the sun take
    them out of order. ``battery_full`` is the most the battery holds at the start of a task,
    ``battery_floor`` what it must stay above at its end (see ``idle_energy``).
    ``fallback_*`` hold, for each of them, up to eight pairs (battery needed, recorder
    allowed) after it, from which the satellite can keep its limits to the end by these rows
    alone; shape ``(num_fallbacks, 8)``.
    """

    start_s: Floats
    end_s: Floats
    is_contact: Bytes
    place: Ints
    first_offer: Ints
    blocked: Bytes
    near_from: Ints
    transitions: Transitions
    use_resources: bool
    charge_from_s: Floats
    charge_to_s: Floats
    charge_top_s: Floats
    data_from_s: Floats
    data_to_s: Floats
    data_peak_s: Floats
    battery_full: Floats
    battery_floor: Floats
    battery_floor_least: Floats
    battery_cost: Floats
    recorder_gain: Floats
    data_end_s: float
    charge_per_s: float
    idle_per_s: float
    telemetry_per_s: float
    battery_min: float
    recorder_max: float
    battery_start: float
    recorder_start: float
    reserve_start: float
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


class ResourceColumns(NamedTuple):
    """What a satellite's track tells of battery and recorder.

    ``Track`` has the same fields, and says what they are: named tuples inherit none, and kernels
    read them as its own.
    """

    charge_from_s: Floats
    charge_to_s: Floats
    charge_top_s: Floats
    data_from_s: Floats
    data_to_s: Floats
    data_peak_s: Floats
    battery_full: Floats
    battery_floor: Floats
    battery_floor_least: Floats
    battery_cost: Floats
    recorder_gain: Floats
    data_end_s: float
    charge_per_s: float
    idle_per_s: float
    telemetry_per_s: float
    battery_min: float
    recorder_max: float
    battery_start: float
    recorder_start: float
    reserve_start: float


def compile_track(problem: Problem, satellite: SatelliteProblem, blocked: Bytes) -> Track:
    """Return a satellite's arrays; ``blocked`` rows (shape ``(m,)``) may not be taken."""
    m = len(satellite)
    is_contact = (satellite.kind == CONTACT).astype(np.uint8)
    is_kept = np.zeros(m, dtype=np.bool_)
    is_kept[problem.kept_local(satellite)] = True
    access = problem.opportunities.access[satellite.rows]
    contacts = np.flatnonzero((is_contact == 1) & (blocked == 0))
    # Of the parts of a pass the whole one begins first.
    fallbacks = np.union1d(
        contacts[np.unique(access[contacts], return_index=True)[1]], np.flatnonzero(is_kept)
    ).astype(np.int32)
    _, first_of_access, access_of = np.unique(access, return_index=True, return_inverse=True)
    first_offer = first_of_access[access_of].astype(np.int32)
    columns = resource_columns(problem, satellite)
    is_collect = is_contact == 0
    track = Track(
        start_s=satellite.start_s,
        end_s=satellite.end_s,
        is_contact=is_contact,
        place=satellite.place,
        first_offer=first_offer,
        blocked=blocked,
        near_from=near_spans(satellite.transitions)[0],
        transitions=satellite.transitions,
        use_resources=problem.use_resources,
        **columns._asdict(),
        next_kept=_next_of(is_kept),
        next_contact=_next_of(~is_collect),
        fill_ahead=_fill_ahead(problem, satellite, first_offer, blocked),
        least_cost=float(columns.battery_cost[is_collect].min(initial=np.inf)),
        least_fill=float(columns.recorder_gain[is_collect].min(initial=np.inf)),
        fallbacks=fallbacks,
        fallback_after=np.searchsorted(fallbacks, np.arange(m + 1)).astype(np.int32),
        fallback_battery=np.full((len(fallbacks), _MAX_LABELS), np.inf),
        fallback_recorder=np.full((len(fallbacks), _MAX_LABELS), -np.inf),
        is_guarded=problem.use_resources,
    )
    if not problem.use_resources:
        return track
    _fill_fallbacks(track)
    # Where even contacts alone cannot keep the limits, plan task by task and let the referee
    # say what breaks: there is no plan to protect.
    safe = is_safe(track, NO_TASK, NO_TASK, track.battery_start, track.recorder_start)
    lasts = track.battery_start > track.battery_min + track.reserve_start
    return track._replace(is_guarded=bool(safe and (lasts or track.reserve_start == 0.0)))


def with_counted_resources(problem: Problem, satellite: SatelliteProblem) -> SatelliteProblem:
    """Return the satellite with the resources that count: without any it is limited by none."""
    if problem.use_resources:
        return satellite
    none = np.zeros(len(satellite))
    return replace(
        satellite, resources=Resources.limitless(), turns=SunTurns(none, none), volume=none
    )


def _next_of(is_such: Bools) -> Ints:
    """Return, for each row and for the end, the first such row from there on, or ``m``."""
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
    # In the long run the battery pays for a part of the time, and each access is collected once.
    busy = r.sunpoint_charge_per_s + r.collect_drain_per_s
    duty = r.sunpoint_charge_per_s / busy if busy > 0.0 else 1.0
    is_collect = (satellite.kind != CONTACT) & (first_offer == rows)
    collects_s = np.where(is_collect, satellite.end_s - satellite.start_s, 0.0)
    until_s = np.concatenate([[0.0], np.cumsum(collects_s)])
    offered_s = until_s[np.append(usable, m)[after]] - until_s[rows]
    # Where contacts follow each other closely, none may pass once not even one image fits in.
    image_s = collects_s[is_collect].min() if is_collect.any() else 0.0
    written_s: Floats = np.maximum(image_s, np.minimum(offered_s, duty * wait_s))
    return r.collect_fill_per_s * written_s + r.telemetry_per_s * wait_s


def resource_columns(problem: Problem, satellite: SatelliteProblem) -> ResourceColumns:
    """Return what a satellite's track tells of battery and recorder."""
    satellite = with_counted_resources(problem, satellite)
    r = satellite.resources
    start_s, end_s = satellite.start_s, satellite.end_s
    duration_s = end_s - start_s
    contact = satellite.kind == CONTACT
    previous_start_s = satellite.previous_event_s
    telemetry = r.telemetry_per_s * duration_s
    # Telemetry fills the recorder until the setup of a contact is over.
    setup_s = np.zeros(len(satellite))
    setup_s[contact] = problem.downlinks.stations.setup_s[satellite.place[contact]]
    setup_s = np.minimum(setup_s, duration_s)
    physical = problem.dynamics == "physical"
    sunlit = satellite.sunlight.seconds_until
    idle = idle_energy(satellite, problem.horizon_s)
    charge_to_s = idle.sun_until_s if physical else sunlit(previous_start_s)
    return ResourceColumns(
        charge_from_s=idle.sun_from_s if physical else sunlit(start_s),
        charge_to_s=charge_to_s,
        charge_top_s=np.maximum.accumulate(charge_to_s),
        data_from_s=end_s if physical else start_s,
        data_to_s=start_s,
        data_peak_s=start_s + setup_s if physical else previous_start_s,
        battery_full=idle.full,
        battery_floor=r.battery_min_fraction + idle.reserve,
        battery_floor_least=r.battery_min_fraction + idle.least_reserve,
        battery_cost=duration_s
        * (np.where(contact, r.contact_drain_per_s, r.collect_drain_per_s) + r.idle_drain_per_s),
        recorder_gain=np.where(contact, -satellite.volume, duration_s * r.collect_fill_per_s)
        + (telemetry if physical else 0.0),
        data_end_s=problem.horizon_s
        if physical
        else float(satellite.event_s[-1])
        if len(satellite.event_s)
        else 0.0,
        charge_per_s=r.sunpoint_charge_per_s,
        idle_per_s=r.idle_drain_per_s,
        telemetry_per_s=r.telemetry_per_s,
        battery_min=r.battery_min_fraction,
        recorder_max=r.recorder_max_fraction,
        battery_start=r.initial_battery_fraction,
        recorder_start=r.initial_recorder_fraction,
        reserve_start=idle.reserve_start,
    )


@inlined
def take(
    track: Track, last: int, row: int, battery: float, recorder: float
) -> tuple[float, float, bool]:
    """Return battery, recorder and "within limits" after waiting from ``last`` and taking ``row``.

    Eqs. 6 and 7, with the sun-pointing in between (Table 1). Fractions of capacity.
    """
    charge_from_s = track.charge_from_s[last] if last >= 0 else 0.0
    data_from_s = track.data_from_s[last] if last >= 0 else 0.0
    charge_s = max(0.0, track.charge_to_s[row] - charge_from_s)
    waited_s = max(0.0, track.data_to_s[row] - data_from_s)
    peak = recorder + track.telemetry_per_s * max(0.0, track.data_peak_s[row] - data_from_s)
    battery = battery + track.charge_per_s * charge_s - track.idle_per_s * waited_s
    battery = min(track.battery_full[row], battery) - track.battery_cost[row]
    recorder = recorder + track.telemetry_per_s * waited_s
    recorder = max(0.0, recorder + track.recorder_gain[row])
    is_within = (
        battery > track.battery_floor[row] + STRICT
        and recorder < track.recorder_max - STRICT
        and peak < track.recorder_max - STRICT
    )
    return max(0.0, battery), min(1.0, recorder), is_within


@inlined
def _ahead(track: Track, first: int, step: int, kept: int) -> int:
    """Return the place of the fallback to look at in a step from ``first`` on; -1 for no more.

    That is some contacts one after another up to the next task that must be taken, and that
    task in any case.
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

    A battery above its floor lasts as long as the satellite idles, so the recorder is what fills
    up: either it has room for the telemetry to the end, or some contact after row ``cursor`` must
    be reached.
    Tasks that must be taken count as contacts do, and none of them may be passed by.
    The check is sufficient, not necessary (it looks a limited number of contacts ahead).
    """
    data_from_s = track.data_from_s[last] if last >= 0 else 0.0
    room = track.recorder_max - 2.0 * STRICT - recorder
    m = len(track.start_s)
    kept = track.next_kept[cursor + 1]
    if kept == m and track.telemetry_per_s * max(0.0, track.data_end_s - data_from_s) <= room:
        return True
    first = track.fallback_after[cursor + 1]
    for step in range(_MAX_AHEAD + 1):
        at = _ahead(track, first, step, kept)
        if at < 0:
            return False
        row = track.fallbacks[at]
        if track.telemetry_per_s * max(0.0, track.data_peak_s[row] - data_from_s) > room:
            return False
        if not may_follow(track.transitions, last, row):
            continue
        battery_after, recorder_after, is_within = take(track, last, row, battery, recorder)
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
    """Work backward over the contacts: what each must leave so that the rest can be kept."""
    m = len(track.start_s)
    for at in range(len(track.fallbacks) - 1, -1, -1):
        row = track.fallbacks[at]
        kept = track.next_kept[row + 1]
        data_from_s = track.data_from_s[row]
        top = track.recorder_max - 2.0 * STRICT
        idle = top - track.telemetry_per_s * max(0.0, track.data_end_s - data_from_s)
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
            charge = track.charge_per_s * max(
                0.0, track.charge_to_s[following] - track.charge_from_s[row]
            )
            waited_s = max(0.0, track.data_to_s[following] - data_from_s)
            peak_s = max(0.0, track.data_peak_s[following] - data_from_s)
            for label in range(_MAX_LABELS):
                allowed_after = track.fallback_recorder[after, label]
                if allowed_after < 0.0:
                    continue
                needed_after = max(
                    track.fallback_battery[after, label],
                    track.battery_floor[following] + 2.0 * STRICT,
                )
                if track.battery_full[following] - track.battery_cost[following] < needed_after:
                    continue
                needed = needed_after + track.battery_cost[following] - charge
                needed = max(0.0, needed + track.idle_per_s * waited_s) + _SLACK
                allowed = (
                    min(
                        allowed_after
                        - track.recorder_gain[following]
                        - track.telemetry_per_s * waited_s,
                        top - track.telemetry_per_s * peak_s,
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
