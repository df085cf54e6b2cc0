"""Battery and recorder of one satellite over a plan, integrated for the referee.

Solvers step from task to task with the lump sums of ``planner_core.mdp.track``. The referee does
not trust them: it integrates the whole horizon here, piece by piece, independently.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from planner_core.jit import inlined, kernel
from planner_core.problem import (
    CONTACT,
    Bools,
    Floats,
    Longs,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.plan import Action, Columns, Plan
from planner_core.referee.contact_flow import flow, flows
from planner_core.referee.idle_time import Idle, idle_spans

_SAME: Final = 1e-9  # of a capacity
_STATES_IN_PIECE: Final = 6  # at most two end stops, each reached in one step or two

_State = tuple[float, float, float, float, float]


class Point(NamedTuple):
    """The state at an instant. ``recorded`` and ``removed`` count from the start."""

    time_s: float
    battery: float
    recorder: float
    recorded: float
    removed: float


class Curve(NamedTuple):
    """States in order of time, a column for each member of ``Point``. Shape ``(n,)`` each."""

    time_s: Floats
    battery: Floats
    recorder: Floats
    recorded: Floats
    removed: Floats

    def points(self) -> list[Point]:
        """Return the states one by one."""
        columns = (column.tolist() for column in self)
        return [Point(*state) for state in zip(*columns, strict=True)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Profile:
    """Battery and recorder over the horizon, linear (``physical``) or stepped (``paper``).

    Attributes
    ----------
    curve
        It is enough to test limits at its instants.
    before, after
        The states at the start and the end of each action.
    idle
        What the satellite does between its actions, in order.
    sun_end
        The state at the end of the stay at the sun in each idle span.
    """

    curve: Curve
    before: Curve
    after: Curve
    idle: Idle
    sun_end: Curve


def integrate(problem: Problem, satellite: SatelliteProblem, own: Plan) -> Profile:
    """Return the resources of ``satellite`` while it carries out its own actions."""
    if problem.dynamics == "physical":
        return _integrate_physical(problem, satellite, own.columns)
    return _integrate_events(problem, satellite, own)


def _integrate_physical(problem: Problem, satellite: SatelliteProblem, columns: Columns) -> Profile:
    """Integrate over the horizon: each mode at its power and rate, sun-pointing in between.

    Panels charge in sunlight during the part of each idle span that is spent at the sun, and
    not during turns and holds.
    """
    r, horizon_s = satellite.resources, problem.horizon_s
    is_contact = problem.opportunities.kind[columns.row] == CONTACT
    idle = idle_spans(problem, satellite, columns)
    pieces = flows(problem, satellite, columns.at(is_contact))
    each = _Rates(
        float(r.collect_drain_per_s), float(r.contact_drain_per_s), float(r.idle_drain_per_s),
        float(r.sunpoint_charge_per_s), float(r.telemetry_per_s), float(r.collect_fill_per_s),
    )  # fmt: skip
    lit = satellite.sunlight
    spans = [
        np.column_stack(ends).clip(0.0, horizon_s)
        for ends in (
            (columns.start_s, columns.end_s),
            (pieces[:, 0], pieces[:, 1]),
            (lit.enter_s, lit.exit_s),
            (idle.sun_from_s, idle.sun_until_s),
        )
    ]
    # Rates are constant between these times.
    times = np.unique(np.concatenate([[0.0, horizon_s], *(span.ravel() for span in spans)]))
    tasks, flowing, sunlit, at_sun = (indices_of(times, span) for span in spans)
    power, fill, drain = _rates_over(
        len(times) - 1, tasks, is_contact, flowing, pieces[:, 2].copy(), sunlit, at_sun, each
    )
    held = r.initial_recorder_fraction
    first = (0.0, r.initial_battery_fraction, held, held, 0.0)
    states, at = states_under(times, power, fill, drain, first)
    starts, stops = at[tasks.T]
    return Profile(
        curve=Curve(*states.T.copy()),
        before=Curve(*states[starts].T.copy()),
        after=Curve(*states[stops].T.copy()),
        idle=idle,
        sun_end=Curve(*states[at[at_sun[:, 1]]].T.copy()),
    )


@kernel
def indices_of(times: Floats, spans: Floats) -> Longs:
    """Return the index in ``times`` of both ends of each span; ``times`` contains them all.

    The ends are nearly sorted, so going from one to the next takes a step or two.
    """
    found = np.empty(spans.shape, dtype=np.int64)
    at = 0
    for i in range(len(spans)):
        for end in range(2):
            while times[at] < spans[i, end]:
                at += 1
            while at > 0 and times[at - 1] >= spans[i, end]:
                at -= 1
            found[i, end] = at
    return found


class _Rates(NamedTuple):
    """What each mode consumes and supplies, in capacities per second."""

    collect_drain: float
    contact_drain: float
    idle_drain: float
    charge: float
    telemetry: float
    fill: float


@kernel
def _rates_over(
    num_pieces: int,
    tasks: Longs,
    is_contact: Bools,
    flowing: Longs,
    per_s: Floats,
    sunlit: Longs,
    at_sun: Longs,
    each: _Rates,
) -> tuple[Floats, Floats, Floats]:
    """Return battery power, recorder fill and recorder drain in each piece of time.

    Parameters
    ----------
    tasks, flowing, sunlit, at_sun
        Spans of pieces: the first, and one past the last. Shape ``(n, 2)`` each.
    per_s
        How fast data comes down in each span of ``flowing``. Shape ``(n,)``.
    """
    num_collects, num_contacts, drain, num_lit, num_at_sun = np.zeros((5, num_pieces))
    for i in range(len(tasks)):
        _cover(num_contacts if is_contact[i] else num_collects, tasks, i, 1.0)
    for i in range(len(flowing)):
        _cover(drain, flowing, i, per_s[i])
    for i in range(len(sunlit)):
        _cover(num_lit, sunlit, i, 1.0)
    for i in range(len(at_sun)):
        _cover(num_at_sun, at_sun, i, 1.0)
    power = np.empty(num_pieces)
    for piece in range(len(power)):
        collects, contacts = num_collects[piece], num_contacts[piece]
        used = 0.0
        if collects + contacts > 0.0:
            used = -collects * each.collect_drain - contacts * each.contact_drain
        elif num_lit[piece] > 0.0 and num_at_sun[piece] > 0.0:
            used = each.charge
        power[piece] = used - each.idle_drain
    return power, each.telemetry + num_collects * each.fill, drain


@inlined
def _cover(covered: Floats, spans: Longs, i: int, weight: float) -> None:
    """Add a weight to each piece of span ``i``.

    Each piece sums only what covers it: a difference of running sums would leave rounding errors
    in pieces that nothing covers.
    """
    for piece in range(spans[i, 0], spans[i, 1]):
        covered[piece] += weight


@kernel
def states_under(
    times: Floats, power: Floats, fill: Floats, drain: Floats, first: _State
) -> tuple[Floats, Longs]:
    """Return the states given the rates of each piece, and the index of the state at each time."""
    states = np.empty((_STATES_IN_PIECE * len(times), 5))
    at = np.empty(len(times), dtype=np.int64)
    states[0] = first
    num_states, at[0] = 1, 0
    point = first
    for piece in range(len(times) - 1):
        while point[0] < times[piece + 1]:
            point = advance(point, times[piece + 1], power[piece], fill[piece], drain[piece])
            states[num_states] = point
            num_states += 1
        at[piece + 1] = num_states - 1
    return states[:num_states], at


@inlined
def advance(point: _State, until_s: float, power: float, fill: float, drain: float) -> _State:
    """Return the state at ``until_s``, or earlier if battery or recorder is then full or empty."""
    time_s, battery, recorder, recorded, removed = point
    if (power > 0 and battery >= 1.0) or (power < 0 and battery <= 0.0):
        power = 0.0
    net = fill - drain
    if (net > 0 and recorder >= 1.0) or (net < 0 and recorder <= 0.0):
        net = 0.0
    dt = until_s - time_s
    stop_s = until_s
    for value, rate in ((battery, power), (recorder, net)):
        if rate != 0.0:
            to_stop_s = ((1.0 if rate > 0 else 0.0) - value) / rate
            # Rounding errors must not cause an endless sequence of tiny pieces.
            if to_stop_s < dt - 1e-9:
                dt = max(to_stop_s, 1e-9)
                stop_s = time_s + dt
    battery = min(max(battery + power * dt, 0.0), 1.0)
    kept = min(max(recorder + net * dt, 0.0), 1.0)
    # What did not stay in the recorder was taken down (or, when it is full, lost).
    taken = fill * dt - (kept - recorder) if drain > 0 else 0.0
    return stop_s, battery, kept, recorded + fill * dt, removed + max(taken, 0.0)


def _integrate_events(problem: Problem, satellite: SatelliteProblem, own: Plan) -> Profile:
    """Walk through the paper's events, the starts of opportunities: taken, or sun-pointing."""
    r, actions = satellite.resources, own.actions
    taken: dict[int, list[int]] = {}
    for position, action in enumerate(actions):
        event = int(satellite.event[problem.local_row[action.opportunity]])
        taken.setdefault(event, []).append(position)
    sunlit_s: Floats = satellite.sunlight.seconds_until(satellite.event_s)
    point = Point(0.0, r.initial_battery_fraction, r.initial_recorder_fraction,
                  r.initial_recorder_fraction, 0.0)  # fmt: skip
    points = [point]
    before = [point] * len(actions)
    after = [point] * len(actions)
    previous_sunlit_s = 0.0
    for event in range(len(satellite.event_s)):
        t_s = float(satellite.event_s[event])
        telemetry = r.telemetry_per_s * (t_s - point.time_s)
        if event not in taken:
            charge = r.sunpoint_charge_per_s * (float(sunlit_s[event]) - previous_sunlit_s)
            point = Point(
                t_s,
                min(1.0, point.battery + charge),
                min(1.0, point.recorder + telemetry),
                point.recorded + telemetry,
                point.removed,
            )
        for position in taken.get(event, ()):
            before[position] = point
            point = _book(point, problem, satellite, actions[position], t_s, telemetry)
            after[position] = point
            telemetry = 0.0
        previous_sunlit_s = float(sunlit_s[event])
        points.append(point)
    idle = idle_spans(problem, satellite, own.columns)
    level_at = {action.start_s: level for action, level in zip(actions, before, strict=True)}
    return Profile(
        curve=_curve(points),
        before=_curve(before),
        after=_curve(after),
        idle=idle,
        sun_end=_curve([level_at.get(end_s, point) for end_s in idle.end_s.tolist()]),
    )


def _curve(points: Sequence[Point]) -> Curve:
    return Curve(*np.array(points).reshape(-1, 5).T.copy())


def _book(
    point: Point,
    problem: Problem,
    satellite: SatelliteProblem,
    action: Action,
    t_s: float,
    telemetry: float,
) -> Point:
    """Book a whole task at its start, with the telemetry since the previous event."""
    r = satellite.resources
    duration_s = action.end_s - action.start_s
    if problem.opportunities.kind[action.opportunity] == CONTACT:
        held = point.recorder + telemetry
        pieces = flow(problem, satellite, action)
        removed = min(held, math.fsum((pieces[:, 1] - pieces[:, 0]) * pieces[:, 2]))
        return Point(
            t_s,
            max(0.0, point.battery - r.contact_drain_per_s * duration_s),
            min(1.0, held - removed),
            point.recorded + telemetry,
            point.removed + removed,
        )
    filled = telemetry + r.collect_fill_per_s * duration_s
    return Point(
        t_s,
        max(0.0, point.battery - r.collect_drain_per_s * duration_s),
        min(1.0, point.recorder + filled),
        point.recorded + filled,
        point.removed,
    )


def thin(curve: Curve) -> tuple[Floats, Floats, Floats]:
    """Return time, battery and recorder without points that lie on a line or repeat."""
    kept = _kept(curve.time_s, curve.battery, curve.recorder)
    return curve.time_s[kept], curve.battery[kept], curve.recorder[kept]


@kernel
def _kept(time_s: Floats, battery: Floats, recorder: Floats) -> Bools:
    """Return which points do not lie on the line from the last kept point to the next point."""
    kept = np.ones(len(time_s), dtype=np.bool_)
    last = 0
    for i in range(1, len(time_s) - 1):
        span_s = time_s[i + 1] - time_s[last]
        if span_s > 0.0:
            share = (time_s[i] - time_s[last]) / span_s
            on_line = battery[last] + share * (battery[i + 1] - battery[last])
            held_on_line = recorder[last] + share * (recorder[i + 1] - recorder[last])
            if abs(on_line - battery[i]) < _SAME and abs(held_on_line - recorder[i]) < _SAME:
                kept[i] = False
                continue
        last = i
    return kept
