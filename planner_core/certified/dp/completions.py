"""The most that a path gains after a task in a layer of ``contact_layers``: the backward pass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.certified.dp.contact_layers import Layers
from planner_core.certified.dp.energy_labels import EnergyLevels
from planner_core.certified.dp.resource_network import Network
from planner_core.certified.signs import NEVER
from planner_core.jit import inlined, inner
from planner_core.problem import Floats


class Completions(NamedTuple):
    """The most that a path gains after a task, in one layer at a time.

    Energy is counted from the task's ``lowest``.

    Attributes
    ----------
    after
        By the energy that is left after it. Shape ``(m, width)``.
    following
        If that task or a later one comes next, after idling, by the energy before it. Shape
        ``(m + 1, width)``.
    in_layer
        After a contact, in the current layer. Shape ``(num_contacts, width)``.
    best
        After a contact, in any layer. Shape ``(num_contacts, width)``.
    """

    after: Floats
    following: Floats
    in_layer: Floats
    best: Floats


@inner
def completions_of(num_contacts: int, num_tasks: int, width: int) -> Completions:
    """Return storage for completions."""
    return Completions(
        np.empty((num_tasks, width)),
        np.empty((num_tasks + 1, width)),
        np.full((num_contacts, width), -np.inf),
        np.full((num_contacts, width), -np.inf),
    )


@inner
def fill_backward(
    network: Network,
    levels: EnergyLevels,
    layers: Layers,
    weight: Floats,
    layer: int,
    begin: int,
    completions: Completions,
) -> float:
    """Fill the completions of a layer from its end back to a task.

    Return the most that a path gains that begins in the layer; valid if that task is the first.
    """
    is_last, m, width = layer == len(layers.first) - 1, weight.shape[1], levels.width
    if not is_last:
        m = layers.contact[layer] + 1
    completions.after[begin:m] = 0.0 if is_last else -np.inf
    completions.following[m] = -np.inf
    for k in range(m - 1, begin - 1, -1):
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
            completions.in_layer[number] = after
        elif weight[layer, k] != NEVER:
            _extend_backward(network, levels, k, weight[layer, k], completions)
    if m <= begin:
        return 0.0 if is_last else -np.inf
    start = min(max(0, levels.start - levels.lowest[0]), width - 1)
    begun = float(completions.following[begin, start])
    return max(begun, 0.0) if is_last else begun


@inlined
def _raise_from(values: Floats, others: Floats, up: int) -> None:
    """Raise values to a table's that begins ``up`` levels lower and whose last one holds above."""
    last = len(others) - 1
    for x in range(len(values)):
        values[x] = max(values[x], others[min(x + up, last)])


@inner
def _extend_backward(
    network: Network, levels: EnergyLevels, k: int, weight: float, completions: Completions
) -> None:
    """Put a task in front of its completions: after idling, and by arcs from tasks near it."""
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
