"""Coefficients of the rows for one satellite's battery and recorder (``resources.py``)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np

from planner_core.certified.dp.resource_network import left_cost, must_deliver, network_of
from planner_core.mdp.idle_energy import IdleEnergy, idle_energy
from planner_core.precedence.relation import comes_before, direct_precedence
from planner_core.problem import (
    CONTACT,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Given:
    """Energy given back to pairs of tasks with no time at the sun; shape ``(num_pairs,)``.

    Each task pays for its turns to the sun and back as if they always took place. Between two tasks
    that follow each other sooner, the charge would be negative, which this makes up for.

    Attributes
    ----------
    first, second
        The tasks.
    amount
        In battery capacities.
    """

    first: Ints
    second: Ints
    amount: Floats

    def of_part(self, rows: Ints, num_tasks: int) -> Given:
        """Return the pairs of which both tasks are in ``rows``."""
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
    """Coefficients of one satellite's rows, by task; fractions of capacity, shape ``(m,)``.

    Attributes
    ----------
    energy_cost, cap_cost
        What taking a task costs, and what a full battery loses by it.
    full
        Level of a full battery before the task if it is not taken; if it is, lower by the excess of
        ``cap_cost`` over ``energy_cost``.
    battery_floor, battery_floor_taken
        Lowest level after the task: in any case, and if it is taken.
    data_gain
        What taking a task records (or, if negative, takes down).
    recorder_floor, recorder_floor_taken
        Level of an empty recorder, below which contacts cannot bring it: in any case, and if taken.
    recorder_top
        Highest level until the next task begins.
    recorder_top_first
        Highest level before the first task.
    given
        Energy given back to pairs of tasks.
    delivered
        Highest level at the end with each task as the last image, if images must come down.
    comes_down
        Highest level at the end with each image on the ground, if some may stay on board.
    left_cost
        Cost of a full recorder at the end, in worth.
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
    left_cost: float = 0.0

    def of_part(self, rows: Ints) -> ResourceTerms:
        """Return the terms if only some of the tasks, in ascending order, may be taken.

        Limits of the others still hold. Those of the battery loosen with time, so that tasks before
        have tighter ones; those of the recorder tighten, and go over to the task before.
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


def resource_terms(
    problem: Problem, satellite: SatelliteProblem, *, costs_left: bool
) -> ResourceTerms:
    """Return the terms of a satellite that has opportunities.

    Parameters
    ----------
    costs_left
        Whether data left on board costs worth, as in the other searches (``left_cost``).
    """
    terms = (
        physical_terms(problem, satellite)
        if problem.dynamics == "physical"
        else event_terms(satellite)
    )
    if must_deliver(problem, satellite):
        return replace(terms, delivered=network_of(problem, satellite).delivered)
    if costs_left:
        return replace(terms, left_cost=left_cost(problem, satellite))
    if problem.counts_delivery:
        return replace(terms, comes_down=network_of(problem, satellite).data_floor)
    return terms


def physical_terms(problem: Problem, satellite: SatelliteProblem) -> ResourceTerms:
    """Return the terms of ``dynamics: physical``: time outside tasks and turns charges."""
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
    # A satellite may leave the sun for a later task before the turn to this one would begin: a task
    # that is not taken must not cap the battery below what later ones allow.
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
    # Idle time only charges: the lowest level at each start is that of a task that may still run.
    latest = charged_to.copy()
    over = np.searchsorted(satellite.start_s, satellite.end_s)
    for row in range(len(satellite)):
        np.maximum(latest[row : over[row]], charged_from[row], out=latest[row : over[row]])
    return r.battery_min_fraction - latest


def _given(satellite: SatelliteProblem, idle: IdleEnergy) -> Given:
    """Return the energy given back to pairs of tasks with no time at the sun in between."""
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
