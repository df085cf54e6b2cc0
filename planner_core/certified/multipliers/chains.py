"""Chains of tasks with free starts, as an oracle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from planner_core.certified.multipliers.ascent import Ascent, Steps
from planner_core.certified.proofs.continuous import ContinuousDual, num_followers, width_for
from planner_core.problem import Bytes, Floats, Ints, Problem

_ROUGH_S: Final = 10.0
_ROUGH: Final = Steps(first=0.15, last=0.02, num_epochs=50, asked_every=51)
_FINE: Final = Steps(first=0.08, last=0.0046, num_epochs=70, asked_every=14)
_MOST_FOLLOWERS: Final = 30_000_000  # of 12 bytes each; with more there is no search
_BEGIN: Final = 0.9  # of what targets are worth


class Chains:
    """The heaviest chain of each part of a day, at given multipliers."""

    def __init__(self, dual: ContinuousDual) -> None:
        self._dual = dual
        self.parts: Ints = np.arange(len(dual.parts), dtype=np.int32)
        self._taken = [np.empty(0, dtype=np.int32) for _ in dual.parts]

    def answer(self, parts: Ints, multipliers: Floats, count: Ints) -> None:
        """Give some parts new chains."""
        for number in parts.tolist():
            _, taken = self._dual.chain(number, multipliers[:-1], is_exact=False)
            np.subtract.at(count, self._taken[number], 1)
            np.add.at(count, taken, 1)
            self._taken[number] = taken

    def gain(self, multipliers: Floats) -> float:
        """Return what no chains of all parts exceed."""
        value, _ = self._dual.at(multipliers[:-1])
        return value - float(multipliers.sum())


def ascend_on_chains(problem: Problem, stop: Bytes) -> Iterator[tuple[float, Floats]]:
    """Yield after each epoch the best bound so far, and the multipliers that prove it."""
    width_s = width_for(problem)
    if num_followers(problem, width_s) > _MOST_FOLLOWERS:
        return
    begin = _BEGIN * problem.best_worth
    for cell_s, steps in ((max(_ROUGH_S, width_s), _ROUGH), (width_s, _FINE)):
        dual = None if stop[0] else ContinuousDual.of(problem, cell_s, stop)
        if dual is None:
            return
        most = np.where(dual.is_offered, problem.best_worth, 0.0)
        ascent = Ascent(Chains(dual), most, begin, steps, 0)
        while not ascent.is_settled and not stop[0]:
            ascent.improve(1, stop)
            yield ascent.value, ascent.multipliers
        begin = ascent.mean
        del dual, ascent
