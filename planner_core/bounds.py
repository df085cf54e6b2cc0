r"""An upper bound on what any plan of a problem can earn.

Weak duality: give each target a price :math:`0 \le \lambda_i \le r_i`. Then no plan earns more
than :math:`\sum_i \lambda_i` plus, for each satellite, the longest chain of collects in which
an image of :math:`i` is worth :math:`r_i - \lambda_i` (and may be taken again and again).
Battery, recorder and stations are left out, which can only raise the bound. Prices come from
a subgradient search; whatever they are, the bound holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from planner_core.chains import Links
from planner_core.problem import COLLECT, Floats, Ints, Problem

Proof = Literal["lagrangian", "milp", "dp"]

_PAIRS_TO_SPEND = 40_000_000
_ROUNDING = 1e-6  # relative; far above the rounding of the sums, far below one reward


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bound:
    """A proven upper bound on what a valid plan can earn.

    Attributes
    ----------
    prices
        What proves a Lagrangian bound (``lagrangian_value`` checks them) or one by dynamic
        programmes (``resource_bound.resource_value``), one per target; None for other proofs.
        Shape ``(num_targets,)``.
    unit
        In what the dynamic programmes count worth.
    """

    value: float
    proof: Proof
    prices: Floats | None = None
    unit: float | None = None


def lagrangian_value(
    problem: Problem, prices: Floats, links: Sequence[Links] | None = None
) -> tuple[float, Ints]:
    """Return the bound that ``prices`` prove, and how often its chains take each target.

    This is the whole proof: it needs no search, only the problem. ``links`` of its satellites
    save time where many prices are tried.
    """
    links = links or [Links.of(problem, satellite) for satellite in problem.satellites]
    prices = np.clip(prices, 0.0, problem.target_reward)
    total = float(prices[_reachable(problem)].sum())
    counts = np.zeros(len(prices), dtype=np.int32)
    for satellite, own in zip(problem.satellites, links, strict=True):
        is_collect = satellite.kind == COLLECT
        weight = np.zeros(len(satellite))
        places = satellite.place[is_collect]
        weight[is_collect] = problem.target_reward[places] - prices[places]
        value, chain = own.longest(weight)
        total += value
        counts += np.bincount(satellite.place[chain], minlength=len(prices)).astype(np.int32)
    return total, counts


def _reachable(problem: Problem) -> npt.NDArray[np.bool_]:
    _, offsets = problem.target_opportunities
    return np.diff(offsets) > 0


def lagrangian_bound(problem: Problem, reward: float, iterations: int | None = None) -> Bound:
    """Return a bound, tightened by subgradient steps towards ``reward`` (of a known plan).

    Parameters
    ----------
    iterations
        How many steps; by default as many as a fraction of a second allows, counted from
        the size of the problem so that the same problem always gets the same bound.
    """
    links = [Links.of(problem, satellite) for satellite in problem.satellites]
    if iterations is None:
        pairs = sum(link.num_steps + 20 * len(link.order.near_from) for link in links)
        iterations = int(np.clip(_PAIRS_TO_SPEND / max(1, pairs), 4, 300))
    is_reachable = _reachable(problem)
    prices = np.where(is_reachable, problem.target_reward, 0.0)
    best_value, best_prices = float(prices.sum()), prices
    prices = prices * 0.5
    theta, stalled = 1.0, 0
    for _ in range(iterations):
        value, counts = lagrangian_value(problem, prices, links)
        if value < best_value - 1e-9:
            best_value, best_prices, stalled = value, prices, 0
        else:
            stalled += 1
        if stalled == 12:
            theta, stalled, prices = theta * 0.6, 0, best_prices
            continue
        gradient = np.where(is_reachable, 1.0 - counts, 0.0)
        # At a price of zero (or of the whole reward) a step outward leads nowhere.
        gradient[(prices <= 0.0) & (gradient > 0.0)] = 0.0
        gradient[(prices >= problem.target_reward) & (gradient < 0.0)] = 0.0
        norm = float(gradient @ gradient)
        if norm == 0.0 or value - reward < 1e-9:
            break
        step = theta * max(value - max(reward, 0.97 * best_value), 0.0) / norm
        prices = np.clip(prices - step * gradient, 0.0, problem.target_reward)
    return Bound(
        value=rounded_bound(problem, best_value, reward), proof="lagrangian", prices=best_prices
    )


def rounded_bound(problem: Problem, value: float, reward: float) -> float:
    """Return a bound rounded up for safety, then down to what whole rewards can add up to.

    Never below ``reward``, which some plan has earned.
    """
    safe = value * (1.0 + 1e-12) + 1e-9
    if np.all(problem.target_reward == np.round(problem.target_reward)):
        safe = float(np.floor(safe + _ROUNDING))
    return max(safe, reward)
