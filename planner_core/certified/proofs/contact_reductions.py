"""What multipliers of contacts say of plans worth more than some level: which contacts may follow.

From a forward and a backward pass with multipliers (``LatencyRelaxation.most_by_pairs``) each pair
of contacts that directly follow each other has a bound. Pairs below the level are in no such plan.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.certified.dp.queue_tables import Fixing
from planner_core.certified.proofs.latency import LatencyMultipliers, latency_relaxations
from planner_core.problem import Bools, Bytes, Floats, Ints, Problem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reduction:
    """What plans worth more than some level have in common, of one satellite.

    Attributes
    ----------
    earliest
        In the order of its contacts, the earliest contact that may come directly before each; the
        last entry is the earliest that may be a path's last. -1 stands for the start. Shape
        ``(num_contacts + 1,)``.
    fixing
        What leaves out states of the programme over queues.
    """

    earliest: Ints
    fixing: Fixing


def reductions(
    problem: Problem,
    multipliers: Floats,
    contact_multipliers: Floats,
    level: float,
    per_collect: int,
    exact: Bools,
    stop: Bytes,
) -> dict[int, Reduction]:
    """Return what multipliers say of plans worth more than ``level``, by satellite.

    Empty once ``stop`` is set; without satellites whose contacts share layers.

    Parameters
    ----------
    per_collect
        How many levels of energy a collect takes, here and in the programme that this is for.
    exact
        Opportunities whose energy both do not round. Shape ``(n,)``.
    """
    given = LatencyMultipliers.of(problem, multipliers, contact_multipliers, None)
    most: dict[int, tuple[Floats, Fixing]] = {}
    total = given.paid
    indices = [index for index, one in enumerate(problem.satellites) if len(one)]
    relaxations = latency_relaxations(problem, per_collect=per_collect, exact=exact)
    for index, one in zip(indices, relaxations, strict=True):
        if stop[0]:
            return {}
        pairs = one.most_by_pairs(given.targets, given.tolls_of(one))
        if pairs is None:
            total += one.most(given.targets, given.tolls_of(one))[0]
        else:
            most[index] = pairs
            total += float(pairs[0].max())
    return {
        index: Reduction(
            earliest=_earliest(total - float(pairs.max()) + pairs > level),
            fixing=fixing._replace(least=level - total + float(pairs.max())),
        )
        for index, (pairs, fixing) in most.items()
    }


def _earliest(may_follow: Bools) -> Ints:
    num_contacts = len(may_follow) - 1
    # Where nothing leads to a contact its layer is empty: it would begin at the contact itself.
    none = np.minimum(np.arange(num_contacts + 1), num_contacts - 1)
    found = np.where(may_follow.any(axis=0), may_follow.argmax(axis=0) - 1, none)
    return found.astype(np.int32)
