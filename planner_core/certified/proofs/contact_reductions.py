"""Which contacts may follow each other in plans worth more than some level, by multipliers.

A forward and a backward pass at multipliers of contacts (``LatencyRelaxation.most_by_pairs``) bound
each pair of contacts that directly follow each other: pairs not above it are in no such plan.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.certified.dp.queue_tables import Fixing
from planner_core.certified.proofs.latency import LatencyMultipliers, latency_relaxations
from planner_core.problem import Bools, Bytes, Floats, Ints, Problem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reduction:
    """What one satellite's plans worth more than some level have in common.

    Attributes
    ----------
    earliest
        For each of its contacts, in order, the earliest contact that may come directly before it;
        the last entry is the earliest that may be a path's last. -1 stands for the start. Shape
        ``(num_contacts + 1,)``.
    fixing
        Tells which states the programme over queues may leave out.
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
    """Return by satellite what plans worth more than ``level`` have in common.

    Empty once ``stop`` is set. Satellites whose contacts share layers are left out.

    Parameters
    ----------
    per_collect
        How many levels of energy a collect takes, here and in the programme over queues.
    exact
        Opportunities whose energy neither of them rounds. Shape ``(n,)``.
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
    # If nothing may lead to a contact its layer is empty: it would begin at the contact itself.
    none = np.minimum(np.arange(num_contacts + 1), num_contacts - 1)
    found = np.where(may_follow.any(axis=0), may_follow.argmax(axis=0) - 1, none)
    return found.astype(np.int32)
