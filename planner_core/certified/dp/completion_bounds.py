"""The least energy a satellite needs to gain a given worth: backward, recorder left out."""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.resource_network import Network
from planner_core.jit import inner, kernel
from planner_core.problem import Ints, Singles


@kernel
def least_energy(network: Network, weight: Ints, top: int) -> tuple[Singles, Singles]:
    """Return the least energy from which tasks of total weight ``r`` or more remain possible.

    Parameters
    ----------
    weight
        Whole worth of each task, not negative. Shape ``(m,)``.
    top
        The largest total considered.

    Returns
    -------
    Energy while idle before each row (shape ``(m + 1, top + 1)``), and right after each task (shape
    ``(m, top + 1)``). Energy is as in ``Network``, rounded a little down so that it is a lower
    bound, and infinite if none suffices.
    """
    m = len(weight)
    idle = np.full((m + 1, top + 1), np.inf, dtype=np.float32)
    idle[:, 0] = -np.inf
    after = np.empty((m, top + 1), dtype=np.float32)
    reach = np.zeros(m + 1, dtype=np.int64)  # the largest total that some energy suffices for
    reached = np.zeros(m, dtype=np.int64)
    for k in range(m - 1, -1, -1):
        own = after[k]
        for x in range(top + 1):
            own[x] = idle[network.idle_from[k], x]
        furthest = reach[network.idle_from[k]]
        for at in range(network.near_first[k], network.near_first[k + 1]):
            j = network.near_rows[at]
            end = min(top, reached[j] + weight[j])
            furthest = max(furthest, end)
            _lower_by_taking(network, j, weight[j], network.near_give[at], after[j], own[: end + 1])
        while furthest > 0 and own[furthest] == np.inf:
            furthest -= 1
        reached[k] = furthest
        end = min(top, furthest + weight[k])
        reach[k] = max(reach[k + 1], end)
        idle[k] = idle[k + 1]
        _lower_by_taking(network, k, weight[k], 0.0, own, idle[k, : end + 1])
        while reach[k] > 0 and idle[k, reach[k]] == np.inf:
            reach[k] -= 1
    return idle, after


@inner
def _lower_by_taking(
    network: Network, row: int, weight: int, give: float, after: Singles, values: Singles
) -> None:
    """Lower each value to the energy needed to gain as much by taking the task.

    ``give`` is the energy that the arc to the task gives back.
    """
    # One step of single precision may be off by this much; it keeps sums on the safe side.
    rounding = 1.3e-7 * (1.0 + abs(network.energy_floor[-1]))
    cap = np.float32(network.energy_cap[row] + rounding)
    cost = np.float32(network.energy_cost[row] - rounding)
    floor = np.float32(network.energy_floor[row] - rounding)
    given = np.float32(give + rounding if give > 0.0 else 0.0)
    near = min(weight + 1, len(values))
    if floor + cost <= cap:
        for r in range(1, near):
            values[r] = min(values[r], floor + cost - given)
    beyond = values[near:]
    left = after[1 : 1 + len(beyond)]
    for i in range(len(beyond)):
        wanted = max(left[i], floor) + cost
        wanted = wanted - given if wanted <= cap else np.float32(np.inf)
        beyond[i] = min(beyond[i], wanted)
