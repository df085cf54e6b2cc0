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

from typing import Final, NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.completions import Completions, completions_of, fill_backward
from planner_core.certified.dp.contact_layers import Layers
from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.energy_labels import EnergyLevels, given_between
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import ANYWHERE, AT_START, UNREACHED_UNITS
from planner_core.certified.sizes import MAX_QUEUE_ENTRIES
from planner_core.certified.tolerances import DOWN, LEVEL
from planner_core.jit import borrowing_inner, inlined, inner, kernel
from planner_core.problem import Bytes, Floats, Ints, Longs


_UNKNOWN: Final = -2  # units that were not worked out
_PLENTY: Final = 2**30  # units that suffice for anything: no path gains so many


@bundle
class Fixing(NamedTuple):
    """What paths that earn too little are told by: a relaxation in which tables are small.

    Attributes
    ----------
    layers, weight
        Those of ``contact_layers``, each contact with a layer of its own, and what tasks are worth
        in them. The latter of shape ``(num_contacts + 1, m)``, ``(0, 0)`` where nothing is fixed.
    toll
        The price of each contact, by volume. Shape ``(num_contacts,)``.
    after_contact
        The most that may follow each contact, by energy. Shape ``(num_contacts, width)``.
    least
        What a path must gain more than.
    """

    layers: Layers
    weight: Floats
    toll: Floats
    after_contact: Floats
    least: float


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
    fixing: Fixing
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
        Of tasks, each until all may follow it for nothing. Shape
        ``(num_tables, most_listed, width)``.
    span
        Which entries of a row are told apart, from the first up to the second: all before have the
        units of the first of them, all from the second on are not reached; 0 in a row without any.
        Shape ``(num_tables, most_listed, 2)``.
    low, high
        The listed levels reached, by task. Shape ``(m,)``.
    at_contact
        Of contacts, when they end their layers, by what was promised, 0 for nothing. Shape
        ``(num_contacts, num_classes + 1, num_levels, width)``.
    completions
        Of the layer at hand, by the relaxation.
    further
        Units of the completions of a task, rounded up; 0 where paths are not left out. Shape
        ``(width,)``.
    kept, kept_at
        What is kept of a stretch to go back in it: listed levels from ``low`` up to ``high``, and
        where those of each task begin. Shapes ``(num_kept, width)`` and ``(m,)``.
    """

    own: Ints
    span: Longs
    low: Ints
    high: Ints
    at_contact: Ints
    completions: Completions
    further: Ints
    kept: Ints
    kept_at: Longs


class _Idle(NamedTuple):
    """The most units of a path whose last task has ended, as ``_Tables`` have those of a task.

    Attributes
    ----------
    units
        By energy counted from ``base``. Shape ``(num_listed, width)``.
    span
        Shape ``(num_listed, 2)``.
    reached
        The first and the last row with a path.
    """

    units: Ints
    span: Longs
    reached: Longs
    base: int


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
        np.zeros((q.num_tables, num_listed, 2), dtype=np.int64),
        np.empty(m, dtype=np.int32),
        np.empty(m, dtype=np.int32),
        np.full(states, UNREACHED_UNITS, dtype=np.int32),
        completions_of(num_contacts, m if len(q.fixing.weight) > 0 else 1, width),
        np.zeros(width, dtype=np.int32),
        np.empty((0, width), dtype=np.int32),
        np.empty(m, dtype=np.int64),
    )
    if len(q.fixing.weight) > 0:
        tables.completions.best[:] = q.fixing.after_contact
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
    promised = 1
    while listed >= q.data.num_levels:
        listed, promised = listed - (q.data.num_levels - top), promised + 1
    return listed, promised


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
    network, energy = q.network, q.energy
    own, low, high = tables.own, tables.low, tables.high
    top, num_listed = _top_of(q, layer), _num_listed(q, layer)
    low[:], high[:] = num_listed, -1
    begin, end = _stretch(q, layer, source)
    if len(q.fixing.weight) > 0:
        fixing = q.fixing
        completions = tables.completions
        fill_backward(network, energy, fixing.layers, fixing.weight, layer, begin, completions)
    idle = _at_start(q, layer, source, begin, end)
    earned, needed = np.zeros(own.shape[1], dtype=np.int32), np.zeros(own.shape[1])
    best, last, level, merged, kept = 0, -1, q.data.start, 0, 0
    for k in range(begin, end):
        while merged < len(q.number) and network.idle_from[network.by_idle[merged]] <= k:
            i = network.by_idle[merged]
            merged += 1
            if i >= kept:
                _rest(q, tables, i, idle)
        number, table = q.number[k], own[k % len(own)]
        tables.span[k % len(own), :, 1] = 0
        earned[:] = _UNKNOWN
        if number >= 0 and number != layer:
            if source < AT_START or source == number:
                _begin_with(q, tables, k, number, layer)
                _spread(q, tables, k, top)
                for at in range(low[k], high[k] + 1):
                    _know(q, k, layer, at, earned, needed)
        else:
            _take(q, k, layer, kept, earned, needed, idle, tables)
        _settle(q, k, earned, needed, tables)
        if number == layer:
            for at in range(low[k], high[k] + 1):
                y, promised = at % q.data.num_levels, at // q.data.num_levels
                tables.at_contact[number, promised, y] = table[at]
        if network.is_kept[k]:
            idle.span[:, 1] = 0
            idle.reached[0], idle.reached[1] = num_listed, -1
            best, last, kept = -1, -1, k
        for y in range(low[k], high[k] + 1):
            if layer == len(q.contact) and table[y, 0] > best:
                best, last, level = table[y, 0], k, y
            if len(tables.kept) > 0:
                tables.kept[tables.kept_at[k] + y - low[k]] = table[y]
    return best, last, level


@inner
def _at_start(q: Queues, layer: int, source: int, begin: int, end: int) -> _Idle:
    """Return what is reached before the first task of a stretch."""
    energy, top, num_listed = q.energy, _top_of(q, layer), _num_listed(q, layer)
    base = energy.lowest[end - 1] if end > begin else 0
    width = energy.width + (energy.lowest[begin] - base if end > begin else 0)
    idle = _Idle(
        np.empty((num_listed, width), dtype=np.int32),
        np.zeros((num_listed, 2), dtype=np.int64),
        np.array([num_listed, -1]),
        base,
    )
    if begin == 0 and source < 0 and q.first[layer] < 0 and energy.start >= base:
        x = min(energy.start - base, width - 1)
        for promised in range(1, 1 + (q.num_classes if q.data.start >= top else 1)):
            at = _listed(q, top, q.data.start, promised)
            idle.units[at, x] = 0
            idle.span[at, 0], idle.span[at, 1] = x, x + 1
            idle.reached[0] = min(idle.reached[0], at)
            idle.reached[1] = max(idle.reached[1], at)
    return idle


@inner
def _rest(q: Queues, tables: _Tables, i: int, idle: _Idle) -> None:
    """Let paths idle whose last task has ended."""
    slot, up = i % len(tables.own), q.energy.lowest[i] - idle.base
    own, span = tables.own[slot], tables.span[slot]
    for y in range(tables.low[i], tables.high[i] + 1):
        if span[y, 1] > span[y, 0]:
            _raise_idle(idle.units, idle.span, own, span, y, up)
            idle.reached[0], idle.reached[1] = min(idle.reached[0], y), max(idle.reached[1], y)


@borrowing_inner
def _raise_idle(units: Ints, span: Longs, own: Ints, own_span: Longs, y: int, up: int) -> None:
    """Raise what is idle at a level to what a task has, which is counted from ``up`` higher."""
    skipped, end = max(own_span[y, 0], 0), own_span[y, 1] + up
    begin, least = max(skipped + up, 0), own[y, skipped]
    if span[y, 1] <= span[y, 0]:
        span[y, 0], span[y, 1] = begin, begin
    first, last = span[y, 0], max(span[y, 1], 0)
    for x in range(last, end):
        units[y, x] = own[y, max(x - up, skipped)]
    for x in range(begin, first):
        units[y, x] = units[y, first]
    for x in range(min(end, last) - begin):
        units[y, begin + x] = max(units[y, begin + x], own[y, skipped + x])
    span[y, 0], span[y, 1] = min(first, begin), max(last, end)
    # Who has more energy has less as well.
    for x in range(min(begin, last) - 1, first - 1, -1):
        if units[y, x] >= least:
            break
        units[y, x] = least


@inner
def _know(q: Queues, k: int, layer: int, at: int, earned: Ints, needed: Floats) -> None:
    """Fill in what a task adds at a level after it, and what a whole path must gain more than.

    -1 units where no path needs to take it. What is on board takes a part of contacts, which
    completions count as a whole.
    """
    is_end, num_levels = q.number[k] == layer, q.data.num_levels
    level, promised = _level_of(q, _top_of(q, layer), at)
    if is_end:
        level, promised = at % num_levels, at // num_levels
    earned[at] = 0
    if q.number[k] < 0:
        down_s = _down_s(q, layer, promised, max(0.0, q.data.least[level] + q.queued[k]))
        worth = q.decaying[k] * 2.0 ** (-max(down_s - q.end_s[k], 0.0) / q.half_life_s)
        worth = min(q.on_board[k] + worth, q.most[k]) - q.price[k]
        if worth > 0.0:
            earned[at] = int(np.ceil(worth / q.unit - LEVEL))
        elif not (q.takes_worthless or q.network.is_kept[k]):
            earned[at] = -1
    if len(q.fixing.weight) > 0:
        amount = max(0.0, q.data.least[level] + q.queued[k] - 2.0 * DOWN)
        needed[at] = q.fixing.least + _taken_up(q, layer, is_end, promised, amount)


@inlined
def _taken_up(q: Queues, layer: int, is_end: bool, promised: int, amount: float) -> float:
    """Return the prices of contacts for what is on board and has to come down in them."""
    paid = 0.0
    if not is_end and layer < len(q.contact):
        first = min(amount, q.volume[layer] - DOWN)
        paid, amount = q.fixing.toll[layer] * first, amount - first
    after = layer + promised
    if 0 < promised < q.num_classes and after < len(q.contact):
        paid += q.fixing.toll[after] * min(amount, q.volume[after] - DOWN)
    return paid


@inner
def _settle(q: Queues, k: int, earned: Ints, needed: Floats, tables: _Tables) -> None:
    """Add what a task earns; leave out paths that no completion lets gain enough."""
    slot, is_fixing = k % len(tables.own), len(q.fixing.weight) > 0
    own, span, further = tables.own[slot], tables.span[slot], tables.further
    first, last = tables.high[k] + 1, -1
    if is_fixing and tables.low[k] < first:
        for x in range(len(further)):
            units = np.ceil(tables.completions.after[k, x] / q.unit)
            further[x] = int(min(max(units, UNREACHED_UNITS), _PLENTY))
    for at in range(tables.low[k], tables.high[k] + 1):
        least = -1
        if is_fixing:
            least = int(min(max(np.floor(needed[at] / q.unit), -1.0), _PLENTY - 1))
        if _close(own, span, at, earned[at], further, least):
            first, last = min(first, at), at
    tables.low[k], tables.high[k] = first, last


@borrowing_inner
def _close(own: Ints, span: Longs, at: int, earned: int, further: Ints, least: int) -> bool:
    """Do so at one level, and say whether any path is left: who has more energy has less as well.

    Parameters
    ----------
    further, least
        Units of completions, and what a path must gain more than.
    """
    begin, end = max(span[at, 0], 0), span[at, 1]
    for j in range(end - begin):
        units = own[at, begin + j] + earned
        is_left = own[at, begin + j] >= 0 and units + further[begin + j] > least
        own[at, begin + j] = units if is_left else UNREACHED_UNITS
    most, reached, told_apart = UNREACHED_UNITS, 0, 0
    for j in range(end - begin):
        x = end - 1 - j
        if own[at, x] > most:
            most, told_apart = own[at, x], x
            reached = max(reached, x + 1)
        own[at, x] = most
    for x in range(begin if most >= 0 else own.shape[1]):
        own[at, x] = most
    span[at, 0], span[at, 1] = told_apart, reached
    return bool(most >= 0)


@inner
def _begin_with(q: Queues, tables: _Tables, k: int, number: int, layer: int) -> None:
    """Go on in a layer from the contact that ended an earlier one."""
    slot, states = k % len(tables.own), tables.at_contact[number]
    table, width = tables.own[slot], q.energy.width
    tables.low[k], tables.high[k] = 0, q.data.num_levels - 1
    promised = min(layer - number, q.num_classes)
    for y in range(q.data.num_levels):
        tables.span[slot, y, 0], tables.span[slot, y, 1] = 0, width
        for x in range(width):
            table[y, x] = max(states[0, y, x], states[promised, y, x])


@inner
def _spread(q: Queues, tables: _Tables, k: int, top: int) -> None:
    """List the higher levels of a table once for each promise."""
    slot, beyond = k % len(tables.own), q.data.num_levels - top
    for promised in range(2, q.num_classes + 1):
        first = _listed(q, top, top, promised)
        for y in range(beyond):
            tables.own[slot, first + y] = tables.own[slot, top + y]
            tables.span[slot, first + y] = tables.span[slot, top + y]
        tables.high[k] = first + beyond - 1


@inner
def _stretch(q: Queues, layer: int, source: int) -> tuple[int, int]:
    """Return the tasks of a layer that paths from a contact, or from any, may take."""
    end = q.contact[layer] + 1 if layer < len(q.contact) else len(q.number)
    begin = q.contact[q.first[layer]] if q.first[layer] >= 0 else 0
    return (q.contact[source] if source >= 0 else begin), end


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
    needed: Floats,
    idle: _Idle,
    tables: _Tables,
) -> None:
    """Extend all paths by a task, of those that do not leave out the task that they must take."""
    network, energy, data = q.network, q.energy, q.data
    top, is_end, is_fixing = _top_of(q, layer), q.number[k] >= 0, len(q.fixing.weight) > 0
    least = max(0, energy.floor[k] - energy.lowest[k])
    most = min(energy.cap[k] - energy.cost[k] - energy.lowest[k] + 1, energy.width)
    if most <= least:
        return
    after = tables.completions.after[k * is_fixing]
    own, own_span = tables.own[k % len(tables.own)], tables.span[k % len(tables.own)]
    reached_low, reached_high = len(earned), -1
    first = network.straight_first[k]
    for at in range(first - 1, network.straight_first[k + 1]):
        i = network.straight_rows[at] if at >= first else -1
        if 0 <= i < kept:
            continue
        before, span = idle.units, idle.span
        low, high, up = idle.reached[0], idle.reached[1], idle.base
        if i >= 0:
            before, span = tables.own[i % len(tables.own)], tables.span[i % len(tables.own)]
            low, high, up = tables.low[i], tables.high[i], energy.lowest[i] + energy.give[at]
        up -= energy.cost[k] + energy.lowest[k]
        for listed in range(low, high + 1):
            y, promised = _level_of(q, top, listed)
            to, end = _level_after(data, k, y), span[listed, 1]
            if y > data.before[k] or to > data.after[k] or to >= data.num_levels:
                continue
            if end <= span[listed, 0] or end + up <= least:
                continue
            units, further = before[listed, span[listed, 0]], 0.0
            if is_fixing:
                further = after[min(end + up, most) - 1]
            last = q.num_classes if promised == 0 and to >= top else max(promised, 1)
            for other in range(max(promised, 1), last + 1):
                target = _listed(q, top, to, other)
                if is_end:
                    target = to + promised * data.num_levels
                if earned[target] == _UNKNOWN:
                    _know(q, k, layer, target, earned, needed)
                gained = (units + earned[target]) * q.unit + further
                if earned[target] >= 0 and not (is_fixing and gained <= needed[target]):
                    _raise(own, own_span, target, before, span, listed, least, most, up)
                    reached_low, reached_high = min(reached_low, target), max(reached_high, target)
                if is_end:
                    break
    tables.low[k], tables.high[k] = reached_low, reached_high


@borrowing_inner
def _raise(
    own: Ints,
    own_span: Longs,
    to: int,
    before: Ints,
    span: Longs,
    listed: int,
    least: int,
    most: int,
    up: int,
) -> None:
    """Extend paths at one level by a task, to another level."""
    if own_span[to, 1] == 0:
        for x in range(own.shape[1]):
            own[to, x] = UNREACHED_UNITS
        own_span[to, 0] = most
    begin, last = max(span[listed, 0], 0), min(span[listed, 1] + up, most)
    # More energy than there is room for is as much as there is room for.
    first = max(min(max(begin + up, least), most - 1), 0)
    skipped = max(first - up, begin)
    own[to, first] = max(own[to, first], before[listed, skipped])
    for x in range(1, last - first):
        own[to, first + x] = max(own[to, first + x], before[listed, skipped + x])
    own_span[to, 0] = min(own_span[to, 0], first)
    own_span[to, 1] = max(own_span[to, 1], first + 1, last)


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
    length, layer = 0, len(q.contact)
    at = np.array([last, level, q.energy.lowest[last] if last >= 0 else 0, units])
    while at[0] >= 0:
        source = layer - 1
        while source >= q.first[layer] and not (source < 0 and q.first[layer] >= 0):
            most, last, level = _fill(q, layer, source, tables)
            is_found = most == at[3] and last == at[0] and level == at[1]
            if layer < len(q.contact):
                x = max(0, at[2] - q.energy.lowest[at[0]])
                is_listed = tables.low[at[0]] <= at[1] <= tables.high[at[0]]
                is_found = is_listed and tables.own[at[0] % len(tables.own), at[1], x] == at[3]
            if is_found:
                stretch = _kept_of(q, layer, source, tables)
                if len(stretch.kept) * q.energy.width > MAX_QUEUE_ENTRIES:
                    return rows[:0].copy()
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
def _kept_of(q: Queues, layer: int, source: int, tables: _Tables) -> _Tables:
    """Fill the tables of a stretch again and keep them; too many, and unfilled, are a refusal."""
    begin, end = _stretch(q, layer, source)
    num_kept = 0
    for k in range(begin, end):
        tables.kept_at[k] = num_kept
        num_kept += max(0, tables.high[k] - tables.low[k] + 1)
    stretch = _Tables(
        tables.own,
        tables.span,
        tables.low,
        tables.high,
        tables.at_contact,
        tables.completions,
        tables.further,
        np.empty((num_kept, q.energy.width), dtype=np.int32),
        tables.kept_at,
    )
    if num_kept * q.energy.width <= MAX_QUEUE_ENTRIES:
        _fill(q, layer, source, stretch)
    return stretch


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
    return int(tables.kept[tables.kept_at[k] + listed - tables.low[k], x])


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
    num_listed = max(_num_listed(q, layer), (q.num_classes + 1) * q.data.num_levels)
    earned, needed = np.empty(num_listed, dtype=np.int32), np.empty(num_listed)
    while at[0] >= 0:
        k, listed = at[0], at[1]
        # What was left out at this energy has the units of paths with more.
        while _value_at(q, tables, k, listed, at[2] + 1) == at[3]:
            at[2] += 1
        if source >= 0 and k == begin:
            break
        rows[length] = k
        length += 1
        if q.number[k] >= 0:
            level, promised, units = (
                listed % q.data.num_levels,
                listed // q.data.num_levels,
                at[3],
            )
        else:
            _know(q, k, layer, listed, earned, needed)
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
