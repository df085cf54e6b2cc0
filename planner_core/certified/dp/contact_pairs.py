"""The most that a path gains in which one contact directly follows another, for all such pairs.

``contact_layers`` is the forward pass: the most of any path up to a task in a layer. Here a
backward pass adds the completion: the most that may follow a task in a layer, by the energy that is
left. At the contact where a path enters a layer the two add up. Pairs that cannot beat a known plan
are left out of the exact programme (``contact_queues``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.contact_layers import Layers, Tables, fill_layer
from planner_core.certified.dp.energy_labels import EnergyLevels
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import NEVER
from planner_core.jit import inlined, inner, kernel
from planner_core.problem import Floats


class _Completions(NamedTuple):
    """The most that a path gains after a task, in one layer at a time.

    Energy is counted from the task's ``lowest``.

    Attributes
    ----------
    after
        By the energy that is left after it. Shape ``(m, width)``.
    following
        With that task or a later one next, after idling, by the energy before it. Shape
        ``(m + 1, width)``.
    in_layer
        After a contact, in each layer. Shape ``(num_contacts, num_layers, width)``.
    best
        After a contact, in any layer. Shape ``(num_contacts, width)``.
    """

    after: Floats
    following: Floats
    in_layer: Floats
    best: Floats


@kernel
def most_by_pairs(network: Network, levels: EnergyLevels, layers: Layers, weight: Floats) -> Floats:
    """Return the most of a path that goes from one contact, or the start, directly to another.

    Each contact must have a layer of its own.

    Parameters
    ----------
    weight
        As of ``most_by_contacts``. Shape ``(num_layers, m)``.

    Returns
    -------
    A row for the start and for each contact, a column for each next contact and for none; minus
    infinity where there is no such path. Shape ``(num_contacts + 1, num_layers)``.
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
    completions = _Completions(
        np.empty((m, width)),
        np.empty((m + 1, width)),
        np.full((num_contacts, num_layers, width), -np.inf),
        np.full((num_contacts, width), -np.inf),
    )
    most = np.full((num_contacts + 1, num_layers), -np.inf)
    for layer in range(num_layers - 1, -1, -1):
        most[0, layer] = _fill_backward(network, levels, layers, weight, layer, completions)
        for contact in range(num_contacts):
            for x in range(width):
                further = completions.in_layer[contact, layer, x]
                completions.best[contact, x] = max(completions.best[contact, x], further)
                if x < tables.num_at_contact[contact]:
                    gained = tables.at_contact[contact, x] + further
                    most[contact + 1, layer] = max(most[contact + 1, layer], gained)
    return most


@inner
def _fill_backward(
    network: Network,
    levels: EnergyLevels,
    layers: Layers,
    weight: Floats,
    layer: int,
    completions: _Completions,
) -> float:
    """Fill the completions of a layer from its end; return the most of a path that begins in it."""
    is_last, m, width = layer == len(layers.first) - 1, weight.shape[1], levels.width
    if not is_last:
        m = layers.contact[layer] + 1
    completions.after[:m] = 0.0 if is_last else -np.inf
    completions.following[m] = -np.inf
    for k in range(m - 1, -1, -1):
        number, after, following = layers.number[k], completions.after[k], completions.following[k]
        later = network.idle_from[k]
        if number == layer:
            for x in range(width):
                after[x] = completions.best[number, x]
        elif later < m:
            _raise_from(
                after, completions.following[later], levels.lowest[k] - levels.lowest[later]
            )
        following[:] = -np.inf
        if k + 1 < m:
            _raise_from(
                following, completions.following[k + 1], levels.lowest[k] - levels.lowest[k + 1]
            )
        if number >= 0 and number != layer:
            completions.in_layer[number, layer] = after
        elif weight[layer, k] != NEVER:
            _extend_backward(network, levels, k, weight[layer, k], completions)
    if m == 0:
        return 0.0 if is_last else -np.inf
    start = min(max(0, levels.start - levels.lowest[0]), width - 1)
    begun = float(completions.following[0, start])
    return max(begun, 0.0) if is_last else begun


@inlined
def _raise_from(values: Floats, others: Floats, up: int) -> None:
    """Raise values to those of a table that begins ``up`` levels lower; the last holds above."""
    last = len(others) - 1
    for x in range(len(values)):
        values[x] = max(values[x], others[min(x + up, last)])


@inner
def _extend_backward(
    network: Network, levels: EnergyLevels, k: int, weight: float, completions: _Completions
) -> None:
    """Extend completions by a task in front: after idling, and by arcs from tasks near it."""
    low, cap, cost = levels.lowest[k], levels.cap[k], levels.cost[k]
    least, last = max(levels.floor[k], low), levels.width - 1
    after = completions.after[k]
    for x in range(levels.width):
        left = min(low + x, cap) - cost
        if left >= least:
            gained = weight + after[min(left - low, last)]
            completions.following[k, x] = max(completions.following[k, x], gained)
    for at in range(network.straight_first[k], network.straight_first[k + 1]):
        i = network.straight_rows[at]
        begin = levels.lowest[i] + levels.give[at]
        for x in range(levels.width):
            left = min(begin + x, cap) - cost
            if left >= least:
                completions.after[i, x] = max(
                    completions.after[i, x], weight + after[min(left - low, last)]
                )
