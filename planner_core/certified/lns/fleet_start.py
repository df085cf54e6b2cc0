"""A first plan of a fleet: one part of the network after another, over the targets that are left.

By worth alone, the first parts would take targets that only the last ones can reach. At the
multipliers of the bound, a target that several parts can image is worth little to each, and each
part ends up with about what the best plans give it.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.tuning import TUNING
from planner_core.jit import kernel
from planner_core.precedence.network import Network, heaviest_path
from planner_core.problem import Bools, Floats, Ints


def start_at_multipliers(
    network: Network, worth: Floats, multipliers: Floats, taken: Bools, seed: int
) -> list[int]:
    """Return the rows of the plan that earns most (multipliers not deducted) of a few.

    Parameters
    ----------
    worth
        Of each node. Shape ``(n,)``.
    multipliers
        Of each target, with a last entry of zero that stands for contacts.
    taken
        Targets that are taken already. Shape of ``multipliers``.
    """
    rng = np.random.default_rng(seed)
    reduced = np.maximum(worth - multipliers[network.site], TUNING.trifle * worth)
    weight, value = np.empty(len(network.row)), np.empty(len(network.row))
    previous = np.empty(len(network.row), dtype=np.int32)
    best, best_reward = [], -1.0
    for _ in range(TUNING.several):
        is_left = ~taken
        nodes = np.concatenate(
            [
                _take(network, part, reduced, worth, is_left, weight, value, previous)
                for part in rng.permutation(len(network.first) - 1)
            ]
        )
        earned = float(worth[nodes].sum())
        if earned > best_reward:
            best, best_reward = network.row[nodes].tolist(), earned
    return best


@kernel
def _take(
    network: Network, part: int, reduced: Floats, worth: Floats, is_left: Bools,
    weight: Floats, value: Floats, previous: Ints,
) -> Ints:  # fmt: skip
    """Return the best node of each free target on the heaviest path, and mark these as taken."""
    for a in range(network.first[part], network.first[part + 1]):
        weight[a] = reduced[a] if is_left[network.site[a]] else 0.0
    _, at = heaviest_path(network, part, weight, value, previous)
    nodes = np.empty(network.first[part + 1] - network.first[part], dtype=np.int32)
    count = 0
    while at >= 0:
        site = network.site[at]
        if weight[at] > 0.0 and is_left[site]:
            is_left[site] = False
            nodes[count] = at
            count += 1
        elif weight[at] > 0.0:
            for i in range(count):
                if network.site[nodes[i]] == site and worth[nodes[i]] < worth[at]:
                    nodes[i] = at
        at = previous[at]
    return nodes[:count].copy()
