"""What a plan's own search has found out, put to use for the plans that follow it.

Multipliers prove a bound for whatever problem they are put into. Those of the plan before are
nearly the best where little has happened, and to ask what they prove takes a fraction of a search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from planner_core.certified.dp.elementary import elementary_value
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_value
from planner_core.certified.proofs.resource_bound import value_at
from planner_core.problem import Problem

_LEFT: Final = 0.5  # of a typical reward; with it all, 1 to 4 images above the optimum
_NO_MULTIPLIERS: Final = np.empty(0)


@dataclass(frozen=True, kw_only=True, eq=False)
class KnownMultipliers:
    """The bound of the plan before, with multipliers, and the targets that they are of."""

    bound: Bound
    target_ids: tuple[str, ...]

    def on(self, problem: Problem) -> Bound | None:
        """Return the multipliers for another problem's targets; None where there are none to ask.

        An image of a target that is new earns beyond its multiplier a part of what a typical one
        earns: at less a path would take one that is dear at every pass, and at its full worth it
        would pay for an image that a typical one gives way to. Under battery and recorder one that
        is worth no more than that has the multiplier of half of those before: with 100 of them at
        half their worth four satellites were bound by 1,173, without a multiplier by 1,123, which
        is what the search for a proof says. Seven days of replans let such bounds drift from 3 to
        50 % above.
        """
        multipliers = self.bound.multipliers
        is_plain = self.bound.contact_multipliers is None and problem.pointing is None
        if multipliers is None or not is_plain or len(multipliers) != len(self.target_ids):
            return None
        before = dict(zip(self.target_ids, multipliers.tolist(), strict=True))
        new = np.maximum(0.0, problem.best_worth - _LEFT * problem.typical_worth)
        if problem.use_resources and len(multipliers):
            # Where energy is short most targets have no multiplier, and those that come in neither.
            is_usual = problem.best_worth <= problem.typical_worth
            new[is_usual] = np.minimum(new, np.median(multipliers))[is_usual]
        known = [before.get(name, new[i]) for i, name in enumerate(problem.target_ids)]
        unit = self.bound.unit
        is_coarse = unit is not None and unit > _LEFT * problem.typical_worth
        if unit is not None and is_coarse and len(problem.target_ids) > len(self.target_ids):
            # What is left of a new target is then whole units too. Once: replan after replan with
            # half the unit of the one before would ask for ever more labels.
            unit *= _LEFT
        multipliers = np.minimum(known, problem.best_worth)
        return replace(self.bound, multipliers=multipliers, unit=unit, certificate=None)


def bound_at(problem: Problem, known: Bound, reward: float) -> Bound:
    """Return what the multipliers of another problem prove here.

    Parameters
    ----------
    reward
        What a known plan earns: nothing below it needs proof.
    """
    multipliers = _NO_MULTIPLIERS if known.multipliers is None else known.multipliers
    if known.unit is not None and problem.use_resources:
        value = value_at(problem, multipliers, known.unit, reward)
    elif known.is_elementary:
        value, _ = elementary_value(problem, multipliers)
    else:
        value, _ = lagrangian_value(problem, multipliers)
    return Bound(
        value=rounded_bound(problem, value, reward),
        proof="dp" if known.unit is not None and problem.use_resources else "lagrangian",
        multipliers=multipliers,
        unit=known.unit if problem.use_resources else None,
        is_elementary=known.is_elementary,
    )


def multipliers_of(bound: Bound | None, target_ids: Sequence[str]) -> KnownMultipliers | None:
    """Return a bound's multipliers as what is known; None where it has none."""
    if bound is None or bound.multipliers is None:
        return None
    return KnownMultipliers(bound=bound, target_ids=tuple(target_ids))
