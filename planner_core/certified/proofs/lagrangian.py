r"""An upper bound on what any plan of a problem can earn.

Weak duality: give each target a multiplier :math:`\lambda_i`, from 0 to the best worth of its
collects. Then no plan earns more than :math:`\sum_i \lambda_i` plus, for each satellite, the
heaviest path of tasks in which collect k of :math:`i` is worth :math:`\max(0, v_k - \lambda_i)`
(and may be followed by others of :math:`i`).
Battery, recorder and stations are left out, which can only raise the bound. Multipliers come from
an ascent; the bound holds at any multipliers.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from planner_core.certified.multipliers.elementary import ascent_on_passes
from planner_core.certified.multipliers.paths import ascent_on_paths
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.tuning import TUNING
from planner_core.precedence.network import heaviest_paths, network_of
from planner_core.problem import Floats, Ints, Problem
from planner_core.worth import surplus, weights


def lagrangian_value(problem: Problem, multipliers: Floats) -> tuple[float, Ints]:
    """Return the bound that ``multipliers`` prove, and how often its paths take each target.

    This is the whole proof: it needs no search, only the problem.
    """
    network = network_of(problem)
    num_targets = len(problem.target_ids)
    multiplier = np.append(surplus(multipliers, problem.best_worth), 0.0)
    n = len(network.row)
    previous = np.empty(n, dtype=np.int32)
    ends = np.empty(len(network.first) - 1, dtype=np.int32)
    worth = problem.worth[network.row]
    weight = weights(worth, multiplier[network.site])
    total = multiplier.sum() + heaviest_paths(network, weight, np.empty(n), previous, ends)
    counts = np.zeros(num_targets + 1, dtype=np.int32)
    for end in ends:
        at = int(end)
        while at >= 0:
            if worth[at] >= multiplier[network.site[at]]:
                counts[network.site[at]] += 1
            at = int(previous[at])
    return float(total), counts[:-1]


# Steps of a search ask for the same bound again until they know a better plan.
_latest: WeakKeyDictionary[Problem, tuple[tuple[float, int], Bound]] = WeakKeyDictionary()


def lagrangian_bound(problem: Problem, reward: float, num_epochs: int | None = None) -> Bound:
    """Return a bound, tightened by an ascent on the multipliers until it is down to ``reward``.

    Parameters
    ----------
    reward
        The reward of a known plan.
    num_epochs
        Epochs of the ascent; by default as many as take a fraction of a second, counted from the
        size of the problem so that the same problem always gets the same bound.
    """
    if num_epochs is None:
        num_epochs = default_epochs(len(problem.opportunities))
    asked = reward, num_epochs
    known = _latest.get(problem)
    if known is not None and known[0] == asked:
        return known[1]
    is_elementary = problem.offers_choice and num_epochs > 0
    if is_elementary:
        ascent = ascent_on_passes(problem, 0, num_epochs)
    else:
        ascent = ascent_on_paths(problem, network_of(problem), num_epochs, 0)
    ascent.run(reward, np.zeros(1, dtype=np.uint8))
    bound = Bound(
        value=rounded_bound(problem, ascent.value, reward),
        proof="lagrangian",
        multipliers=ascent.multipliers,
        is_elementary=is_elementary,
    )
    _latest[problem] = asked, bound
    return bound


def default_epochs(num_nodes: int) -> int:
    """Return how many epochs an ascent on a network of this size runs."""
    least, most = TUNING.epochs // 2, TUNING.epochs
    return int(np.clip(TUNING.quick_nodes / max(1, num_nodes), least, most))
