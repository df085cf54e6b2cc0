"""Multipliers found in a plan's search, reused for the plans that follow it.

Any multipliers give a bound for any problem. Those of the previous plan are nearly the best ones if
little has happened, and computing their bound takes a fraction of a search.
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

_LEFT: Final = 0.5  # of a typical reward; with all of it, bounds were 1 to 4 images too high
_NO_MULTIPLIERS: Final = np.empty(0)


@dataclass(frozen=True, kw_only=True, eq=False)
class KnownMultipliers:
    """The bound of the previous plan with its multipliers, and the targets that these are for."""

    bound: Bound
    target_ids: tuple[str, ...]

    def on(self, problem: Problem) -> Bound | None:
        """Return the multipliers for another problem's targets; None if they do not apply.

        An image of a new target earns half a typical image's worth beyond its multiplier. With a
        smaller multiplier, paths would take a valuable image at every pass; with its full worth,
        the bound would count it all, though it takes the place of a typical image. With resources,
        a new target worth no more than a typical one gets at most the median of the multipliers:
        with 100 such targets at half their worth the bound for four satellites was 1,173, without
        multipliers for them 1,123, as in the search for a proof. Over seven days of replans such
        bounds drifted from 3 to 50 % above.
        """
        multipliers = self.bound.multipliers
        is_plain = self.bound.contact_multipliers is None and problem.pointing is None
        if multipliers is None or not is_plain or len(multipliers) != len(self.target_ids):
            return None
        before = dict(zip(self.target_ids, multipliers.tolist(), strict=True))
        new = np.maximum(0.0, problem.best_worth - _LEFT * problem.typical_worth)
        if problem.use_resources and len(multipliers):
            # If energy is short, most multipliers are 0, and so are those of typical new targets.
            is_usual = problem.best_worth <= problem.typical_worth
            new[is_usual] = np.minimum(new, np.median(multipliers))[is_usual]
        known = [before.get(name, new[i]) for i, name in enumerate(problem.target_ids)]
        unit = self.bound.unit
        is_coarse = unit is not None and unit > _LEFT * problem.typical_worth
        if unit is not None and is_coarse and len(problem.target_ids) > len(self.target_ids):
            # Then what a new target earns beyond its multiplier is whole units too. A unit that is
            # fine already stays: halving it at each replan would need ever more labels.
            unit *= _LEFT
        multipliers = np.minimum(known, problem.best_worth)
        return replace(self.bound, multipliers=multipliers, unit=unit, certificate=None)


def bound_at(problem: Problem, known: Bound, reward: float) -> Bound:
    """Return the bound that known multipliers give for this problem.

    Parameters
    ----------
    reward
        What a known plan earns; bounds below it need no proof.
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
    """Return a bound with its multipliers as ``KnownMultipliers``; None if it has none."""
    if bound is None or bound.multipliers is None:
        return None
    return KnownMultipliers(bound=bound, target_ids=tuple(target_ids))
