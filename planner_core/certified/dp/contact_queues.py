"""The most that one satellite gains under battery and recorder where images wait for contacts.

As in ``contact_layers`` there is a layer for each contact, in which that one is the next to be
taken. Here a path also knows what its recorder holds. That says when each image is down if that
contact brings it down: once all that was recorded before it is down as well. What the contact has
no time for comes down in another, and a path with such images promises which one of the next that
is: their levels of data are listed once for each promise. So nothing is left out but antennas, and
that a target may be imaged twice; energy and data are in levels, rounded in favour of the
satellite or against it.

Worth is counted in small units, so that a path is found again from its value alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.energy_labels import EnergyLevels, given_between, raise_to, sink
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import ANYWHERE, AT_START, UNREACHED_UNITS
from planner_core.certified.sizes import MAX_QUEUE_ENTRIES
from planner_core.certified.tolerances import LEVEL
from planner_core.jit import inlined, inner, kernel
from planner_core.problem import Bytes, Floats, Ints


@bundle
class Queues(NamedTuple):
    """One satellite's tasks, contacts and images; shape ``(m,)`` unless said otherwise.

    Attributes
    ----------
    contact
        Tasks, ascending. Shape ``(num_contacts,)``.
    number
        Which contact each task is; -1 for others.
    first
        Of each layer, the earliest contact that a path may go on from in it; -1 for the start.
        Shape ``(num_contacts + 1,)``.
    down_s
        When each contact has taken down so many steps of what was recorded; infinite for what it
        has no time for. Shape ``(num_contacts, num_steps)``.
    step
        In recorder capacities.
    ready_s
        When each contact begins to take down. Shape ``(num_contacts,)``.
    volume
        What each contact takes down, in recorder capacities. Shape ``(num_contacts,)``.
    num_classes
        Of promises: the next contact after a layer's own, the one after that, ..., any later one.
    queued
        What was recorded when an image has ended, less what is so at a level of 0.
    end_s, on_board, decaying, most
        When each task ends, and what it earns on board, by how much more if it is down at
        once, and at most.
    price
        What each costs.
    unit
        Of worth.
    num_tables
        Before so many further tasks all may follow a task for nothing.
    takes_worthless
        Whether a path may need tasks that are worth nothing.
    """

    network: Network
    energy: EnergyLevels
    data: DataLevels
    contact: Ints
    number: Ints
    first: Ints
    down_s: Floats
    step: float
    ready_s: Floats
    volume: Floats
    num_classes: int
    queued: Floats
    end_s: Floats
    on_board: Floats
    decaying: Floats
    most: Floats
    price: Floats
    half_life_s: float
    unit: float
    num_tables: int
    takes_worthless: bool


class _Tables(NamedTuple):
    """The most units of a path that ends with a task, at each level of data and energy.

    A layer has levels of data up to what its contact takes down, and then all higher ones for each
    class of promises; ``_level_of`` tells them. An entry stands for at least so much energy,
    counted from the task's ``lowest``; what is below 0 is not reached.

    Attributes
    ----------
    own
        Of tasks, each until all may follow it for nothing, or all of a stretch. Shape
        ``(num_tables, most_listed, width)``.
    low, high
        The listed levels reached, by task. Shape ``(m,)``.
    at_contact
        Of contacts, when they end their layers, by what was promised, 0 for nothing. Shape
        ``(num_contacts, num_classes + 1, num_levels, width)``.
    """

    own: Ints
    low: Ints
    high: Ints
    at_contact: Ints


@kernel
def most_by_queues(q: Queues, stop: Bytes) -> tuple[float, Ints]:
    """Return the most that a path gains, and the rows of one that does.

    Answers infinity once ``stop`` is set, and no rows where these would take too much room.
    """
    m, num_levels, width = len(q.number), q.data.num_levels, q.energy.width
    num_contacts = len(q.contact)
    num_listed = (q.num_classes + 1) * num_levels  # of a contact that ends its layer
    for layer in range(num_contacts):
        num_listed = max(num_listed, _num_listed(q, layer))
    states = (num_contacts, q.num_classes + 1, num_levels, width)
    tables = _Tables(
        np.empty((q.num_tables, num_listed, width), dtype=np.int32),
        np.empty(m, dtype=np.int32),
        np.empty(m, dtype=np.int32),
        np.full(states, UNREACHED_UNITS, dtype=np.int32),
    )
    best, last, level = 0, -1, 0
    for layer in range(num_contacts + 1):
        if stop[0]:
            return np.inf, np.empty(0, dtype=np.int32)
        best, last, level = _fill(q, layer, ANYWHERE, tables)
    return max(best, 0) * q.unit, _path_to(q, tables, best, last, level)


@inlined
def _top_of(q: Queues, layer: int) -> int:
    """Return how many levels of data the contact of a layer takes down as a whole."""
    if layer == len(q.contact):
        return int(q.data.num_levels)
    k = q.contact[layer]
    return int(min(max(q.data.floor[k] - q.data.gain[k] + 1, 0), q.data.num_levels))


@inlined
def _num_listed(q: Queues, layer: int) -> int:
    top = _top_of(q, layer)
    return int(top + q.num_classes * (q.data.num_levels - top))


@inlined
def _level_of(q: Queues, top: int, listed: int) -> tuple[int, int]:
    """Return the level of data that is listed there, and the class of promises; 0 for none."""
    if listed < top:
        return listed, 0
    beyond = q.data.num_levels - top
    return top + (listed - top) % beyond, 1 + (listed - top) // beyond


@inlined
def _listed(q: Queues, top: int, level: int, promised: int) -> int:
    """Return where a level of data is listed with a promise."""
    if level < top:
        return level
    return int(level + (promised - 1) * (q.data.num_levels - top))


@inner
def _fill(q: Queues, layer: int, source: int, tables: _Tables) -> tuple[int, int, int]:
    """Fill the tables of a layer with paths from one contact, from the start, or from any.

    Return the most units of any path in it, its last task and the level of its data.
    """
    network, energy, data = q.network, q.energy, q.data
    own, low, high = tables.own, tables.low, tables.high
    num_contacts = len(q.contact)
    top, num_listed = _top_of(q, layer), _num_listed(q, layer)
    low[:], high[:] = num_listed, -1
    begin, end = _stretch(q, layer, source)
    idle = np.full((num_listed, energy.width), UNREACHED_UNITS, dtype=np.int32)
    reached = np.array([num_listed, -1])
    base = energy.lowest[begin] if end > begin else 0
    if begin == 0 and source < 0 and q.first[layer] < 0:
        for promised in range(1, 1 + (q.num_classes if data.start >= top else 1)):
            at = _listed(q, top, data.start, promised)
            idle[at, : max(0, energy.start - base + 1)] = 0
            reached[0], reached[1] = min(reached[0], at), max(reached[1], at)
    earned = np.zeros(num_listed, dtype=np.int32)
    best, last, level, merged, kept = 0, -1, data.start, 0, 0
    for k in range(begin, end):
        for y in range(reached[0], reached[1] + 1):
            sink(idle[y], base - energy.lowest[k])
        base = energy.lowest[k]
        while merged < len(q.number) and network.idle_from[network.by_idle[merged]] <= k:
            i = network.by_idle[merged]
            merged += 1
            if i < kept:
                continue
            for y in range(low[i], high[i] + 1):
                raise_to(idle[y], own[i % len(own), y], energy.lowest[i] - base)
            reached[0], reached[1] = min(reached[0], low[i]), max(reached[1], high[i])
        number, table = q.number[k], own[k % len(own)]
        if number >= 0 and number != layer:
            if source < AT_START or source == number:
                _begin_with(q, tables, k, number, layer)
                _spread(q, tables, k, top)
        elif _earn(q, k, layer, earned):
            _take(q, k, layer, kept, earned, idle, reached, tables)
        if number == layer:
            for at in range(low[k], high[k] + 1):
                y, promised = at % data.num_levels, at // data.num_levels
                tables.at_contact[number, promised, y] = table[at]
        if network.is_kept[k]:
            idle[:] = UNREACHED_UNITS
            reached[0], reached[1] = num_listed, -1
            best, last, kept = -1, -1, k
        for y in range(low[k], high[k] + 1):
            if layer == num_contacts and table[y, 0] > best:
                best, last, level = table[y, 0], k, y
    return best, last, level


@inner
def _begin_with(q: Queues, tables: _Tables, k: int, number: int, layer: int) -> None:
    """Go on in a layer from the contact that ended an earlier one."""
    table, states = tables.own[k % len(tables.own)], tables.at_contact[number]
    tables.low[k], tables.high[k] = 0, q.data.num_levels - 1
    promised = min(layer - number, q.num_classes)
    for y in range(q.data.num_levels):
        for x in range(table.shape[1]):
            table[y, x] = max(states[0, y, x], states[promised, y, x])


@inner
def _spread(q: Queues, tables: _Tables, k: int, top: int) -> None:
    """List the higher levels of a table once for each promise."""
    table, beyond = tables.own[k % len(tables.own)], q.data.num_levels - top
    for promised in range(2, q.num_classes + 1):
        first = _listed(q, top, top, promised)
        for y in range(beyond):
            for x in range(table.shape[1]):
                table[first + y, x] = table[top + y, x]
        tables.high[k] = first + beyond - 1


@inner
def _stretch(q: Queues, layer: int, source: int) -> tuple[int, int]:
    """Return the tasks of a layer that paths from a contact, or from any, may take."""
    end = q.contact[layer] + 1 if layer < len(q.contact) else len(q.number)
    begin = q.contact[q.first[layer]] if q.first[layer] >= 0 else 0
    return (q.contact[source] if source >= 0 else begin), end


@inner
def _earn(q: Queues, k: int, layer: int, earned: Ints) -> bool:
    """Fill in the units that a task adds by the level of data after it, and say whether any may.

    -1 where no path needs to take it.
    """
    if q.number[k] >= 0:
        earned[:] = 0
        return True
    is_any, top = False, _top_of(q, layer)
    for at in range(len(earned)):
        level, promised = _level_of(q, top, at)
        down_s = _down_s(q, layer, promised, max(0.0, q.data.least[level] + q.queued[k]))
        worth = q.decaying[k] * 2.0 ** (-max(down_s - q.end_s[k], 0.0) / q.half_life_s)
        worth = min(q.on_board[k] + worth, q.most[k]) - q.price[k]
        earned[at] = int(np.ceil(worth / q.unit - LEVEL)) if worth > 0.0 else 0
        if earned[at] == 0 and not (q.takes_worthless or q.network.is_kept[k]):
            earned[at] = -1
        is_any = is_any or earned[at] >= 0
    return is_any


@inner
def _down_s(q: Queues, layer: int, promised: int, amount: float) -> float:
    """Return when so much of a queue may be down; infinite for never."""
    if layer == len(q.contact):
        return np.inf
    at = int(amount / q.step)
    down_s = q.down_s[layer, at] if at < q.down_s.shape[1] else np.inf
    if down_s < np.inf:
        return down_s
    at = int(max(0.0, amount - q.volume[layer]) / q.step)
    after = layer + promised
    if 0 < promised < q.num_classes:
        is_whole = after < len(q.contact) and at < q.down_s.shape[1]
        if is_whole and q.down_s[after, at] < np.inf:
            return float(q.down_s[after, at])
    return _later_down_s(q, max(after, layer + 1), at)


@inlined
def _later_down_s(q: Queues, after: int, at: int) -> float:
    """Return when so many steps may be down by a contact from ``after`` on, or by several.

    A level that a contact takes down as a whole, by its rounding, may need another one too.
    """
    earliest_s, is_short = np.inf, False
    for contact in range(after, len(q.contact)):
        down_s = q.ready_s[contact]
        if not is_short:
            down_s = q.down_s[contact, at] if at < q.down_s.shape[1] else np.inf
        is_short = is_short or down_s == np.inf
        earliest_s = min(earliest_s, down_s)
    return earliest_s


@inner
def _take(
    q: Queues,
    k: int,
    layer: int,
    kept: int,
    earned: Ints,
    idle: Ints,
    reached: Ints,
    tables: _Tables,
) -> None:
    """Extend all paths by a task, of those that do not leave out the task that they must take."""
    network, energy, data = q.network, q.energy, q.data
    own, low, high = tables.own, tables.low, tables.high
    table, base = own[k % len(own)], energy.lowest[k]
    top, is_end = _top_of(q, layer), q.number[k] >= 0
    least = max(0, energy.floor[k] - base)
    most = min(energy.cap[k] - energy.cost[k] - base + 1, energy.width)
    if most <= least:
        return
    first = network.straight_first[k]
    for at in range(first - 1, network.straight_first[k + 1]):
        i = network.straight_rows[at] if at >= first else -1
        if 0 <= i < kept:
            continue
        before_low, before_high = reached[0], reached[1]
        up = -energy.cost[k]
        if i >= 0:
            before_low, before_high = low[i], high[i]
            up += energy.lowest[i] + energy.give[at] - base
        for listed in range(before_low, before_high + 1):
            before = own[i % len(own), listed] if i >= 0 else idle[listed]
            y, promised = _level_of(q, top, listed)
            to = _level_after(data, k, y)
            if y > data.before[k] or to > data.after[k] or to >= data.num_levels or before[0] < 0:
                continue
            if is_end:
                _raise(tables, k, to + promised * data.num_levels, before, least, most, up)
                continue
            last = q.num_classes if promised == 0 and to >= top else max(promised, 1)
            for other in range(max(promised, 1), last + 1):
                target = _listed(q, top, to, other)
                if earned[target] >= 0:
                    _raise(tables, k, target, before, least, most, up)
    for y in range(low[k], high[k] + 1):
        table[y, :least] = table[y, least]
        for x in range(most):
            table[y, x] += 0 if is_end else earned[y]
        table[y, most:] = UNREACHED_UNITS


@inner
def _raise(tables: _Tables, k: int, to: int, before: Ints, least: int, most: int, up: int) -> None:
    """Extend paths at one level by a task, to another level."""
    table, low, high = tables.own[k % len(tables.own)], tables.low, tables.high
    if high[k] < 0:
        low[k], high[k] = to, to
        table[to] = UNREACHED_UNITS
    while high[k] < to:
        high[k] += 1
        table[high[k]] = UNREACHED_UNITS
    while low[k] > to:
        low[k] -= 1
        table[low[k]] = UNREACHED_UNITS
    raise_to(table[to, least:most], before, up - least)


@inlined
def _level_after(data: DataLevels, k: int, level: int) -> int:
    return int(max(data.floor[k], level + data.gain[k], 0))


@inner
def _path_to(q: Queues, tables: _Tables, units: int, last: int, level: int) -> Ints:
    """Return the rows of a path in the last layer, worked out backward.

    The tables of a stretch between two contacts are filled again, from each contact that it may
    begin with, until the path is among them.
    """
    rows = np.empty(len(q.number), dtype=np.int32)
    length, layer, num_listed = 0, len(q.contact), tables.own.shape[1]
    at = np.array([last, level, q.energy.lowest[last] if last >= 0 else 0, units])
    while at[0] >= 0:
        source = layer - 1
        while source >= q.first[layer] and not (source < 0 and q.first[layer] >= 0):
            begin, end = _stretch(q, layer, source)
            if (end - begin) * num_listed * q.energy.width > MAX_QUEUE_ENTRIES:
                return rows[:0].copy()
            stretch = _Tables(
                np.empty((end - begin, num_listed, q.energy.width), dtype=np.int32),
                tables.low,
                tables.high,
                tables.at_contact.copy(),
            )
            _fill(q, layer, source, stretch)
            if _value_at(q, stretch, at[0], at[1], at[2]) == at[3]:
                length = _trace(q, layer, source, stretch, at, rows, length)
                break
            source -= 1
        if at[0] >= 0:
            if source < 0 or at[0] != q.contact[source]:
                return rows[:0].copy()
            _look_back(q, tables, layer, source, at)
        layer = source
    return rows[:length][::-1].copy()


@inner
def _look_back(q: Queues, tables: _Tables, layer: int, source: int, at: Ints) -> None:
    """Say where a contact that a layer began with is listed in its own."""
    level, _ = _level_of(q, _top_of(q, layer), at[1])
    x = max(0, at[2] - q.energy.lowest[at[0]])
    is_free = tables.at_contact[source, 0, level, x] == at[3]
    at[1] = level + (0 if is_free else min(layer - source, q.num_classes)) * q.data.num_levels


@inlined
def _value_at(q: Queues, tables: _Tables, k: int, listed: int, energy: int) -> int:
    """Return the most units of a path that ends with a task and leaves that and so much energy."""
    x = max(0, energy - q.energy.lowest[k])
    if listed < tables.low[k] or listed > tables.high[k] or x >= q.energy.width:
        return UNREACHED_UNITS
    return int(tables.own[k % len(tables.own), listed, x])


@inner
def _trace(
    q: Queues, layer: int, source: int, tables: _Tables, at: Ints, rows: Ints, length: int
) -> int:
    """Go back to the contact that a stretch begins with, or to the start; return how many rows.

    Parameters
    ----------
    at
        Task, where its level is listed, energy and units of the path so far, changed in place.
    rows, length
        Where to write the rows, the last first, and how many there are.
    """
    begin, top = q.contact[source] if source >= 0 else 0, _top_of(q, layer)
    earned = np.zeros(_num_listed(q, layer), dtype=np.int32)
    while at[0] >= 0 and not (source >= 0 and at[0] == begin):
        k, listed = at[0], at[1]
        rows[length] = k
        length += 1
        if q.number[k] >= 0:
            level, promised, units = (
                listed % q.data.num_levels,
                listed // q.data.num_levels,
                at[3],
            )
        else:
            _earn(q, k, layer, earned)
            level, promised = _level_of(q, top, listed)
            units = at[3] - earned[listed]
        energy = max(at[2], q.energy.floor[k]) + q.energy.cost[k]
        at[0] = -1
        for i in range(k - 1, begin - 1, -1):
            give = given_between(q.network, q.energy, i, k)
            if give >= 0 and at[0] < 0:
                for other in range(tables.low[i], tables.high[i] + 1):
                    y, before = _level_of(q, top, other)
                    is_next = y <= q.data.before[k] and _level_after(q.data, k, y) == level
                    is_next = is_next and before in (promised, 0)
                    if is_next and _value_at(q, tables, i, other, energy - give) == units:
                        at[0], at[1], at[2], at[3] = i, other, energy - give, units
                        break
            if q.network.is_kept[i] or at[0] >= 0:
                break
    return length
