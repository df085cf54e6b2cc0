"""Prices of targets that bring the Lagrangian bound down: deflected subgradient steps."""

from __future__ import annotations

from typing import Final

import numpy as np

from planner_core.jit import kernel
from planner_core.precedence.network import Network, heaviest_paths
from planner_core.problem import Bytes, Floats

_DEFLECTION: Final = 0.7  # share of the last direction that is kept
_PATIENCE: Final = 20  # steps without gain before they get shorter
_SHORTER: Final = 0.7
_SHORTEST: Final = 1e-4
_GAIN: Final = 1e-4
_NEAR: Final = 0.8


@kernel
def improve_prices(
    network: Network,
    worth: Floats,
    most: Floats,
    prices: Floats,
    level: float,
    num_steps: int,
    stop: Bytes,
) -> float:
    """Improve prices in place; return the value that they prove.

    Parameters
    ----------
    worth
        Of each node. Shape ``(n,)``.
    most, prices
        The best worth and the price of each place, with a last entry of zero for contacts.
    level
        What some plan earns: steps aim there, and end once the value is as low.
    """
    n, num_places = len(network.row), len(most)
    weight, value = np.empty(n), np.empty(n)
    previous = np.empty(n, dtype=np.int32)
    ends = np.empty(len(network.first) - 1, dtype=np.int32)
    excess = np.zeros(num_places)
    is_reachable = np.zeros(num_places, dtype=np.bool_)
    for a in range(n):
        is_reachable[network.place[a]] = True
    is_reachable[num_places - 1] = False
    prices[~is_reachable] = 0.0
    now, direction = prices.copy(), np.zeros(num_places)
    best, theta, stalled = np.inf, 1.0, 0
    for _ in range(num_steps):
        for a in range(n):
            weight[a] = max(0.0, worth[a] - now[network.place[a]])
        total = now.sum() + heaviest_paths(network, weight, value, previous, ends)
        if total < best:
            stalled = 0 if total < best - _GAIN * abs(total) else stalled
            best = total
            prices[:] = now
        stalled += 1
        if total <= level * (1.0 + 1e-12) or theta < _SHORTEST or stop[0]:
            break
        if stalled > _PATIENCE:
            theta, stalled = theta * _SHORTER, 0
            now[:] = prices
            direction[:] = 0.0
            continue
        excess[:] = -1.0
        for s in range(len(ends)):
            at = ends[s]
            while at >= 0:
                # What is worth less than its price is only passed through.
                if worth[at] >= now[network.place[at]]:
                    excess[network.place[at]] += 1.0
                at = previous[at]
        norm = 0.0
        for i in range(num_places):
            if not is_reachable[i]:
                continue
            # At a price of zero (or of the best worth) a step outward leads nowhere.
            can_fall, can_rise = now[i] > 0.0, now[i] < most[i]
            if (excess[i] < 0.0 and not can_fall) or (excess[i] > 0.0 and not can_rise):
                excess[i] = 0.0
            direction[i] = excess[i] + _DEFLECTION * direction[i]
            if (direction[i] < 0.0 and not can_fall) or (direction[i] > 0.0 and not can_rise):
                direction[i] = 0.0
            norm += direction[i] * direction[i]
        if norm == 0.0:
            break
        # The rewards of poor plans are too far off to aim at.
        step = theta * (total - max(level, _NEAR * best)) / norm
        for i in range(num_places):
            if is_reachable[i]:
                now[i] = min(max(now[i] + step * direction[i], 0.0), most[i])
    return best
