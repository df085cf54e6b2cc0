"""A first plan of a fleet: one stretch of one satellite after another, over what is left.

Taken alone the first ones would snatch targets that only the last ones can reach. At the prices
of the bound a target that several can have is worth little to each of them, and all end up with
about what the best plans give them.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.jit import kernel
from planner_core.precedence.network import Network, heaviest_path
from planner_core.problem import Bools, Floats, Ints

_ORDERS: Final = 4  # of the satellites that are tried
_LEAST: Final = 1e-3  # of its reward that a target is worth, whatever its price


def priced_start(
    network: Network, reward: Floats, prices: Floats, taken: Bools, seed: int
) -> list[int]:
    """Return the rows of the best of a few plans; what they earn counts without the prices.

    Parameters
    ----------
    reward, prices
        Of each place, with a last entry of zero that stands for contacts.
    taken
        Places that are taken already. Shape of ``reward``.
    """
    rng = np.random.default_rng(seed)
    worth = np.maximum(reward - prices, _LEAST * reward)
    weight, value = np.empty(len(network.row)), np.empty(len(network.row))
    previous = np.empty(len(network.row), dtype=np.int32)
    best, best_reward = [], -1.0
    for _ in range(_ORDERS):
        left = np.where(taken, 0.0, worth)
        nodes = [
            _take(network, part, left, weight, value, previous)
            for part in rng.permutation(len(network.first) - 1)
        ]
        earned = float(reward[~taken & (left == 0.0)].sum())
        if earned > best_reward:
            best, best_reward = network.row[np.concatenate(nodes)].tolist(), earned
    return best


@kernel
def _take(
    network: Network, part: int, worth: Floats, weight: Floats, value: Floats, previous: Ints
) -> Ints:
    """Return one node for each target of the heaviest path, and let them be worth nothing."""
    for a in range(network.first[part], network.first[part + 1]):
        weight[a] = worth[network.place[a]]
    _, at = heaviest_path(network, part, weight, value, previous)
    nodes = np.empty(network.first[part + 1] - network.first[part], dtype=np.int32)
    count = 0
    while at >= 0:
        if worth[network.place[at]] > 0.0:
            worth[network.place[at]] = 0.0
            nodes[count] = at
            count += 1
        at = previous[at]
    return nodes[:count].copy()
