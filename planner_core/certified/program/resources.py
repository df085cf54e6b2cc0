"""Battery and recorder of one satellite as linear rows, exact for both dynamics.

More energy and less data never hurt a plan, so saturation at full and empty needs no binary
columns: the battery is *at most* what flows in allows and at most full, the recorder *at least*
what flows in and at least empty. Each task is booked whole at its start, as in
``planner_core.mdp.track``.

The columns hold levels net of idle time (charge of all sunlit seconds so far, telemetry of all
seconds so far). Idling is then free, and a level changes at tasks only:

* ``E[k] <= E[k-1] - energy_cost[k] * x[k]``, ``E[k] + cap_cost[k] * x[k] <= full[k]``;
* ``G[k] >= G[k-1] + data_gain[k] * x[k]``, ``G[k] >= empty[k]`` if k is a contact;
* and the limits, at the instants when the booked level is lowest (or highest).

Images come down in the order in which they were taken. So one is on the ground at the end if the
recorder then holds no more than what was recorded after it (``_add_shares``).

A task that still runs when the next could begin has been booked whole, while some of its
sunlight and telemetry is yet to come. The limits at the next task's start allow for that.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.program.resource_terms import ResourceTerms
from planner_core.certified.tolerances import ON_BOARD
from planner_core.problem import COLLECT, Floats, Ints, SatelliteProblem


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
        The columns for images that come down; -1 for none. Shape ``(m,)``.
    margin
        How far inside the strict limits to stay; negative to let plans touch them.
    """
    _add_battery(program, satellite, terms, taken, margin)
    level = _add_recorder(program, satellite, terms, taken, margin)
    if terms.delivered is not None:
        _add_delivery(program, satellite, terms.delivered, level, taken)
    _add_shares(program, terms, level, taken, down, margin)
    if terms.left_cost > 0.0:
        start = max(satellite.resources.initial_recorder_fraction, 0.0)
        add_cost_of_data_left(program, terms.left_cost, start, level[-1:])


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
    """Charge each task its cost, less what is given back to it and another task as a pair.

    A task is in at most one pair with a task before it and one with a task after it. A pair of
    tasks that are not neighbours gets less than those with the tasks in between would, so that the
    program need not know which are neighbours.
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
        program.add_rows(Rows.limited(back, np.ones(len(back)), side, taken, np.ones(m)))


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
    """Allow only images that come down.

    Without images only telemetry is recorded, and the net level is at most that of the start.
    """
    images = np.flatnonzero(satellite.kind == COLLECT)
    highest = max(satellite.resources.initial_recorder_fraction, float(delivered.max()))
    last = np.full(len(images), level[-1])
    less = highest - delivered[images]
    program.add_rows(Rows.aligned((last, 1.0), (taken[images], less), upper=highest))


def _add_shares(
    program: Program, terms: ResourceTerms, level: Ints, taken: Ints, down: Ints, margin: float
) -> None:
    """Let an image come down only if all that the recorder holds at the end was recorded after it.

    The data recorded after each image has its own column, so that rows stay short.
    """
    images = np.flatnonzero(down >= 0)
    if len(images) == 0 or terms.comes_down is None:
        return
    program.add_rows(Rows.aligned((down[images], 1.0), (taken[images], -1.0), upper=0.0))
    fills = np.flatnonzero((terms.data_gain > 0.0) | (down >= 0))
    gain = terms.data_gain[fills[1:]]
    upper = np.append(np.full(len(fills) - 1, np.inf), 0.0)
    most = np.append(np.cumsum(gain[::-1])[::-1], 0.0)
    after = program.add_columns(np.zeros(len(fills)), upper=upper, most=most, is_integer=False)
    next_one = taken[fills[1:]]
    program.add_rows(
        Rows.aligned((after[:-1], 1.0), (after[1:], -1.0), (next_one, -gain), lower=0.0, upper=0.0)
    )
    free = terms.comes_down[images] + (ON_BOARD if margin < 0.0 else -margin)
    highest = max(float(terms.recorder_top[-1]), float(free.max()))
    last = np.full(len(images), level[-1])
    younger = after[np.searchsorted(fills, images)]
    program.add_rows(
        Rows.aligned((last, 1.0), (younger, -1.0), (down[images], highest - free), upper=highest)
    )


def add_cost_of_data_left(program: Program, left_cost: float, start: float, last: Ints) -> None:
    """Charge for data that the recorder holds at the end beyond what it held at the start.

    Parameters
    ----------
    start
        Its level at the start, at least 0.
    last
        The column of its level after the last task.
    """
    # No more than the recorder holds, with room for rounding.
    left = program.add_columns(
        np.array([-left_cost]), lower=-start, upper=np.inf, most=2.0, is_integer=False
    )
    program.add_rows(Rows.aligned((left, 1.0), (last, -1.0), lower=-start))
