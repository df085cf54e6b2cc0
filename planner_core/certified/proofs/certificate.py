r"""Proofs that no plan earns as much as some amount, checked without any search.

Multipliers :math:`\lambda_i \ge 0` for the targets and :math:`\mu_c \ge 0` for cuts
:math:`a_c x \le b_c` bound what a plan earns by :math:`\sum_i \lambda_i + \sum_c \mu_c b_c`
plus, for each satellite, its heaviest path if task k on target i is worth
:math:`\max(0, v_k - \lambda_i - \sum_c \mu_c a_{ck})`. The same sum with a path forced through a
task bounds the plans that hold this task. A certificate is a sequence of multipliers: each
removes the tasks that no plan worth the amount can hold (reduced-cost fixing), until no path that
remains could be worth it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.certified.tolerances import ROUNDING
from planner_core.precedence.network import Network, heaviest_through, network_of
from planner_core.precedence.relation import (
    Precedence,
    are_comparable,
    is_transitive,
    transitive_closure,
)
from planner_core.problem import (
    COLLECT,
    Bools,
    Floats,
    Ints,
    Problem,
)
from planner_core.problem.restrict import restricted


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cut:
    """An inequality that all plans satisfy, from sets of which a plan takes at most one task.

    A single set is a clique cut; more are added up, halved and rounded down to a zero-half cut.

    Attributes
    ----------
    sets
        Sets of tasks that exclude each other pairwise: collects of one target, or tasks of one
        satellite that are not comparable in the transitive closure of its precedence. An odd number
        of sets.
    """

    sets: tuple[Ints, ...]

    @property
    def limit(self) -> int:
        """The most that the weights of a plan's tasks add up to."""
        return max(1, (len(self.sets) - 1) // 2)

    def weights(self) -> tuple[Ints, Ints]:
        """Return the opportunities of the cut and the weight of each."""
        rows, counts = np.unique(np.concatenate(self.sets), return_counts=True)
        if len(self.sets) > 1:
            counts = counts // 2
        return rows[counts > 0], counts[counts > 0].astype(np.int32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Multipliers:
    """Multipliers of targets and of cuts, none of them negative.

    Attributes
    ----------
    of_targets
        Shape ``(num_targets,)``.
    of_cuts
        One for each of ``cuts``.
    """

    of_targets: Floats
    cuts: tuple[Cut, ...] = ()
    of_cuts: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Refutation:
    """The proof that no plan of the remaining tasks is worth some amount.

    Attributes
    ----------
    steps
        Multipliers that remove tasks step by step, until the last ones bound all that remains.
    branch
        If they do not: an opportunity, the refutation of plans that take it, and that of plans
        that leave it out.
    """

    steps: tuple[Multipliers, ...]
    branch: tuple[int, Refutation, Refutation] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certificate:
    """The proof that no plan is worth ``amount`` or more."""

    amount: float
    refutation: Refutation


def is_refuted(problem: Problem, certificate: Certificate) -> bool:
    """Return whether the certificate proves what it claims. This is the whole proof."""
    every = np.arange(len(problem.opportunities), dtype=np.int32)
    checked = _Checked(problem, certificate.amount)
    return checked.is_refuted(certificate.refutation, every)


class _Checked:
    """A problem, and the amount that its plans are to be proven not to reach."""

    def __init__(self, problem: Problem, amount: float) -> None:
        self._problem, self._amount = problem, amount
        self._closures: dict[int, Precedence] = {}  # of satellites with tasks in cuts

    def is_refuted(self, refutation: Refutation, left: Ints) -> bool:
        for step in refutation.steps:
            if np.any(step.of_targets < 0.0) or any(
                multiplier < 0.0 for multiplier in step.of_cuts
            ):
                return False
            if not all(self._is_sound(cut) for cut in step.cuts):
                return False
            network = network_of(restricted(self._problem, left))
            total, through = values_through(self._problem, network, left, step)
            if is_below(total, self._amount):
                return True
            is_left = np.empty(len(left), dtype=np.bool_)
            is_left[network.row] = ~is_below(through, self._amount)
            left = left[is_left]
        if refutation.branch is None:
            return False
        row, taken, leaving = refutation.branch
        # Without transitivity a satellite may pass by a target again without taking it.
        beside = left[[a == row or not self._exclude(row, int(a)) for a in left]]
        return (
            is_transitive(self._problem)
            and self.is_refuted(taken, beside)
            and self.is_refuted(leaving, left[left != row])
        )

    def _exclude(self, a: int, b: int) -> bool:
        """Return whether no plan without duplicates holds both tasks."""
        table, local = self._problem.opportunities, self._problem.local_row
        if table.kind[a] == table.kind[b] == COLLECT and table.site[a] == table.site[b]:
            return True
        satellite = int(table.satellite[a])
        if table.satellite[b] != satellite:
            return False
        if satellite not in self._closures:
            self._closures[satellite] = transitive_closure(self._problem.satellites[satellite])
        return not are_comparable(self._closures[satellite], int(local[a]), int(local[b]))

    def _is_sound(self, cut: Cut) -> bool:
        """Return whether the sets are odd in number, each of tasks that exclude each other."""
        return len(cut.sets) % 2 == 1 and all(
            len(np.unique(group)) == len(group)
            and all(self._exclude(int(a), int(b)) for i, a in enumerate(group) for b in group[:i])
            for group in cut.sets
        )


def values_through(
    problem: Problem, network: Network, rows: Ints, step: Multipliers, is_open: Bools | None = None
) -> tuple[float, Floats]:
    """Return the bound on all plans, and that on the plans that hold each node of the network.

    Parameters
    ----------
    network
        Network of the problem restricted to ``rows``.
    is_open
        Which of the rows a plan may be paid for; all by default. Shape ``(len(rows),)``.
    """
    meant = rows if is_open is None else rows[is_open]
    constant, paid = _at_multipliers(problem, meant, step)
    worth = np.zeros(len(rows))
    worth[slice(None) if is_open is None else is_open] = paid
    total, through = heaviest_through(network, worth[network.row])
    return constant + total, constant + through


def is_below(value: Floats | float, amount: float) -> Bools:
    """Return whether a bound is below an amount by more than its sum's rounding errors."""
    return np.asarray(value) < amount - ROUNDING * max(1.0, abs(amount))


def _at_multipliers(problem: Problem, rows: Ints, step: Multipliers) -> tuple[float, Floats]:
    """Return the constant of the bound, and what each opportunity is worth at the multipliers."""
    table = problem.opportunities
    is_collect = table.kind == COLLECT
    worth = problem.worth.copy()
    worth[is_collect] -= step.of_targets[table.site[is_collect]]
    constant = 0.0
    for cut, multiplier in zip(step.cuts, step.of_cuts, strict=True):
        members, weights = cut.weights()
        worth[members] -= multiplier * weights
        constant += multiplier * cut.limit
    offered = table.site[rows][table.kind[rows] == COLLECT]
    constant += float(step.of_targets[np.unique(offered)].sum())
    return constant, np.maximum(worth, 0.0)[rows]
