"""Paths of the programme over contacts and queues, reconstructed from what they gain."""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.energy_labels import given_between
from planner_core.certified.dp.queue_layers import fill
from planner_core.certified.dp.queue_tables import (
    Queues,
    Tables,
    level_after,
    level_of,
    num_listed_of,
    stretch_of,
    top_of,
)
from planner_core.certified.dp.queue_worth import know
from planner_core.certified.signs import UNREACHED_UNITS
from planner_core.certified.sizes import MAX_QUEUE_ENTRIES
from planner_core.jit import inlined, inner
from planner_core.problem import Ints


@inner
def path_to(q: Queues, tables: Tables, units: int, last: int, level: int) -> Ints:
    """Return the rows of a path that ends in the last layer, worked out backward.

    The tables of a stretch between two contacts are filled again, from each contact that it may
    begin with, until they hold the path.
    """
    rows = np.empty(len(q.number), dtype=np.int32)
    length, layer = 0, len(q.contact)
    at = np.array([last, level, q.energy.lowest[last] if last >= 0 else 0, units])
    while at[0] >= 0:
        source = layer - 1
        while source >= q.first[layer] and not (source < 0 and q.first[layer] >= 0):
            most, last, level = fill(q, layer, source, tables)
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
def _kept_of(q: Queues, layer: int, source: int, tables: Tables) -> Tables:
    """Fill the tables of a stretch again and keep them; leave them unfilled if too large."""
    begin, end = stretch_of(q, layer, source)
    num_kept = 0
    for k in range(begin, end):
        tables.kept_at[k] = num_kept
        num_kept += max(0, tables.high[k] - tables.low[k] + 1)
    stretch = Tables(
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
        fill(q, layer, source, stretch)
    return stretch


@inner
def _look_back(q: Queues, tables: Tables, layer: int, source: int, at: Ints) -> None:
    """Set ``at`` to where the contact that began a layer is listed in its own layer."""
    level, _ = level_of(q, top_of(q, layer), at[1])
    x = max(0, at[2] - q.energy.lowest[at[0]])
    is_free = tables.at_contact[source, 0, level, x] == at[3]
    at[1] = level + (0 if is_free else min(layer - source, q.num_classes)) * q.data.num_levels


@inlined
def _value_at(q: Queues, tables: Tables, k: int, listed: int, energy: int) -> int:
    """Return the most units of a path that ends with task ``k`` at a listed level and an energy."""
    x = max(0, energy - q.energy.lowest[k])
    if listed < tables.low[k] or listed > tables.high[k] or x >= q.energy.width:
        return UNREACHED_UNITS
    return int(tables.kept[tables.kept_at[k] + listed - tables.low[k], x])


@inner
def _trace(
    q: Queues, layer: int, source: int, tables: Tables, at: Ints, rows: Ints, length: int
) -> int:
    """Go back to the contact that a stretch begins with, or to the start; return the new length.

    Parameters
    ----------
    at
        Task, listed level, energy and units of the path up to here, changed in place.
    rows, length
        Where to write the rows, the last first, and how many there are.
    """
    begin, top = q.contact[source] if source >= 0 else 0, top_of(q, layer)
    num_listed = max(num_listed_of(q, layer), (q.num_classes + 1) * q.data.num_levels)
    earned, needed = np.empty(num_listed, dtype=np.int32), np.empty(num_listed)
    while at[0] >= 0:
        k, listed = at[0], at[1]
        # Entries repeat the units of paths with more energy: go to the highest with these units.
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
            know(q, k, layer, listed, earned, needed)
            level, promised = level_of(q, top, listed)
            units = at[3] - earned[listed]
        energy = max(at[2], q.energy.floor[k]) + q.energy.cost[k]
        at[0] = -1
        for i in range(k - 1, begin - 1, -1):
            give = given_between(q.network, q.energy, i, k)
            if give >= 0 and at[0] < 0:
                for other in range(tables.low[i], tables.high[i] + 1):
                    y, before = level_of(q, top, other)
                    is_next = y <= q.data.before[k] and level_after(q.data, k, y) == level
                    is_next = is_next and before in (promised, 0)
                    if is_next and _value_at(q, tables, i, other, energy - give) == units:
                        at[0], at[1], at[2], at[3] = i, other, energy - give, units
                        break
            if q.network.is_kept[i] or at[0] >= 0:
                break
    return length
