"""The most that a path gains if one contact directly follows another, for all such pairs.

``contact_layers`` is the forward pass: the most of any path up to a task in a layer. Here a
backward pass adds the completion: the most that may follow a task in a layer, by the energy that is
left. At the contact where a path enters a layer the two add up. The exact programme
(``contact_queues``) leaves out pairs, and states, that cannot beat a known plan.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.completions import completions_of, fill_backward
from planner_core.certified.dp.contact_layers import Layers, Tables, fill_layer
from planner_core.certified.dp.energy_labels import EnergyLevels
from planner_core.certified.dp.resource_network import Network
from planner_core.jit import kernel
from planner_core.problem import Floats


@kernel
def most_by_pairs(
    network: Network, levels: EnergyLevels, layers: Layers, weight: Floats
) -> tuple[Floats, Floats]:
    """Return the most that a path gains from one contact, or the start, directly to another.

    Each contact must have a layer of its own.

    Parameters
    ----------
    weight
        As in ``most_by_contacts``. Shape ``(num_layers, m)``.

    Returns
    -------
    A row for the start and for each contact, a column for each next contact and for none, minus
    infinity if there is no such path, of shape ``(num_contacts + 1, num_layers)``; and the most
    that may follow each contact, by the energy that is left, of shape ``(num_contacts, width)``.
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
    completions = completions_of(num_contacts, m, width)
    most = np.full((num_contacts + 1, num_layers), -np.inf)
    for layer in range(num_layers - 1, -1, -1):
        completions.in_layer[:] = -np.inf
        most[0, layer] = fill_backward(network, levels, layers, weight, layer, 0, completions)
        for contact in range(num_contacts):
            for x in range(width):
                further = completions.in_layer[contact, x]
                completions.best[contact, x] = max(completions.best[contact, x], further)
                if x < tables.num_at_contact[contact]:
                    gained = tables.at_contact[contact, x] + further
                    most[contact + 1, layer] = max(most[contact + 1, layer], gained)
    return most, completions.best
