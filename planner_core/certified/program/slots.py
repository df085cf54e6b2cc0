"""The problem with continuous starts as a linear program over slots of time, without turns.

An image may start in any slot that its accesses reach into. The battery is *at most*, the recorder
*at least* what the tasks of each slot leave of it, net of idle time as in
``planner_core.certified.program.resources``; limits hold at the end of each slot. All is booked in
favour of the plan:

* an image costs its drain and the charge of the fewest sunlit seconds that it can take, and nothing
  for turns. It is booked whole in the slot in which it starts: at the end of that slot it may still
  run, and be charged until it ends;
* a contact costs exactly its part of each slot. Its data leaves in its first slot, so while it
  lasts the recorder may be below empty by as much;
* the images and contacts of a slot take no longer than the slot and one more image.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.resource_network import left_cost, must_deliver, worth_before_left
from planner_core.certified.program.deliveries import Images, add_deliveries
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.program.resources import add_cost_of_data_left
from planner_core.certified.sizes import SLOT_S
from planner_core.certified.tolerances import DOWN, ON_BOARD, ROUNDED_S, ROUNDING
from planner_core.precedence.antennas import antenna_groups
from planner_core.precedence.time_windows import time_windows_of
from planner_core.problem import CONTACT, Floats, Ints, Longs, Problem, SatelliteProblem
from planner_core.problem.delivery import lost_on_board


def has_slot_program(problem: Problem) -> bool:
    """Whether there is a program, and all valid plans keep its limits.

    They may be broken by frozen actions, and where idling alone would break them.
    """
    has_limits = problem.use_resources and problem.dynamics == "physical"
    is_meant = has_limits and problem.continuous_starts and problem.pinned.frozen_until_s is None
    has_tasks = len(problem.opportunities) > 0
    return (
        is_meant
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
        slots = _Slots.of(problem, index)
        image = program.add_columns((on_board if ages else worth)[slots.row])
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
        site.append(problem.opportunities.site[slots.row])
        columns.append(image)
    if columns:
        program.add_rows(_sums(np.concatenate(site), np.concatenate(columns), upper=1.0))
    groups = antenna_groups(problem)
    limits = [float(group.limit) for group in groups]
    program.add_rows(Rows.at_most([taken[group.rows] for group in groups], limits))
    return program


def _add_deliveries(
    program: Program, problem: Problem, index: int, slots: _Slots, image: Ints, taken: Ints
) -> None:
    """Add what images earn by the contacts after their accesses, whatever the slot."""
    satellite, windows = problem.satellites[index], time_windows_of(problem, index)
    whole = program.add_columns(np.zeros(len(windows.row)), is_integer=False)
    offsets = np.searchsorted(slots.window, np.arange(len(whole) + 1))
    program.add_rows(Rows.no_more_than(whole, image, offsets))
    images = Images(
        row=windows.row,
        columns=whole,
        first_end_s=windows.open_s + windows.length_s - ROUNDED_S,
        last_end_s=windows.close_s + windows.length_s + ROUNDED_S,
        on_board=(problem.worth - lost_on_board(problem))[windows.row],
    )
    add_deliveries(program, problem, satellite, images, taken[satellite.rows])


class _Slots(NamedTuple):
    """One satellite's images by the slot in which they start, and its contacts.

    Attributes
    ----------
    edge_s
        Where slots begin and end. Shape ``(num_slots + 1,)``.
    window, row, slot, from_s, to_s, length_s
        Time window, opportunity, slot, first and last start in it, and length of each image, window
        by window. Shape ``(num_images,)``.
    contacts
        The satellite's contacts among its tasks. Shape ``(num_contacts,)``.
    part, during_s
        Contact and slot of each part of a contact, and its seconds there.
        Shapes ``(2, num_parts)`` and ``(num_parts,)``.
    """

    edge_s: Floats
    window: Longs
    row: Ints
    slot: Longs
    from_s: Floats
    to_s: Floats
    length_s: Floats
    contacts: Longs
    part: Longs
    during_s: Floats

    @property
    def num_slots(self) -> int:
        return len(self.edge_s) - 1

    @classmethod
    def of(cls, problem: Problem, index: int) -> _Slots:
        satellite, windows = problem.satellites[index], time_windows_of(problem, index)
        num_slots = max(1, math.ceil(problem.horizon_s / SLOT_S))
        edge_s = np.linspace(0.0, problem.horizon_s, num_slots + 1)
        open_s, close_s = windows.open_s - ROUNDED_S, windows.close_s + ROUNDED_S
        first, last = (_slot_of(edge_s, at_s) for at_s in (open_s, close_s))
        count = last - first + 1
        window = np.repeat(np.arange(len(count)), count)
        slot = np.arange(len(window)) - np.repeat(np.cumsum(count) - count - first, count)
        contacts = np.flatnonzero(satellite.kind == CONTACT)
        start_s, end_s = satellite.start_s[contacts, None], satellite.end_s[contacts, None]
        during_s = np.minimum(end_s, edge_s[1:]) - np.maximum(start_s, edge_s[:-1])
        part = np.array(np.nonzero(during_s > 0.0))
        return cls(
            edge_s=edge_s,
            window=window,
            row=windows.row[window],
            slot=slot,
            from_s=np.maximum(open_s[window], edge_s[slot]),
            to_s=np.minimum(close_s[window], edge_s[slot + 1]),
            length_s=windows.length_s[window],
            contacts=contacts,
            part=part,
            during_s=during_s[tuple(part)],
        )


def _slot_of(edge_s: Floats, at_s: Floats) -> Longs:
    """Return the slot of each instant; its end belongs to a slot, its beginning does not."""
    return np.clip(np.searchsorted(edge_s, at_s) - 1, 0, len(edge_s) - 2).astype(np.int64)


def _add_battery(
    program: Program, satellite: SatelliteProblem, slots: _Slots, image: Ints, contact: Ints
) -> None:
    r, horizon_s = satellite.resources, slots.edge_s[-1]

    def charge(from_s: Floats, to_s: Floats) -> Floats:
        ends_s = (np.clip(at_s, 0.0, horizon_s) for at_s in (to_s, from_s))
        until, before = map(satellite.sunlight.seconds_until, ends_s)
        return r.sunpoint_charge_per_s * (until - before)

    longest_s = float(slots.length_s.max(initial=0.0))
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
    until_s = slots.to_s + slots.length_s
    dark = r.sunpoint_charge_per_s * (until_s - slots.from_s) - charge(slots.from_s, until_s)
    forgone = np.maximum(r.sunpoint_charge_per_s * slots.length_s - dark, 0.0)
    which, where = slots.part
    begin_s = np.maximum(satellite.start_s[slots.contacts[which]], slots.edge_s[where])
    paid = r.contact_drain_per_s * slots.during_s + charge(begin_s, begin_s + slots.during_s)
    drained = r.collect_drain_per_s * slots.length_s + forgone
    initial = np.append(r.initial_battery_fraction, none[1:])
    changes = (slots.slot, image, drained), (where, contact[which], paid)
    program.add_rows(_levels(level, *changes, upper=initial))


def _add_recorder(
    program: Program, satellite: SatelliteProblem, slots: _Slots, image: Ints, contact: Ints
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
    first = _slot_of(slots.edge_s, satellite.start_s[slots.contacts])
    gain = r.collect_fill_per_s * slots.length_s
    initial = np.append(r.initial_recorder_fraction, np.zeros(n - 1))
    changes = (slots.slot, image, -gain), (first, contact, volume)
    program.add_rows(_levels(level, *changes, lower=initial))
    end_s = satellite.end_s[slots.contacts]
    which, where = slots.part
    goes_on = end_s[which] > slots.edge_s[where + 1]
    lasting = where[goes_on], contact[which[goes_on]], volume[which[goes_on]]
    own = np.arange(n), level, np.ones(n)
    program.add_rows(_sums(*_joined(own, lasting), lower=-telemetry))
    return level


def _add_times(
    program: Program, satellite: SatelliteProblem, slots: _Slots, image: Ints, contact: Ints
) -> None:
    """Limit what starts in each slot by its length, and contacts at an instant to one."""
    which, where = slots.part
    slot = np.concatenate([slots.slot, where])
    length_s = np.concatenate([slots.length_s, slots.during_s])
    most_s = slots.edge_s[1] + float(slots.length_s.max(initial=0.0)) + ROUNDED_S
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
