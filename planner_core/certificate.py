r"""Proofs that no plan earns as much as some amount, checked without any search.

Multipliers :math:`\lambda_i \ge 0` for the targets and :math:`\mu_c \ge 0` for cuts
:math:`a_c x \le b_c` bound what a plan earns by :math:`\sum_i \lambda_i + \sum_c \mu_c b_c`
and, for each satellite, its heaviest path where task k on target i is worth
:math:`\max(0, r_i - \lambda_i - \sum_c \mu_c a_{ck})`. The same with the path led through a
task bounds the plans that hold this task. A certificate is a sequence of multipliers: each
strikes out the tasks that no plan worth the amount can hold, until no path is left that
could be worth it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.comparable import Order, are_comparable, order_of, transitive_closure
from planner_core.network import Network, heaviest_through, network_of
from planner_core.problem import COLLECT, Bools, Floats, Ints, Problem
from planner_core.restrict import restricted

_ROUNDING = 1e-9  # relative; what sums of floats may be off by


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cut:
    """An inequality that all plans keep, from sets of which a plan takes one task at most.

    Add up the sets, halve, and round down; a single set stands for itself.

    Attributes
    ----------
    sets
        Opportunities that exclude each other pairwise: of one target, or unrelated in the
        order of one satellite. An odd number of sets.
    """

    sets: tuple[Ints, ...]

    @property
    def limit(self) -> int:
        """What the weighted tasks of a plan do not exceed."""
        return max(1, (len(self.sets) - 1) // 2)

    def weights(self) -> tuple[Ints, Ints]:
        """Return the opportunities of the cut and how much each counts."""
        rows, counts = np.unique(np.concatenate(self.sets), return_counts=True)
        if len(self.sets) > 1:
            counts = counts // 2
        return rows[counts > 0], counts[counts > 0].astype(np.int32)

    def among(self, is_open: Bools, number: Ints) -> Cut:
        """Return the cut on those rows that are open, by their new numbers."""
        return Cut(sets=tuple(number[group[is_open[group]]] for group in self.sets))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Multipliers:
    """Prices of targets and of cuts, none of them negative.

    Attributes
    ----------
    prices
        Shape ``(num_targets,)``.
    cut_prices
        One for each of ``cuts``.
    """

    prices: Floats
    cuts: tuple[Cut, ...] = ()
    cut_prices: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certificate:
    """The proof that no plan is worth ``amount`` or more."""

    amount: float
    steps: tuple[Multipliers, ...]


def is_refuted(problem: Problem, certificate: Certificate) -> bool:
    """Return whether the certificate proves what it claims. This is the whole proof."""
    orders = [order_of(transitive_closure(problem, s)) for s in problem.satellites]
    left = np.arange(len(problem.opportunities))
    for step in certificate.steps:
        if np.any(step.prices < 0.0) or any(price < 0.0 for price in step.cut_prices):
            return False
        if not all(_is_sound(problem, orders, cut) for cut in step.cuts):
            return False
        network = network_of(restricted(problem, left))
        total, through = values_through(problem, network, left, step)
        if is_below(total, certificate.amount):
            return True
        is_left = np.empty(len(left), dtype=np.bool_)
        is_left[network.row] = ~is_below(through, certificate.amount)
        left = left[is_left]
    return False


def values_through(
    problem: Problem, network: Network, rows: Ints, step: Multipliers
) -> tuple[float, Floats]:
    """Return what bounds all plans, and the plans that hold each node of the network.

    Parameters
    ----------
    network
        Of the problem restricted to ``rows``.
    """
    constant, worth = _priced(problem, rows, step)
    total, through = heaviest_through(network, worth[network.row])
    return constant + total, constant + through


def is_below(value: Floats | float, amount: float) -> Bools:
    """Return whether a bound is below an amount, whatever the rounding of its sum."""
    return np.asarray(value) < amount - _ROUNDING * max(1.0, abs(amount))


def _priced(problem: Problem, rows: Ints, step: Multipliers) -> tuple[float, Floats]:
    """Return the constant of the bound, and what each opportunity is worth at the prices."""
    table = problem.opportunities
    is_collect = table.kind == COLLECT
    place = table.place[is_collect]
    worth = np.zeros(len(table))
    worth[is_collect] = problem.target_reward[place] - step.prices[place]
    constant = 0.0
    for cut, price in zip(step.cuts, step.cut_prices, strict=True):
        members, weights = cut.weights()
        worth[members] -= price * weights
        constant += price * cut.limit
    offered = table.place[rows][table.kind[rows] == COLLECT]
    constant += float(step.prices[np.unique(offered)].sum())
    return constant, np.maximum(worth, 0.0)[rows]


def _is_sound(problem: Problem, orders: list[Order], cut: Cut) -> bool:
    """Return whether the sets are an odd number and hold only tasks that exclude each other."""
    table, local = problem.opportunities, problem.local_row
    for members in cut.sets:
        rows = np.unique(members)
        if len(rows) != len(members) or np.any(table.kind[rows] != COLLECT):
            return False
        for i, a in enumerate(rows):
            for b in rows[:i]:
                satellite = int(table.satellite[a])
                if table.place[a] == table.place[b]:
                    continue
                if table.satellite[b] != satellite:
                    return False
                if are_comparable(orders[satellite], int(local[b]), int(local[a])):
                    return False
    return len(cut.sets) % 2 == 1
