"""The relaxation of the whole program, solved at most once in a search."""

from __future__ import annotations

import numpy as np

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.whole_relaxation import WholeRelaxation, whole_relaxation
from planner_core.certified.proofs.whole_program import charges_for_data_left
from planner_core.certified.sizes import MAX_PAIRS
from planner_core.certified.strategies.supports import fits_a_program, has_half_life, is_shared
from planner_core.certified.tuning import TUNING
from planner_core.precedence.relation import num_near_pairs
from planner_core.problem import Bools


class Relaxed:
    """What the relaxation of the whole program proves, and the tasks that it takes in part."""

    def __init__(self, best: Incumbent, seed: int) -> None:
        self._best, self._seed = best, seed
        self._relaxation: WholeRelaxation | None = None

    @property
    def is_known(self) -> bool:
        """Whether the relaxation has been solved."""
        return self._relaxation is not None

    def solve(self) -> None:
        """Bound plans by the relaxation, unless it is too large or exact programmes prove more.

        One satellite's lose by rounding each image to whole units if images of a target differ in
        worth. All have too few levels of energy and data if images on board lose a part of their
        worth, and make few steps on multipliers of antennas.
        """
        best, problem = self._best, self._best.problem
        is_loose = (
            charges_for_data_left(problem)
            or (problem.has_better_images and not is_shared(problem))
            or has_half_life(problem)
        )
        most = TUNING.most_relaxed if is_shared(problem) else TUNING.most_columns
        is_small = len(problem.opportunities) <= most
        # Each pair of near tasks has a column then, and many starts make many pairs: with it four
        # satellites over 200 targets, starts 30 s apart, have a bound of 213.8 after 15 CPU
        # seconds. Exact programmes, which then come before it, have one of 194.0 by then.
        is_slow = problem.offers_starts and problem.turns_to_the_sun
        is_meant = is_loose and is_small and not is_slow
        if self.is_known or not is_meant or num_near_pairs(problem) > MAX_PAIRS:
            return
        self._relaxation = whole_relaxation(problem, best.budget, self._seed)
        best.lower(self._relaxation.bound)
        best.report("relaxation")

    def proves_more_than(self, value: float) -> bool:
        """Return whether the relaxation, if it is known, proves a noticeably lower bound."""
        known = np.inf if self._relaxation is None else self._relaxation.bound.value
        return known < (1.0 - TUNING.trifle) * value

    def worth_offering(self) -> Bools | None:
        """Return the tasks to offer a program with contacts fixed; None if not known yet.

        All of them, or those of the plan and the ones of least reduced cost in the relaxation.
        Shape ``(n,)``.
        """
        problem = self._best.problem
        if fits_a_program(problem):
            return np.ones(len(problem.opportunities), dtype=np.bool_)
        if self._relaxation is None:
            return None
        offered = np.zeros(len(problem.opportunities), dtype=np.bool_)
        offered[self._relaxation.order[: TUNING.large]] = True
        offered[[action.opportunity for action in self._best.plan.actions]] = True
        return offered
