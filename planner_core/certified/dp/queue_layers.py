"""The layers of the programme over contacts and queues, filled task by task.

In a row of energies only the entries that ``Tables.span`` tells apart are processed. Paths that no
completion lets gain enough are dropped as soon as a task has all its paths.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.completions import fill_backward
from planner_core.certified.dp.queue_tables import (
    Idle,
    Queues,
    Tables,
    index_of,
    level_after,
    level_of,
    num_listed_of,
    stretch_of,
    top_of,
)
from planner_core.certified.dp.queue_worth import know
from planner_core.certified.signs import AT_START, PLENTY_UNITS, UNKNOWN_UNITS, UNREACHED_UNITS
from planner_core.jit import borrowing_inner, inner
from planner_core.problem import Floats, Ints, Longs


@inner
def fill(q: Queues, layer: int, source: int, tables: Tables) -> tuple[int, int, int]:
    """Fill the tables of a layer with paths from one contact, from the start, or from any of them.

    Return the most units that a path in it gains, its last task and its level of data.
    """
    network, energy = q.network, q.energy
    own, low, high = tables.own, tables.low, tables.high
    top, num_listed = top_of(q, layer), num_listed_of(q, layer)
    low[:], high[:] = num_listed, -1
    begin, end = stretch_of(q, layer, source)
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
        earned[:] = UNKNOWN_UNITS
        if number >= 0 and number != layer:
            if source < AT_START or source == number:
                _begin_with(q, tables, k, number, layer)
                _spread(q, tables, k, top)
                for at in range(low[k], high[k] + 1):
                    know(q, k, layer, at, earned, needed)
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
def _at_start(q: Queues, layer: int, source: int, begin: int, end: int) -> Idle:
    """Return the idle paths before the first task of a stretch."""
    energy, top, num_listed = q.energy, top_of(q, layer), num_listed_of(q, layer)
    base = energy.lowest[end - 1] if end > begin else 0
    width = energy.width + (energy.lowest[begin] - base if end > begin else 0)
    idle = Idle(
        np.empty((num_listed, width), dtype=np.int32),
        np.zeros((num_listed, 2), dtype=np.int64),
        np.array([num_listed, -1]),
        base,
    )
    if begin == 0 and source < 0 and q.first[layer] < 0 and energy.start >= base:
        x = min(energy.start - base, width - 1)
        for promised in range(1, 1 + (q.num_classes if q.data.start >= top else 1)):
            at = index_of(q, top, q.data.start, promised)
            idle.units[at, x] = 0
            idle.span[at, 0], idle.span[at, 1] = x, x + 1
            idle.reached[0] = min(idle.reached[0], at)
            idle.reached[1] = max(idle.reached[1], at)
    return idle


@inner
def _rest(q: Queues, tables: Tables, i: int, idle: Idle) -> None:
    """Add the paths that end with a task to those that idle."""
    slot, up = i % len(tables.own), q.energy.lowest[i] - idle.base
    own, span = tables.own[slot], tables.span[slot]
    for y in range(tables.low[i], tables.high[i] + 1):
        if span[y, 1] > span[y, 0]:
            _raise_idle(idle.units, idle.span, own, span, y, up)
            idle.reached[0], idle.reached[1] = min(idle.reached[0], y), max(idle.reached[1], y)


@borrowing_inner
def _raise_idle(units: Ints, span: Longs, own: Ints, own_span: Longs, y: int, up: int) -> None:
    """Raise idle entries at a listed level to a task's, whose energy is counted from ``up``."""
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
    # An entry for more energy holds for less as well.
    for x in range(min(begin, last) - 1, first - 1, -1):
        if units[y, x] >= least:
            break
        units[y, x] = least


@inner
def _take(
    q: Queues,
    k: int,
    layer: int,
    kept: int,
    earned: Ints,
    needed: Floats,
    idle: Idle,
    tables: Tables,
) -> None:
    """Extend all paths by a task, except those that leave out ``kept``, which they must take."""
    network, energy, data = q.network, q.energy, q.data
    top, is_end, is_fixing = top_of(q, layer), q.number[k] >= 0, len(q.fixing.weight) > 0
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
            y, promised = level_of(q, top, listed)
            to, end = level_after(data, k, y), span[listed, 1]
            if y > data.before[k] or to > data.after[k] or to >= data.num_levels:
                continue
            if end <= span[listed, 0] or end + up <= least:
                continue
            units, further = before[listed, span[listed, 0]], 0.0
            if is_fixing:
                further = after[min(end + up, most) - 1]
            last = q.num_classes if promised == 0 and to >= top else max(promised, 1)
            for other in range(max(promised, 1), last + 1):
                target = index_of(q, top, to, other)
                if is_end:
                    target = to + promised * data.num_levels
                if earned[target] == UNKNOWN_UNITS:
                    know(q, k, layer, target, earned, needed)
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
    """Extend the paths at one listed level by a task, to another listed level."""
    if own_span[to, 1] == 0:
        for x in range(own.shape[1]):
            own[to, x] = UNREACHED_UNITS
        own_span[to, 0] = most
    begin, last = max(span[listed, 0], 0), min(span[listed, 1] + up, most)
    # Energy above the most that the table has room for counts as that.
    first = max(min(max(begin + up, least), most - 1), 0)
    skipped = max(first - up, begin)
    own[to, first] = max(own[to, first], before[listed, skipped])
    for x in range(1, last - first):
        own[to, first + x] = max(own[to, first + x], before[listed, skipped + x])
    own_span[to, 0] = min(own_span[to, 0], first)
    own_span[to, 1] = max(own_span[to, 1], first + 1, last)


@inner
def _settle(q: Queues, k: int, earned: Ints, needed: Floats, tables: Tables) -> None:
    """Add what a task earns; drop paths that no completion lets gain enough."""
    slot, is_fixing = k % len(tables.own), len(q.fixing.weight) > 0
    own, span, further = tables.own[slot], tables.span[slot], tables.further
    first, last = tables.high[k] + 1, -1
    if is_fixing and tables.low[k] < first:
        for x in range(len(further)):
            units = np.ceil(tables.completions.after[k, x] / q.unit)
            further[x] = int(min(max(units, UNREACHED_UNITS), PLENTY_UNITS))
    for at in range(tables.low[k], tables.high[k] + 1):
        least = -1
        if is_fixing:
            least = int(min(max(np.floor(needed[at] / q.unit), -1.0), PLENTY_UNITS - 1))
        if _close(own, span, at, earned[at], further, least):
            first, last = min(first, at), at
    tables.low[k], tables.high[k] = first, last


@borrowing_inner
def _close(own: Ints, span: Longs, at: int, earned: int, further: Ints, least: int) -> bool:
    """Do so at one listed level; return whether any path is left.

    Entries for more energy come to hold for less as well.

    Parameters
    ----------
    further, least
        Units of completions, and the units that a path must exceed.
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
def _begin_with(q: Queues, tables: Tables, k: int, number: int, layer: int) -> None:
    """Continue in a layer from the contact that ended an earlier one."""
    slot, states = k % len(tables.own), tables.at_contact[number]
    table, width = tables.own[slot], q.energy.width
    tables.low[k], tables.high[k] = 0, q.data.num_levels - 1
    promised = min(layer - number, q.num_classes)
    for y in range(q.data.num_levels):
        tables.span[slot, y, 0], tables.span[slot, y, 1] = 0, width
        for x in range(width):
            table[y, x] = max(states[0, y, x], states[promised, y, x])


@inner
def _spread(q: Queues, tables: Tables, k: int, top: int) -> None:
    """List the higher levels of a table once for each promise."""
    slot, beyond = k % len(tables.own), q.data.num_levels - top
    for promised in range(2, q.num_classes + 1):
        first = index_of(q, top, top, promised)
        for y in range(beyond):
            tables.own[slot, first + y] = tables.own[slot, top + y]
            tables.span[slot, first + y] = tables.span[slot, top + y]
        tables.high[k] = first + beyond - 1
