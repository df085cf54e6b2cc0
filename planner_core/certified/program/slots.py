"""The problem as a linear program over slots of time, without turns.

An image may start in any slot that its accesses reach into or, without continuous starts, in which
one of its opportunities does. The battery is *at most*, the recorder *at least* what the tasks of
each slot leave of it, net of idle time as in ``planner_core.certified.program.resources``; limits
hold at the end of each slot. All is booked in favour of the plan:

* an image costs its drain and the charge of the fewest sunlit seconds that it can take, and nothing
  for turns. It is booked whole in the slot in which it starts: at the end of that slot it may still
  run, and be charged until it ends;
* a contact costs exactly its part of each slot. Its data leaves in its first slot, so while it
  lasts the recorder may be below empty by as much;
* the images and contacts of a slot take no longer than the slot and one more image.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.resource_network import left_cost, must_deliver, worth_before_left
from planner_core.certified.program.deliveries import Images, add_deliveries
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.program.resources import add_cost_of_data_left
from planner_core.certified.program.slot_table import SlotTable, slot_table
from planner_core.certified.tolerances import DOWN, ON_BOARD, ROUNDED_S, ROUNDING
from planner_core.precedence.antennas import antenna_groups
from planner_core.problem import Floats, Ints, Longs, Problem, SatelliteProblem
from planner_core.problem.delivery import lost_on_board


def has_slot_program(problem: Problem) -> bool:
    """Whether there is a program, and all valid plans keep its limits.

    They may be broken by frozen actions, and where idling alone would break them.
    """
    has_limits = problem.use_resources and problem.dynamics == "physical"
    ages = problem.counts_delivery and problem.objective.half_life_s is not None
    is_meant = problem.pinned.frozen_until_s is None and (problem.continuous_starts or not ages)
    has_tasks = len(problem.opportunities) > 0
    return (
        has_limits
        and is_meant
        and has_tasks
        and all(
            _keeps_limits_idle(satellite, problem.horizon_s)
            for satellite in problem.satellites
            if len(satellite)
        )
    )


def _keeps_limits_idle(satellite: SatelliteProblem, horizon_s: float) -> bool:
    """Whether a satellite that stays at the sun keeps the limits of battery and recorder."""
    r, sunlight = satellite.resources, satellite.sunlight
    edges_s = np.concatenate([sunlight.enter_s, sunlight.exit_s]).clip(0.0, horizon_s)
    at_s = np.unique(np.concatenate([[0.0, horizon_s], edges_s]))
    charged = r.sunpoint_charge_per_s * sunlight.seconds_until(at_s)
    level = lowest = r.initial_battery_fraction
    for gain in np.diff(charged - r.idle_drain_per_s * at_s).tolist():
        level = min(1.0, level + gain)
        lowest = min(lowest, level)
    recorded = max(r.initial_recorder_fraction, 0.0) + r.telemetry_per_s * horizon_s
    return (
        lowest > r.battery_min_fraction + ROUNDING and recorded < r.recorder_max_fraction - ROUNDING
    )


def slot_program(problem: Problem, *, costs_left: bool) -> Program:
    """Return the program.

    Parameters
    ----------
    costs_left
        Whether data that stays on board has a cost per unit, instead of images a loss.
    """
    program = Program()
    on_board = problem.worth - lost_on_board(problem)
    ages = problem.counts_delivery and problem.objective.half_life_s is not None
    worth = worth_before_left(problem) if costs_left else problem.worth
    taken = np.full(len(problem.opportunities), -1, dtype=np.int32)
    site, columns = [], []
    for index, satellite in enumerate(problem.satellites):
        if len(satellite) == 0:
            continue
        slots = slot_table(problem, index)
        image = program.add_columns(slots.images.most(on_board if ages else worth))
        contact = program.add_columns(np.zeros(len(slots.contacts)))
        taken[satellite.rows[slots.contacts]] = contact
        _add_battery(program, satellite, slots, image, contact)
        level = _add_recorder(program, satellite, slots, image, contact)
        _add_times(program, satellite, slots, image, contact)
        start = max(satellite.resources.initial_recorder_fraction, 0.0) + ON_BOARD
        if must_deliver(problem, satellite):
            program.add_rows(Rows.aligned((level[-1:], 1.0), upper=start))
        elif costs_left:
            add_cost_of_data_left(program, left_cost(problem, satellite), start, level[-1:])
        if ages:
            _add_deliveries(program, problem, index, slots, image, taken)
        site.append(problem.opportunities.site[slots.windows.row[slots.images.window]])
        columns.append(image)
    if columns:
        program.add_rows(_sums(np.concatenate(site), np.concatenate(columns), upper=1.0))
    groups = antenna_groups(problem)
    limits = [float(group.limit) for group in groups]
    program.add_rows(Rows.at_most([taken[group.rows] for group in groups], limits))
    return program


def _add_deliveries(
    program: Program, problem: Problem, index: int, slots: SlotTable, image: Ints, taken: Ints
) -> None:
    """Add what images earn by the contacts after their accesses, whatever the slot."""
    satellite, windows = problem.satellites[index], slots.windows
    whole = program.add_columns(np.zeros(len(windows.row)), is_integer=False)
    offsets = np.searchsorted(slots.images.window, np.arange(len(whole) + 1))
    program.add_rows(Rows.no_more_than(whole, image, offsets))
    images = Images(
        row=windows.row,
        columns=whole,
        first_end_s=windows.open_s + windows.length_s - ROUNDED_S,
        last_end_s=windows.close_s + windows.length_s + ROUNDED_S,
        on_board=(problem.worth - lost_on_board(problem))[windows.row],
    )
    add_deliveries(program, problem, satellite, images, taken[satellite.rows])


def _add_battery(
    program: Program, satellite: SatelliteProblem, slots: SlotTable, image: Ints, contact: Ints
) -> None:
    r, horizon_s = satellite.resources, slots.edge_s[-1]

    def charge(from_s: Floats, to_s: Floats) -> Floats:
        ends_s = (np.clip(at_s, 0.0, horizon_s) for at_s in (to_s, from_s))
        until, before = map(satellite.sunlight.seconds_until, ends_s)
        return r.sunpoint_charge_per_s * (until - before)

    images = slots.images
    longest_s = float(images.length_s.max(initial=0.0))
    end_s = slots.edge_s[1:]
    idle = r.idle_drain_per_s * end_s
    none = np.zeros(len(end_s))
    level = program.add_columns(
        none,
        lower=r.battery_min_fraction + idle - charge(none, end_s + longest_s) - ROUNDING,
        upper=1.0 + idle - charge(none, end_s) + ROUNDING,
        is_integer=False,
    )
    # However the image lies in its span, no more of it is dark than of the whole span.
    until_s = images.to_s + images.length_s
    dark = r.sunpoint_charge_per_s * (until_s - images.from_s) - charge(images.from_s, until_s)
    forgone = np.maximum(r.sunpoint_charge_per_s * images.length_s - dark, 0.0)
    which, where = slots.part
    begin_s = np.maximum(satellite.start_s[slots.contacts[which]], slots.edge_s[where])
    paid = r.contact_drain_per_s * slots.during_s + charge(begin_s, begin_s + slots.during_s)
    drained = r.collect_drain_per_s * images.length_s + forgone
    initial = np.append(r.initial_battery_fraction, none[1:])
    changes = (images.slot, image, drained), (where, contact[which], paid)
    program.add_rows(_levels(level, *changes, upper=initial))


def _add_recorder(
    program: Program, satellite: SatelliteProblem, slots: SlotTable, image: Ints, contact: Ints
) -> Ints:
    """Add the recorder; return the columns of its level at the end of each slot."""
    r, n = satellite.resources, slots.num_slots
    telemetry = r.telemetry_per_s * slots.edge_s[1:]
    volume = satellite.volume[slots.contacts] + DOWN
    level = program.add_columns(
        np.zeros(n),
        lower=-telemetry - float(volume.max(initial=0.0)),
        upper=r.recorder_max_fraction - telemetry + ROUNDING,
        is_integer=False,
    )
    images, first = slots.images, slots.slot_of(satellite.start_s[slots.contacts])
    gain = r.collect_fill_per_s * images.length_s
    initial = np.append(r.initial_recorder_fraction, np.zeros(n - 1))
    changes = (images.slot, image, -gain), (first, contact, volume)
    program.add_rows(_levels(level, *changes, lower=initial))
    end_s = satellite.end_s[slots.contacts]
    which, where = slots.part
    goes_on = end_s[which] > slots.edge_s[where + 1]
    lasting = where[goes_on], contact[which[goes_on]], volume[which[goes_on]]
    own = np.arange(n), level, np.ones(n)
    program.add_rows(_sums(*_joined(own, lasting), lower=-telemetry))
    return level


def _add_times(
    program: Program, satellite: SatelliteProblem, slots: SlotTable, image: Ints, contact: Ints
) -> None:
    """Limit what starts in each slot by its length, and contacts at an instant to one."""
    which, where = slots.part
    images = slots.images
    slot = np.concatenate([images.slot, where])
    length_s = np.concatenate([images.length_s, slots.during_s])
    most_s = slots.edge_s[1] + float(images.length_s.max(initial=0.0)) + ROUNDED_S
    columns = np.concatenate([image, contact[which]])
    program.add_rows(_sums(slot, columns, length_s, upper=most_s))
    start_s, end_s = satellite.start_s[slots.contacts], satellite.end_s[slots.contacts]
    at_once = (start_s <= start_s[:, None]) & (end_s > start_s[:, None])
    instant, during = np.nonzero(at_once & (at_once.sum(axis=1) > 1)[:, None])
    program.add_rows(_sums(instant, contact[during], upper=1.0))


_Term = tuple[Longs, Ints, Floats]
"""Slots, columns, and the amount of each."""


def _levels(
    level: Ints, *changes: _Term, lower: Floats | float = -np.inf, upper: Floats | float = np.inf
) -> Rows:
    """Return rows for a level after each slot, less that before it, and what tasks change."""
    slot, ones = np.arange(len(level)), np.ones(len(level))
    own = (slot, level, ones), (slot[1:], level[:-1], -ones[1:])
    return _sums(*_joined(*own, *changes), lower=lower, upper=upper)


def _joined(*terms: _Term) -> _Term:
    slot, column, amount = zip(*terms, strict=True)
    return np.concatenate(slot), np.concatenate(column), np.concatenate(amount)


def _sums(
    group: Longs | Ints,
    column: Ints,
    value: Floats | float = 1.0,
    *,
    lower: Floats | float = -np.inf,
    upper: Floats | float = np.inf,
) -> Rows:
    """Return a row for each group of columns, in order of group."""
    order = np.argsort(group, kind="stable")
    _, counts = np.unique(group, return_counts=True)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    values = np.broadcast_to(np.asarray(value, dtype=np.float64), column.shape)
    return Rows.of(offsets, column[order], values[order], lower=lower, upper=upper)
