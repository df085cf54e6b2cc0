"""What happens if an opportunity is forced into a plan: what it displaces, which limits break.

One satellite's plan is a sequence of tasks. An opportunity put into it displaces those next to it
from or to which the satellite cannot turn in time. Its effect on later battery and recorder takes
no replay: given the level right after a task, the lowest battery from then on (after each task,
less what idle time may draw after it) is ``min(cap, level + drop)`` and the fullest recorder is
``max(floor, level + rise)``, with constants computed once, backward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.jit import borrowing, inlined, inner, kernel
from planner_core.mdp.resource_columns import STRICT, ResourceColumns, take
from planner_core.mdp.track import NO_TASK, Track, compile_track
from planner_core.problem import (
    Bools,
    Bytes,
    Floats,
    Ints,
    Problem,
    may_follow,
)
from planner_core.problem.plan import Plan
from planner_core.problem.slew import (
    INSTANT,
    TIME_TOLERANCE_S,
    angle_between_deg,
    slew_s,
)

FITS: Final = 0
BATTERY: Final = 1
RECORDER: Final = 2
_MOST_RATE: Final = 5.0  # times the satellite's own: greater changes are not worth proposing
_NEVER: Final = 1e9


@bundle
class Sequence(NamedTuple):
    """One satellite's part of a plan, for kernels; shape ``(n,)`` unless said otherwise.

    Attributes
    ----------
    rows
        Local rows in order.
    earned
        What the plan would lose without each task.
    is_fixed
        Which tasks must stay.
    battery, recorder
        Levels after 0, 1, ... tasks. Shape ``(n + 1,)``.
    cap, drop, floor, rise
        Constants for the levels after each task; see the module.
    """

    rows: Ints
    earned: Floats
    is_fixed: Bools
    battery: Floats
    recorder: Floats
    cap: Floats
    drop: Floats
    floor: Floats
    rise: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedSatellite:
    """One satellite's share of a plan.

    Attributes
    ----------
    positions
        Positions of its actions in ``plan.actions``.
    is_sound
        Whether the unchanged plan keeps the limits.
    """

    index: int
    track: Track
    sequence: Sequence
    positions: Ints
    is_sound: bool
    los_start: Floats
    los_end: Floats

    @classmethod
    def of(cls, problem: Problem, plan: Plan, index: int, earned: Floats) -> PlannedSatellite:
        """Return a satellite's share; ``earned`` is what each action of the plan earns."""
        satellite, table = problem.satellites[index], problem.opportunities
        taken = np.array([action.opportunity for action in plan.actions], dtype=np.int64)
        positions = np.flatnonzero(table.satellite[taken] == index)
        rows = problem.local_row[taken[positions]]
        order = np.argsort(rows, kind="stable")
        positions, rows = positions[order], rows[order]
        track = compile_track(problem, satellite, np.zeros(len(satellite), dtype=np.uint8))
        n = len(rows)
        sequence = Sequence(
            rows=rows,
            earned=earned[positions],
            is_fixed=np.isin(rows, problem.kept_local(satellite)),
            battery=np.zeros(n + 1),
            recorder=np.zeros(n + 1),
            cap=np.empty(n),
            drop=np.empty(n),
            floor=np.empty(n),
            rise=np.empty(n),
        )
        is_sound = True
        if problem.use_resources:
            is_sound = bool(_fill(track.resources, sequence))
        return cls(
            index=index,
            track=track,
            sequence=sequence,
            positions=positions.astype(np.int32),
            is_sound=is_sound,
            los_start=np.ascontiguousarray(table.los_start[satellite.rows]),
            los_end=np.ascontiguousarray(table.los_end[satellite.rows]),
        )


@kernel
def _fill(resources: ResourceColumns, plan: Sequence) -> bool:
    """Fill in the levels of the unchanged plan; return whether they keep the limits."""
    n = len(plan.rows)
    plan.battery[0], plan.recorder[0] = resources.battery_start, resources.recorder_start
    last, is_sound = NO_TASK, True
    for i in range(n):
        plan.battery[i + 1], plan.recorder[i + 1], is_within = take(
            resources, last, plan.rows[i], plan.battery[i], plan.recorder[i]
        )
        is_sound = is_sound and is_within
        last = plan.rows[i]
    for i in range(n - 1, -1, -1):
        row = plan.rows[i]
        if i == n - 1:
            plan.cap[i], plan.drop[i], plan.floor[i] = np.inf, np.inf, -np.inf
            plan.rise[i] = waited(resources, row, resources.data_end_s)
            continue
        after = plan.rows[i + 1]
        charge = resources.charge_per_s * max(
            0.0, resources.charge_to_s[after] - resources.charge_from_s[row]
        )
        waited_s = max(0.0, resources.data_to_s[after] - resources.data_from_s[row])
        cost, later = (
            resources.battery_cost[after],
            min(-reserve(resources, after), plan.drop[i + 1]),
        )
        plan.cap[i] = min(plan.cap[i + 1], resources.battery_full[after] - cost + later)
        plan.drop[i] = charge - resources.idle_per_s * waited_s - cost + later
        peak_s = max(0.0, resources.data_peak_s[after] - resources.data_from_s[row])
        gain = resources.telemetry_per_s * waited_s + resources.recorder_gain[after]
        rise = max(0.0, plan.rise[i + 1])
        plan.floor[i] = max(plan.floor[i + 1], rise)
        plan.rise[i] = max(resources.telemetry_per_s * peak_s, gain + rise)
    end = plan.recorder[n] + waited(resources, last, resources.data_end_s)
    return is_sound and end < resources.recorder_max - STRICT


class Forced(NamedTuple):
    """The effect of forcing each of some opportunities into the plan; shape ``(n,)``.

    Attributes
    ----------
    first, last
        Tasks ``first`` to ``last - 1`` of the plan are in its way: they cannot precede or follow
        it.
    broken
        ``FITS``, ``BATTERY`` or ``RECORDER``, once those tasks are dropped.
    loss
        What those tasks earn; infinite if one must stay.
    rate_deg_s, settle_s
        Agility with which nothing is in its way, if the limits allow that; NaN for none.
    lowest, highest
        Lowest battery and fullest recorder then: limits that would just be reached.
    """

    first: Ints
    last: Ints
    broken: Bytes
    loss: Floats
    rate_deg_s: Floats
    settle_s: Floats
    lowest: Floats
    highest: Floats


def force_each(problem: Problem, planned: PlannedSatellite, candidates: Ints) -> Forced:
    """Return what forcing each of these local rows into the satellite's plan does."""
    n = len(candidates)
    forced = Forced(
        first=np.empty(n, dtype=np.int32),
        last=np.empty(n, dtype=np.int32),
        broken=np.zeros(n, dtype=np.uint8),
        loss=np.zeros(n),
        rate_deg_s=np.full(n, np.nan),
        settle_s=np.full(n, np.nan),
        lowest=np.full(n, 1.0),
        highest=np.zeros(n),
    )
    agility = problem.satellites[planned.index].agility
    _force_each(
        planned.track, planned.sequence, planned.los_start, planned.los_end,
        agility.slew_rate_deg_s, agility.acceleration_deg_s2 or INSTANT, agility.settle_s,
        candidates, forced,
    )  # fmt: skip
    return forced


@borrowing
def _force_each(
    track: Track,
    plan: Sequence,
    los_start: Floats,
    los_end: Floats,
    rate_deg_s: float,
    acceleration_deg_s2: float,
    settle_s: float,
    candidates: Ints,
    forced: Forced,
) -> None:
    resources = track.resources
    rows, n = plan.rows, len(plan.rows)
    for c in range(len(candidates)):
        row = candidates[c]
        k, high = 0, n
        while k < high:
            middle = (k + high) // 2
            k, high = (middle + 1, high) if rows[middle] < row else (k, middle)
        first = last = k
        while first > 0 and not follows(track, rows[first - 1], row):
            first -= 1
        while last < n and not follows(track, row, rows[last]):
            last += 1
        forced.first[c], forced.last[c] = first, last
        for i in range(first, last):
            forced.loss[c] += np.inf if plan.is_fixed[i] else plan.earned[i]
        if track.use_resources:
            lowest, highest = _levels(resources, plan, row, first, last)
            forced.lowest[c], forced.highest[c] = lowest, highest
            if lowest <= resources.battery_min + STRICT:
                forced.broken[c] = BATTERY
            elif highest >= resources.recorder_max - STRICT:
                forced.broken[c] = RECORDER
        # For turns in motion, the agility that would suffice is not worked out.
        if first == last or len(track.transitions.moves) > 0:
            continue
        if track.use_resources:
            lowest, highest = _levels(resources, plan, row, k, k)
            if (
                lowest <= resources.battery_min + STRICT
                or highest >= resources.recorder_max - STRICT
            ):
                continue
        needed, settle = 0.0, np.inf
        for side in range(2):
            a, b = row, row
            if side == 0 and k > 0:
                a = rows[k - 1]
            if side == 1 and k < n:
                b = rows[k]
            if a == b:
                continue
            gap_s = track.start_s[b] - track.end_s[a]
            angle_deg = _angle_deg(los_end, a, los_start, b)
            needed = max(needed, _rate_for(angle_deg, gap_s - settle_s, acceleration_deg_s2))
            settle = min(settle, gap_s - slew_s(angle_deg, rate_deg_s, acceleration_deg_s2))
        if rate_deg_s < needed <= _MOST_RATE * rate_deg_s:
            forced.rate_deg_s[c] = needed
        if 0.0 <= settle < settle_s:
            forced.settle_s[c] = settle


@inlined
def _levels(
    resources: ResourceColumns, plan: Sequence, row: int, first: int, last: int
) -> tuple[float, float]:
    """Return the lowest battery and the fullest recorder from ``row`` on.

    ``row`` takes the place of tasks ``first`` to ``last - 1`` of the plan.
    """
    before = plan.rows[first - 1] if first > 0 else NO_TASK
    battery, recorder = plan.battery[first], plan.recorder[first]
    peak = recorder + waited(resources, before, resources.data_peak_s[row])
    battery, recorder, _ = take(resources, before, row, battery, recorder)
    lowest, highest = battery - reserve(resources, row), max(peak, recorder)
    if last == len(plan.rows):
        return lowest, max(highest, recorder + waited(resources, row, resources.data_end_s))
    after = plan.rows[last]
    highest = max(highest, recorder + waited(resources, row, resources.data_peak_s[after]))
    battery, recorder, _ = take(resources, row, after, battery, recorder)
    left = battery - reserve(resources, after)
    lowest = min(lowest, left, plan.cap[last], battery + plan.drop[last])
    return lowest, max(highest, recorder, plan.floor[last], recorder + plan.rise[last])


@inlined
def reserve(resources: ResourceColumns, row: int) -> float:
    """Return how far above its minimum the battery must be after a task."""
    return float(resources.battery_floor[row] - resources.battery_min)


@inlined
def waited(resources: ResourceColumns, last: int, until_s: float) -> float:
    """Return the telemetry from a task's end to an instant."""
    from_s = resources.data_from_s[last] if last >= 0 else 0.0
    return resources.telemetry_per_s * max(0.0, until_s - from_s)


@inlined
def _angle_deg(los_end: Floats, a: int, los_start: Floats, b: int) -> float:
    return angle_between_deg(
        (los_end[a, 0], los_end[a, 1], los_end[a, 2]),
        (los_start[b, 0], los_start[b, 1], los_start[b, 2]),
    )


@inner
def _rate_for(angle_deg: float, available_s: float, acceleration_deg_s2: float) -> float:
    """Return a slew rate, in whole thousandths, that turns through an angle in time."""
    if available_s <= 0.0:
        return _NEVER
    rate: float = angle_deg / available_s
    if acceleration_deg_s2 > 0.0:
        room = available_s * available_s - 4.0 * angle_deg / acceleration_deg_s2
        if room < 0.0:
            return _NEVER
        rate = (available_s - math.sqrt(room)) * acceleration_deg_s2 / 2.0
    rate = math.ceil(rate * 1000.0) / 1000.0
    is_late = slew_s(angle_deg, rate, acceleration_deg_s2) > available_s + TIME_TOLERANCE_S / 2.0
    return rate + 1e-3 if is_late else rate


@inlined
def follows(track: Track, a: int, b: int) -> bool:
    """Return whether task ``b`` may directly follow ``a``, or come first."""
    return may_follow(track.transitions, a, b)
