"""Chains of tasks with continuous starts, as an oracle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner_core.certified.multipliers.ascent import Ascent, Latest, OneByOne, Steps
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.continuous import (
    ContinuousDual,
    num_followers,
    rough_cell_s,
    width_for,
)
from planner_core.certified.sizes import MAX_FOLLOWERS
from planner_core.certified.tuning import TUNING
from planner_core.problem import Bytes, Floats, Ints, Problem


class Chains(OneByOne):
    """The heaviest chain of each piece of a satellite's day, at given multipliers."""

    def __init__(self, dual: ContinuousDual) -> None:
        self._dual = dual
        self.parts: Ints = np.arange(len(dual.parts), dtype=np.int32)
        self._latest = Latest(len(dual.parts))

    def answer(self, part: int, multipliers: Floats, count: Ints) -> None:
        """Find a part's new chain, and update the count of the latest ones."""
        _, taken = self._dual.chain(part, multipliers[:-1], is_exact=False)
        self._latest.replace(part, taken, count)

    def gain(self, multipliers: Floats) -> float:
        """Return an upper bound on the worth of all parts' chains together."""
        value, _ = self._dual.at(multipliers[:-1])
        return value - float(multipliers.sum())


def ascend_on_chains(problem: Problem, stop: Bytes) -> Iterator[Bound | None]:
    """Yield a stage's best bound, or None after an epoch that proves none."""
    width_s = width_for(problem)
    if num_followers(problem, width_s) > MAX_FOLLOWERS:
        return
    begin = TUNING.begin_of_chains * problem.best_worth
    wide = Steps(
        first=TUNING.first_step_of_paths,
        last=TUNING.last_step_of_few,
        num_epochs=TUNING.many_epochs,
        asked_every=TUNING.rounds,
    )
    narrow = replace(
        wide,
        first=TUNING.first_step / 2.0,
        num_epochs=TUNING.epochs // TUNING.several,
        asked_every=TUNING.epochs_at_a_time,
    )
    # An epoch with narrow cells takes as long as four with wide ones, which prove less.
    stages = [(rough_cell_s(), wide), (width_s, narrow)]
    if width_s >= rough_cell_s():
        stages = [(width_s, wide)]
    for cell_s, steps in stages:
        dual = None if stop[0] else ContinuousDual.of(problem, cell_s, stop)
        if dual is None:
            return
        most = np.where(dual.is_offered, problem.best_worth, 0.0)
        ascent = Ascent(Chains(dual), most, begin, steps, 0)
        if steps is narrow:
            ascent.ask()
            yield _bound(ascent, cell_s)
        for epoch in range(1, steps.num_epochs + 1):
            ascent.improve(1, stop)
            if stop[0]:
                return
            yield None if epoch % steps.asked_every else _bound(ascent, cell_s)
        begin = ascent.mean
        del dual, ascent


def _bound(ascent: Ascent, cell_s: float) -> Bound:
    return Bound(
        value=ascent.value, proof="lagrangian", multipliers=ascent.multipliers, cell_s=cell_s
    )
