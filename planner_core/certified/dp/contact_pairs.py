"""The most that a path may gain that takes one contact next after another, for each two of them.

``contact_layers`` knows the most of any path up to a task in a layer. Here the tables are filled
once more from the end: the most that may follow a task in a layer, by the energy it leaves. At the
contact that a path goes on from the two add up. What is below a plan that is known need not be
looked at where paths are told more exactly.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.contact_layers import Layers, Tables, fill_layer
from planner_core.certified.dp.energy_labels import EnergyLevels
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import NEVER
from planner_core.jit import inlined, kernel
from planner_core.problem import Floats


class _Rest(NamedTuple):
    """The most that a path gains after a task, in one layer at a time.

    Energy is counted from the task's ``lowest``.

    Attributes
    ----------
    after
        By the energy that is left after it. Shape ``(m, width)``.
    following
        If the next task is it or a later one that all may follow, by energy before. Shape
        ``(m + 1, width)``.
    in_layer
        Of contacts, if the next one is a layer's. Shape ``(num_contacts, num_layers, width)``.
    anyhow
        Of contacts, whatever follows. Shape ``(num_contacts, width)``.
    """

    after: Floats
    following: Floats
    in_layer: Floats
    anyhow: Floats


@kernel
def most_by_pairs(network: Network, levels: EnergyLevels, layers: Layers, weight: Floats) -> Floats:
    """Return the most that a path gains with a contact, or none, next after another or the start.

    Each contact must have a layer of its own.

    Parameters
    ----------
    weight
        As of ``most_by_contacts``. Shape ``(num_layers, m)``.

    Returns
    -------
    By the contact before, the start first, and the next one, none last; minus infinity where no
    path does. Shape ``(num_contacts + 1, num_layers)``.
    """
    (num_layers, m), width = weight.shape, levels.width
    num_contacts = len(layers.contact)
    tables = Tables(
        np.empty((m, width)),
        np.zeros(m, dtype=np.int64),
        np.empty((num_contacts, width)),
        np.zeros(num_contacts, dtype=np.int64),
    )
    for layer in range(num_layers):
        fill_layer(network, levels, layers, weight, layer, tables)
    rest = _Rest(
        np.empty((m, width)),
        np.empty((m + 1, width)),
        np.full((num_contacts, num_layers, width), -np.inf),
        np.full((num_contacts, width), -np.inf),
    )
    most = np.full((num_contacts + 1, num_layers), -np.inf)
    for layer in range(num_layers - 1, -1, -1):
        most[0, layer] = _complete(network, levels, layers, weight, layer, rest)
        for contact in range(num_contacts):
            for x in range(width):
                further = rest.in_layer[contact, layer, x]
                rest.anyhow[contact, x] = max(rest.anyhow[contact, x], further)
                if x < tables.num_at_contact[contact]:
                    gained = tables.at_contact[contact, x] + further
                    most[contact + 1, layer] = max(most[contact + 1, layer], gained)
    return most


@kernel
def _complete(
    network: Network,
    levels: EnergyLevels,
    layers: Layers,
    weight: Floats,
    layer: int,
    rest: _Rest,
) -> float:
    """Fill the tables of a layer from its end; return the most of a path that begins in it."""
    is_last, m, width = layer == len(layers.first) - 1, weight.shape[1], levels.width
    if not is_last:
        m = layers.contact[layer] + 1
    rest.after[:m] = 0.0 if is_last else -np.inf
    rest.following[m] = -np.inf
    for k in range(m - 1, -1, -1):
        number, after, following = layers.number[k], rest.after[k], rest.following[k]
        later = network.idle_from[k]
        if number == layer:
            after[:] = rest.anyhow[number]
        elif later < m:
            _raise_from(after, rest.following[later], levels.lowest[k] - levels.lowest[later])
        following[:] = -np.inf
        if k + 1 < m:
            _raise_from(following, rest.following[k + 1], levels.lowest[k] - levels.lowest[k + 1])
        if number >= 0 and number != layer:
            rest.in_layer[number, layer] = after
        elif weight[layer, k] != NEVER:
            _precede(network, levels, k, weight[layer, k], rest)
    if m == 0:
        return 0.0 if is_last else -np.inf
    start = min(max(0, levels.start - levels.lowest[0]), width - 1)
    begun = float(rest.following[0, start])
    return max(begun, 0.0) if is_last else begun


@inlined
def _raise_from(values: Floats, others: Floats, up: int) -> None:
    """Raise values to those of a table that begins ``up`` levels lower; the last holds above."""
    last = len(others) - 1
    for x in range(len(values)):
        values[x] = max(values[x], others[min(x + up, last)])


@kernel
def _precede(network: Network, levels: EnergyLevels, k: int, weight: float, rest: _Rest) -> None:
    """Let a task be the next one, of those whom it follows directly and of all it may follow."""
    low, cap, cost = levels.lowest[k], levels.cap[k], levels.cost[k]
    least, last = max(levels.floor[k], low), levels.width - 1
    after = rest.after[k]
    for x in range(levels.width):
        left = min(low + x, cap) - cost
        if left >= least:
            gained = weight + after[min(left - low, last)]
            rest.following[k, x] = max(rest.following[k, x], gained)
    for at in range(network.straight_first[k], network.straight_first[k + 1]):
        i = network.straight_rows[at]
        begin = levels.lowest[i] + levels.give[at]
        for x in range(levels.width):
            left = min(begin + x, cap) - cost
            if left >= least:
                rest.after[i, x] = max(rest.after[i, x], weight + after[min(left - low, last)])
