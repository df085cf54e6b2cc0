r"""An upper bound on what any plan of a problem can earn.

Weak duality: give each target a price :math:`\lambda_i`, from 0 to the best worth of its collects.
Then no plan earns more than :math:`\sum_i \lambda_i` plus, for each satellite, the heaviest path
of tasks in which collect k of :math:`i` is worth :math:`\max(0, v_k - \lambda_i)` (and may be
followed by others of :math:`i`).
Battery, recorder and stations are left out, which can only raise the bound. Prices come from
a subgradient search; whatever they are, the bound holds.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.dp.elementary import memory_of
from planner_core.certified.multipliers.elementary import ROUND, ElementaryPrices
from planner_core.certified.multipliers.incremental import incremental_prices
from planner_core.certified.multipliers.subgradient import improve_prices
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.precedence.arcs import arc_network_of
from planner_core.precedence.network import Network, heaviest_paths, network_of
from planner_core.problem import (
    Bytes,
    Floats,
    Ints,
    Problem,
)
from planner_core.worth import surplus, weights

_NODES_TO_SPEND = 6_000_000


def lagrangian_value(problem: Problem, prices: Floats) -> tuple[float, Ints]:
    """Return the bound that ``prices`` prove, and how often its paths take each target.

    This is the whole proof: it needs no search, only the problem.
    """
    network = network_of(problem)
    num_targets = len(problem.target_ids)
    price = np.append(surplus(prices, problem.best_worth), 0.0)
    n = len(network.row)
    previous = np.empty(n, dtype=np.int32)
    ends = np.empty(len(network.first) - 1, dtype=np.int32)
    worth = problem.worth[network.row]
    weight = weights(worth, price[network.place])
    total = price.sum() + heaviest_paths(network, weight, np.empty(n), previous, ends)
    counts = np.zeros(num_targets + 1, dtype=np.int32)
    for end in ends:
        at = int(end)
        while at >= 0:
            if worth[at] >= price[network.place[at]]:
                counts[network.place[at]] += 1
            at = int(previous[at])
    return float(total), counts[:-1]


def lagrangian_bound(problem: Problem, reward: float, iterations: int | None = None) -> Bound:
    """Return a bound, tightened by subgradient steps towards ``reward`` (of a known plan).

    Parameters
    ----------
    iterations
        How many steps; by default as many as a fraction of a second allows, counted from
        the size of the problem so that the same problem always gets the same bound.
    """
    if iterations is None:
        iterations = default_steps(len(problem.opportunities))
    if problem.offers_choice and iterations > 0:
        arcs = arc_network_of(problem)
        memory = memory_of(problem, arcs)
        passes = ElementaryPrices(problem, arcs, memory, 0, num_rounds=iterations // ROUND + 1)
        passes.improve(iterations // ROUND + 1, np.zeros(1, dtype=np.uint8))
        value = rounded_bound(problem, passes.bound, reward)
        return Bound(value=value, proof="lagrangian", prices=passes.prices, is_elementary=True)
    network = network_of(problem)
    value, prices = priced_bound(problem, network, reward, iterations, np.zeros(1, dtype=np.uint8))
    return Bound(value=rounded_bound(problem, value, reward), proof="lagrangian", prices=prices)


def default_steps(num_nodes: int) -> int:
    """Return how many subgradient steps a network is worth."""
    return int(np.clip(_NODES_TO_SPEND / max(1, num_nodes), 100, 1000))


def priced_bound(
    problem: Problem,
    network: Network,
    level: float,
    num_steps: int,
    stop: Bytes,
) -> tuple[float, Floats]:
    """Return the value that prices prove after so many steps towards ``level``, and the prices."""
    if sum(len(satellite) > 0 for satellite in problem.satellites) > 1:
        return incremental_prices(problem, network, level, num_steps, stop)
    best = np.append(problem.best_worth, 0.0)
    whole = float(best.sum())
    prices = best * 0.5
    worth = problem.worth[network.row]
    value = improve_prices(network, worth, best, prices, level, num_steps, stop)
    if whole <= value:
        return whole, problem.best_worth
    return float(value), prices[:-1]
