"""The most that one satellite can gain under its battery if images wait for contacts.

An image's worth depends on the contact that takes it down, one of those taken after it. So there
is a layer for each contact, in which that contact is the next to be taken, and a last layer in
which no contact follows: a path stays in a layer until its contact, and continues from there in any
later one. If there are too many contacts for a layer each, consecutive contacts share one as a
group: a path may then take any contacts of the group.

As in ``energy_labels`` worth is exact, energy is in levels, rounded in favour of the satellite, and
the recorder is left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.bundles import bundle
from planner_core.certified.dp.energy_labels import (
    EnergyLevels,
    extended,
    given_between,
    merge_ended,
    sink,
)
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import NEVER
from planner_core.certified.sizes import MAX_LAYERS
from planner_core.jit import inner, kernel
from planner_core.problem import Floats, Ints, Longs


@bundle
class Layers(NamedTuple):
    """Contacts of one satellite in groups, one for each layer but the last.

    Attributes
    ----------
    contact
        The tasks that are contacts, ascending. Shape ``(num_contacts,)``.
    first
        Group ``g`` has the contacts from ``first[g]`` up to ``first[g + 1]``. Shape
        ``(num_layers,)``.
    group
        Of each task that is a contact; -1 for others. Shape ``(m,)``.
    number
        Index of each task in ``contact``; -1 for others. Shape ``(m,)``.
    """

    contact: Ints
    first: Longs
    group: Ints
    number: Ints


def layers_of(network: Network) -> Layers:
    """Return as many layers as there are contacts, up to a limit, and one more."""
    contact = np.flatnonzero(network.is_contact).astype(np.int32)
    num_groups = min(len(contact), MAX_LAYERS)
    first = (np.arange(num_groups + 1) * len(contact)) // max(1, num_groups)
    group = np.full(len(network.site), -1, dtype=np.int32)
    number = group.copy()
    group[contact] = np.repeat(np.arange(num_groups), np.diff(first))
    number[contact] = np.arange(len(contact))
    return Layers(contact=contact, first=first.astype(np.int64), group=group, number=number)


class Tables(NamedTuple):
    """The most gained by a path that ends with a task, by energy as in ``most_by_energy``.

    Attributes
    ----------
    own, num_own
        Of one layer at a time. Shapes ``(m, width)`` and ``(m,)``.
    at_contact, num_at_contact
        Of contacts, each in its own layer. Shapes ``(num_contacts, width)`` and
        ``(num_contacts,)``.
    """

    own: Floats
    num_own: Longs
    at_contact: Floats
    num_at_contact: Longs


@kernel
def most_by_contacts(
    network: Network,
    levels: EnergyLevels,
    layers: Layers,
    weight: Floats,
    own: Floats,
    num_own: Longs,
) -> tuple[float, Ints, Ints]:
    """Return the most that a path gains, the rows of such a path, and the layer of each row.

    Parameters
    ----------
    weight
        Worth of each task in each layer, of contacts in their own layer; ``NEVER`` for tasks
        that no path needs to take. Shape ``(num_layers, m)``.
    own, num_own
        Workspace, of shapes ``(m, width)`` and ``(m,)`` at least.
    """
    num_contacts = len(layers.contact)
    tables = Tables(
        own,
        num_own,
        np.empty((num_contacts, levels.width)),
        np.zeros(num_contacts, dtype=np.int64),
    )
    num_layers = len(layers.first)
    best, last = 0.0, -1
    for layer in range(num_layers):
        best, last = fill_layer(network, levels, layers, weight, layer, tables)
    return best, *_path_to(network, levels, layers, weight, tables, last)


@inner
def fill_layer(
    network: Network,
    levels: EnergyLevels,
    layers: Layers,
    weight: Floats,
    layer: int,
    tables: Tables,
) -> tuple[float, int]:
    """Fill the tables of a layer; return the most that any path in it gains, and its last task."""
    own, num_own = tables.own, tables.num_own
    m = weight.shape[1]
    if layer < len(layers.first) - 1:
        m = layers.contact[layers.first[layer + 1] - 1] + 1
    idle = np.full(levels.width, -np.inf)
    base = levels.lowest[0] if m else 0
    idle[: max(0, levels.start - base + 1)] = 0.0
    merged, best, last = 0, 0.0, -1
    for k in range(m):
        sink(idle, base - levels.lowest[k])
        base = levels.lowest[k]
        merged = merge_ended(network, levels, k, merged, idle, own, num_own)
        number = layers.number[k]
        if number >= 0 and layers.group[k] != layer:
            # The contact has ended an earlier layer, and begins this one.
            num_own[k] = tables.num_at_contact[number]
            for x in range(num_own[k]):
                own[k, x] = tables.at_contact[number, x]
        else:
            num_own[k] = 0
            if weight[layer, k] != NEVER:
                num_own[k] = extended(network, levels, k, weight[layer, k], idle, own, num_own)
        if number >= 0 and layers.group[k] == layer:
            tables.num_at_contact[number] = num_own[k]
            for x in range(num_own[k]):
                tables.at_contact[number, x] = own[k, x]
        if num_own[k] > 0 and own[k, 0] > best:
            best, last = own[k, 0], k
    return best, last


@inner
def _path_to(
    network: Network,
    levels: EnergyLevels,
    layers: Layers,
    weight: Floats,
    tables: Tables,
    last: int,
) -> tuple[Ints, Ints]:
    """Return the rows of a best path, which ends in the last layer, and the layer of each row.

    The tables of earlier layers are filled again: keeping all of them would take too much memory.
    """
    own, num_own = tables.own, tables.num_own
    rows = np.empty(weight.shape[1], dtype=np.int32)
    passed = np.empty(weight.shape[1], dtype=np.int32)
    length, layer = 0, len(layers.first) - 1
    k, energy = last, levels.lowest[last] if last >= 0 else 0
    while k >= 0:
        if layers.number[k] >= 0 and layers.group[k] != layer:
            layer = layers.group[k]
            fill_layer(network, levels, layers, weight, layer, tables)
        rows[length], passed[length] = k, layer
        length += 1
        energy = max(energy, levels.floor[k])
        gained = own[k, energy - levels.lowest[k]]
        energy += levels.cost[k]
        before = k - 1
        while before >= 0:
            give = given_between(network, levels, before, k)
            x = max(0, energy - max(give, 0) - levels.lowest[before])
            is_reached = give >= 0 and x < num_own[before]
            if is_reached and own[before, x] + weight[layer, k] == gained:
                energy -= give
                break
            before -= 1
        k = before
    return rows[:length][::-1].copy(), passed[:length][::-1].copy()
