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

A task that still runs when the next could begin has been booked whole, while some of its
sunlight and telemetry is yet to come. Where it begins the limits allow for that.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from planner_core.certified.mip.program import Program, Rows
from planner_core.problem import (
    CONTACT,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResourceTerms:
    """The coefficients of one satellite's rows, by task; fractions of capacity, shape ``(m,)``.

    Attributes
    ----------
    energy_cost, cap_cost
        What taking a task costs, and what a full battery loses by it.
    full
        Level of a full battery before the task.
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
        names = [f.name for f in fields(self) if f.name != "recorder_top_first"]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


def resource_terms(problem: Problem, satellite: SatelliteProblem) -> ResourceTerms:
    """Return the terms of a satellite that has opportunities."""
    if problem.dynamics == "physical":
        return physical_terms(problem, satellite)
    return event_terms(satellite)


def physical_terms(problem: Problem, satellite: SatelliteProblem) -> ResourceTerms:
    """Return the terms of ``dynamics: physical``: all time outside tasks charges."""
    r = satellite.resources
    start_s, end_s = satellite.start_s, satellite.end_s
    is_contact = satellite.kind == CONTACT
    draw, gain = _task_totals(satellite)
    sunlit_start_s = satellite.sunlight.seconds_until(start_s)
    sunlit_end_s = satellite.sunlight.seconds_until(end_s)
    charged = r.sunpoint_charge_per_s * sunlit_start_s
    cost = draw + r.sunpoint_charge_per_s * (sunlit_end_s - sunlit_start_s)
    floor = r.battery_min_fraction - r.sunpoint_charge_per_s * sunlit_end_s
    next_s = np.append(start_s[1:], problem.horizon_s)
    emptied = np.where(is_contact, -r.telemetry_per_s * end_s, np.inf)
    return ResourceTerms(
        energy_cost=cost,
        cap_cost=cost,
        full=1.0 - charged,
        battery_floor=r.battery_min_fraction
        - r.sunpoint_charge_per_s * _latest_running(satellite, sunlit_start_s, sunlit_end_s),
        battery_floor_taken=floor,
        data_gain=gain,
        recorder_floor=np.minimum.accumulate(np.minimum(emptied, 0.0)),
        recorder_floor_taken=np.where(is_contact, emptied, -np.inf),
        recorder_top=r.recorder_max_fraction - r.telemetry_per_s * next_s,
        recorder_top_first=r.recorder_max_fraction - r.telemetry_per_s * float(start_s[0]),
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
    draw = np.where(is_contact, r.contact_drain_per_s, r.collect_drain_per_s)
    gain = np.where(is_contact, -r.downlink_per_s, r.collect_fill_per_s)
    return duration_s * draw, duration_s * gain


def _latest_running(
    satellite: SatelliteProblem, sunlit_start_s: Floats, sunlit_end_s: Floats
) -> Floats:
    """Return the sunlit time by which whatever may run at each start has ended."""
    latest = sunlit_start_s.copy()
    over = np.searchsorted(satellite.start_s, satellite.end_s)
    for row in range(len(satellite)):
        np.maximum(latest[row : over[row]], sunlit_end_s[row], out=latest[row : over[row]])
    return latest


def add_resources(
    program: Program,
    satellite: SatelliteProblem,
    terms: ResourceTerms,
    taken: Ints,
    margin: float,
) -> None:
    """Add one satellite's battery and recorder.

    Parameters
    ----------
    terms
        Of the tasks that may be taken.
    taken
        Their columns x. Shape ``(m,)``.
    margin
        How far inside the strict limits to stay; negative to let them be touched.
    """
    _add_battery(program, satellite, terms, taken, margin)
    _add_recorder(program, satellite, terms, taken, margin)


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
    cost = terms.energy_cost
    program.add_rows(Rows.aligned((level, 1.0), (before, -1.0), (taken, cost), upper=0.0))
    program.add_rows(Rows.aligned((level, 1.0), (taken, terms.cap_cost), upper=terms.full))
    rise = terms.battery_floor_taken - terms.battery_floor
    high = np.flatnonzero(rise > 0.0)
    program.add_rows(
        Rows.aligned(
            (level[high], 1.0), (taken[high], -rise[high]), lower=terms.battery_floor[high] + margin
        )
    )


def _add_recorder(
    program: Program, satellite: SatelliteProblem, terms: ResourceTerms, taken: Ints, margin: float
) -> None:
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
