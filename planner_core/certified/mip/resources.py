"""Battery and recorder of one satellite as linear rows, exact for both dynamics.

More energy and less data never hurt a plan, so the end stops need no binary choice: the
battery is *at most* what flows in allows and at most full, the recorder *at least* what
flows in and at least empty. Each task is booked whole at its start, as in
``planner_core.mdp.track``.

The columns hold levels less what idle time adds up to (charge of all sunlit seconds so far,
telemetry of all seconds so far). Idling is then free, and a level changes at tasks only:

* ``E[k] <= E[k-1] - energy_cost[k] * x[k]``, ``E[k] + cap_cost[k] * x[k] <= full[k]``;
* ``G[k] >= G[k-1] + data_gain[k] * x[k]``, ``G[k] >= empty[k]`` where k is a contact;
* and the limits, for the instants at which the booked level is the lowest (or highest) one.

Images come down in the order in which they were taken. So one is on the ground at the end if the
recorder then holds no more than what was recorded after it (``_add_shares``).

A task that still runs when the next could begin has been booked whole, while some of its
sunlight and telemetry is yet to come. Where it begins the limits allow for that.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np

from planner_core.certified.dp.resource_network import must_deliver, network_of
from planner_core.certified.mip.program import Program, Rows
from planner_core.certified.tolerances import ON_BOARD
from planner_core.mdp.idle_energy import IdleEnergy, idle_energy
from planner_core.precedence.relation import comes_before, direct_precedence
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Given:
    """What is given back where two tasks leave no time at the sun; shape ``(num_pairs,)``.

    Each task pays for its turns to the sun and back, as if it always went there. Of two tasks
    that follow each other sooner the charge between them would be negative.

    Attributes
    ----------
    first, second
        The tasks.
    amount
        Of the battery.
    """

    first: Ints
    second: Ints
    amount: Floats

    def of_part(self, rows: Ints, num_tasks: int) -> Given:
        """Return the pairs among some of the tasks."""
        new_row = np.full(num_tasks, -1, dtype=np.int32)
        new_row[rows] = np.arange(len(rows))
        first, second = new_row[self.first], new_row[self.second]
        is_left = (first >= 0) & (second >= 0)
        return Given(first=first[is_left], second=second[is_left], amount=self.amount[is_left])


NOTHING_GIVEN: Final = Given(
    first=np.empty(0, dtype=np.int32), second=np.empty(0, dtype=np.int32), amount=np.empty(0)
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResourceTerms:
    """The coefficients of one satellite's rows, by task; fractions of capacity, shape ``(m,)``.

    Attributes
    ----------
    energy_cost, cap_cost
        What taking a task costs, and what a full battery loses by it.
    full
        Level of a full battery before the task, where it is not taken; less by what ``cap_cost``
        is above the cost where it is.
    battery_floor, battery_floor_taken
        Lowest level after the task: in any case, and where it is taken.
    data_gain
        What taking a task records (or, negative, takes down).
    recorder_floor, recorder_floor_taken
        Level of an empty recorder; contacts cannot take down more than that.
    recorder_top
        Highest level until the next task begins.
    recorder_top_first
        Highest level before the first task.
    given
        What is given back to pairs of tasks.
    delivered
        Highest level at the end with each task as the last image, where images must come down.
    comes_down
        The same for each image to be on the ground, where some may stay on board.
    """

    energy_cost: Floats
    cap_cost: Floats
    full: Floats
    battery_floor: Floats
    battery_floor_taken: Floats
    data_gain: Floats
    recorder_floor: Floats
    recorder_floor_taken: Floats
    recorder_top: Floats
    recorder_top_first: float
    given: Given = NOTHING_GIVEN
    delivered: Floats | None = None
    comes_down: Floats | None = None

    def of_part(self, rows: Ints) -> ResourceTerms:
        """Return the terms where only some of the tasks may be taken, in ascending order.

        Limits of the others hold on: those of the battery loosen as time goes on, so that the
        tasks before have the tighter ones, and those of the recorder tighten.
        """
        if len(rows) == 0:
            return self._at(rows)
        last = np.append(rows[1:], len(self.full)) - 1
        top_first = self.recorder_top_first
        if rows[0] > 0:
            top_first = min(top_first, float(self.recorder_top[rows[0] - 1]))
        return replace(
            self._at(rows), recorder_top=self.recorder_top[last], recorder_top_first=top_first
        )

    def _at(self, rows: Ints) -> ResourceTerms:
        names = [f.name for f in fields(self) if isinstance(getattr(self, f.name), np.ndarray)]
        part = {name: getattr(self, name)[rows] for name in names}
        return replace(self, given=self.given.of_part(rows, len(self.full)), **part)


def resource_terms(problem: Problem, satellite: SatelliteProblem) -> ResourceTerms:
    """Return the terms of a satellite that has opportunities."""
    terms = (
        physical_terms(problem, satellite)
        if problem.dynamics == "physical"
        else event_terms(satellite)
    )
    if must_deliver(problem, satellite):
        return replace(terms, delivered=network_of(problem, satellite).delivered)
    if problem.counts_delivery:
        return replace(terms, comes_down=network_of(problem, satellite).data_floor)
    return terms


def physical_terms(problem: Problem, satellite: SatelliteProblem) -> ResourceTerms:
    """Return the terms of ``dynamics: physical``: time outside tasks charges, but for turns."""
    r = satellite.resources
    start_s, end_s = satellite.start_s, satellite.end_s
    is_contact = satellite.kind == CONTACT
    draw, gain = _task_totals(satellite)
    idle = idle_energy(satellite, problem.horizon_s)
    idle_drawn_from, idle_drawn_to = r.idle_drain_per_s * end_s, r.idle_drain_per_s * start_s
    charged_from = r.sunpoint_charge_per_s * idle.sun_from_s - idle_drawn_from
    charged_to = r.sunpoint_charge_per_s * idle.sun_until_s - idle_drawn_to
    cost = draw + r.sunpoint_charge_per_s * (idle.sun_from_s - idle.sun_until_s)
    cost = cost + (idle_drawn_to - idle_drawn_from)
    floor = r.battery_min_fraction + idle.reserve - charged_from
    next_s = np.append(start_s[1:], problem.horizon_s)
    emptied = np.where(is_contact, -r.telemetry_per_s * end_s, np.inf)
    # Who leaves the sun for a later task may do so before the turn to this one would begin: what
    # is not taken caps the battery by what comes after it, too.
    full = idle.full - charged_to
    full_untaken = np.maximum.accumulate(full[::-1])[::-1]
    return ResourceTerms(
        energy_cost=cost,
        cap_cost=cost + full_untaken - full,
        full=full_untaken,
        battery_floor=_floor_of_any(satellite, floor, charged_from, charged_to),
        battery_floor_taken=floor,
        data_gain=gain,
        recorder_floor=np.minimum.accumulate(np.minimum(emptied, 0.0)),
        recorder_floor_taken=np.where(is_contact, emptied, -np.inf),
        recorder_top=r.recorder_max_fraction - r.telemetry_per_s * next_s,
        recorder_top_first=r.recorder_max_fraction - r.telemetry_per_s * float(start_s[0]),
        given=_given(satellite, idle),
    )


def event_terms(satellite: SatelliteProblem) -> ResourceTerms:
    """Return the terms of ``dynamics: paper``: a taken event forgoes its segment's charge."""
    r = satellite.resources
    draw, gain = _task_totals(satellite)
    sunlit = satellite.sunlight.seconds_until
    charged = r.sunpoint_charge_per_s * sunlit(satellite.start_s)
    forgone = charged - r.sunpoint_charge_per_s * sunlit(satellite.previous_event_s)
    floor = r.battery_min_fraction - charged
    telemetry = r.telemetry_per_s * satellite.start_s
    # The recorder is fullest at the last event before the next task.
    until_s = np.append(satellite.previous_event_s, satellite.event_s[-1])
    top = r.recorder_max_fraction - r.telemetry_per_s * until_s
    return ResourceTerms(
        energy_cost=draw + forgone,
        cap_cost=draw,
        full=1.0 - charged,
        battery_floor=floor,
        battery_floor_taken=floor,
        data_gain=gain,
        recorder_floor=-telemetry,
        recorder_floor_taken=-telemetry,
        recorder_top=top[1:],
        recorder_top_first=float(top[0]),
    )


def _task_totals(satellite: SatelliteProblem) -> tuple[Floats, Floats]:
    """Return what each task draws from the battery and adds to the recorder."""
    r = satellite.resources
    duration_s = satellite.end_s - satellite.start_s
    is_contact = satellite.kind == CONTACT
    draw = np.where(is_contact, r.contact_drain_per_s, r.collect_drain_per_s) + r.idle_drain_per_s
    gain = np.where(is_contact, -satellite.volume, duration_s * r.collect_fill_per_s)
    return duration_s * draw, gain


def _floor_of_any(
    satellite: SatelliteProblem, floor: Floats, charged_from: Floats, charged_to: Floats
) -> Floats:
    """Return the lowest level after each task, whichever was the last one taken."""
    r = satellite.resources
    if not r.knows_free_charge_alone:
        start = min(r.initial_battery_fraction, r.battery_min_fraction)
        return np.minimum.accumulate(np.minimum(floor, start))
    # Idle time only charges: what may still run at each start has the lowest level.
    latest = charged_to.copy()
    over = np.searchsorted(satellite.start_s, satellite.end_s)
    for row in range(len(satellite)):
        np.maximum(latest[row : over[row]], charged_from[row], out=latest[row : over[row]])
    return r.battery_min_fraction - latest


def _given(satellite: SatelliteProblem, idle: IdleEnergy) -> Given:
    """Return what pairs of tasks get back that leave no time at the sun."""
    if satellite.resources.sun_pointing == "free":
        return NOTHING_GIVEN
    precedence = direct_precedence(satellite)
    lasts_to = np.minimum.accumulate(idle.sun_until_s[::-1])[::-1]
    until = np.searchsorted(lasts_to, idle.sun_from_s)
    first, second = [], []
    for i, (near, far) in enumerate(zip(precedence.near_from, until, strict=True)):
        later = [j for j in range(near, far) if comes_before(precedence, i, j)]
        first += [i] * len(later)
        second += later
    pairs = np.array([first, second], dtype=np.int32)
    lost_s = idle.sun_from_s[pairs[0]] - idle.sun_until_s[pairs[1]]
    is_given = lost_s > 0.0
    return Given(
        first=pairs[0][is_given],
        second=pairs[1][is_given],
        amount=satellite.resources.sunpoint_charge_per_s * lost_s[is_given],
    )


def add_resources(
    program: Program,
    satellite: SatelliteProblem,
    terms: ResourceTerms,
    taken: Ints,
    down: Ints,
    margin: float,
) -> None:
    """Add one satellite's battery and recorder.

    Parameters
    ----------
    terms
        Of the tasks that may be taken.
    taken
        Their columns x. Shape ``(m,)``.
    down
        The columns that say that an image comes down; -1 where there is none. Shape ``(m,)``.
    margin
        How far inside the strict limits to stay; negative to let them be touched.
    """
    _add_battery(program, satellite, terms, taken, margin)
    level = _add_recorder(program, satellite, terms, taken, margin)
    if terms.delivered is not None:
        _add_delivery(program, satellite, terms.delivered, level, taken)
    if terms.comes_down is not None:
        _add_shares(program, terms, level, taken, down, margin)


def _add_battery(
    program: Program, satellite: SatelliteProblem, terms: ResourceTerms, taken: Ints, margin: float
) -> None:
    r = satellite.resources
    start = r.initial_battery_fraction
    first = program.add_columns(
        np.zeros(1),
        lower=max(start, r.battery_min_fraction + margin),
        upper=start,
        is_integer=False,
    )
    level = program.add_columns(
        np.zeros(len(taken)),
        lower=terms.battery_floor + margin,
        upper=terms.full,
        is_integer=False,
    )
    before = np.concatenate([first, level[:-1]])
    _add_changes(program, terms, level, before, taken)
    program.add_rows(Rows.aligned((level, 1.0), (taken, terms.cap_cost), upper=terms.full))
    rise = terms.battery_floor_taken - terms.battery_floor
    high = np.flatnonzero(rise > 0.0)
    program.add_rows(
        Rows.aligned(
            (level[high], 1.0), (taken[high], -rise[high]), lower=terms.battery_floor[high] + margin
        )
    )


def _add_changes(
    program: Program, terms: ResourceTerms, level: Ints, before: Ints, taken: Ints
) -> None:
    """Let each task take its cost, less what it and one other task are given back.

    A task gets back from one before it and from one after it at most. Between two that do not
    follow each other there is less to get than from those in between, so that it need not be
    known which are neighbours.
    """
    given, m = terms.given, len(taken)
    back = program.add_columns(np.zeros(len(given.amount)), is_integer=False)
    own = np.argsort(given.second, kind="stable")
    num_back = np.bincount(given.second, minlength=m)
    at = np.repeat(3 * np.arange(1, m + 1), num_back)
    columns = np.column_stack([level, before, taken]).ravel()
    values = np.column_stack([np.ones(m), -np.ones(m), terms.energy_cost]).ravel()
    program.add_rows(
        Rows.of(
            np.concatenate([[0], np.cumsum(3 + num_back)]).astype(np.int64),
            np.insert(columns, at, back[own]),
            np.insert(values, at, -given.amount[own]),
            upper=0.0,
        )
    )
    for side in (given.first, given.second):
        order = np.argsort(side, kind="stable")
        tasks, counts = np.unique(side, return_counts=True)
        ends = np.cumsum(counts)
        program.add_rows(
            Rows.of(
                np.concatenate([[0], np.cumsum(counts + 1)]).astype(np.int64),
                np.insert(back[order], ends, taken[tasks]),
                np.insert(np.ones(len(side)), ends, -1.0),
                upper=0.0,
            )
        )


def _add_recorder(
    program: Program, satellite: SatelliteProblem, terms: ResourceTerms, taken: Ints, margin: float
) -> Ints:
    """Add the recorder; return the columns of its level after each task."""
    r = satellite.resources
    start = r.initial_recorder_fraction
    top = terms.recorder_top_first - margin
    first = program.add_columns(np.zeros(1), lower=start, upper=min(start, top), is_integer=False)
    level = program.add_columns(
        np.zeros(len(taken)),
        lower=terms.recorder_floor,
        upper=terms.recorder_top - margin,
        is_integer=False,
    )
    before = np.concatenate([first, level[:-1]])
    program.add_rows(
        Rows.aligned((level, 1.0), (before, -1.0), (taken, -terms.data_gain), lower=0.0)
    )
    rise = terms.recorder_floor_taken - terms.recorder_floor
    high = np.flatnonzero((rise != 0.0) & np.isfinite(rise))
    program.add_rows(
        Rows.aligned(
            (level[high], 1.0), (taken[high], -rise[high]), lower=terms.recorder_floor[high]
        )
    )
    return level


def _add_delivery(
    program: Program, satellite: SatelliteProblem, delivered: Floats, level: Ints, taken: Ints
) -> None:
    """Let no image be taken that does not come down.

    Without images nothing is written but telemetry, and the level is that of the start or below.
    """
    images = np.flatnonzero(satellite.kind == COLLECT)
    highest = max(satellite.resources.initial_recorder_fraction, float(delivered.max()))
    last = np.full(len(images), level[-1])
    less = highest - delivered[images]
    program.add_rows(Rows.aligned((last, 1.0), (taken[images], less), upper=highest))


def _add_shares(
    program: Program, terms: ResourceTerms, level: Ints, taken: Ints, down: Ints, margin: float
) -> None:
    """Let an image come down only if the recorder holds no more at the end than is younger.

    What is recorded after each image is a column of its own, so that rows stay short.
    """
    images = np.flatnonzero(down >= 0)
    if len(images) == 0:
        return
    program.add_rows(Rows.aligned((down[images], 1.0), (taken[images], -1.0), upper=0.0))
    fills = np.flatnonzero((terms.data_gain > 0.0) | (down >= 0))
    most = np.append(np.full(len(fills) - 1, np.inf), 0.0)
    after = program.add_columns(np.zeros(len(fills)), upper=most, is_integer=False)
    next_one, gain = taken[fills[1:]], -terms.data_gain[fills[1:]]
    program.add_rows(
        Rows.aligned((after[:-1], 1.0), (after[1:], -1.0), (next_one, gain), lower=0.0, upper=0.0)
    )
    assert terms.comes_down is not None
    free = terms.comes_down[images] + (ON_BOARD if margin < 0.0 else -margin)
    highest = max(float(terms.recorder_top[-1]), float(free.max()))
    last = np.full(len(images), level[-1])
    younger = after[np.searchsorted(fills, images)]
    program.add_rows(
        Rows.aligned((last, 1.0), (younger, -1.0), (down[images], highest - free), upper=highest)
    )
