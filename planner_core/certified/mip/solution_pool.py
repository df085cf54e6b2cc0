"""Plans from different searches, merged into better ones.

Each search ends in plans that no small change improves. The mixed-integer program over the tasks of
a dozen of them, with the contacts of one, is small, and HiGHS solves it within a second: the merged
plan often has an image or two more than the best.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.certified.proofs.bound import reward_unit
from planner_core.certified.tolerances import SAME
from planner_core.certified.tuning import TUNING
from planner_core.problem import CONTACT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay

Rows = tuple[int, ...]


class PlanPool:
    """Known plans, the best of them, and merging.

    Attributes
    ----------
    plan, reward
        The best valid plan, and what it is worth.
    latest
        The tasks of another search's current plan, valid or not; empty at first.
    """

    def __init__(self, problem: Problem, budget: Budget, seed: int) -> None:
        self._problem, self._budget, self._seed = problem, budget, seed
        self._rng = np.random.default_rng(seed)
        self._gain = reward_unit(problem)
        # Worth of valid plans by their tasks, newest last.
        self._worth: dict[Rows, float] = {}
        self._num_merged = 0
        self.plan, self.reward = Plan(), 0.0
        self.latest: Rows = ()

    @property
    def better(self) -> float:
        """The least that a better plan is worth."""
        return self.reward + max(self._gain, SAME * self.reward)

    def learn(self, ended: Iterable[Plan], latest: Plan) -> None:
        """Note the plans that another search has ended with, and its current one."""
        for plan in ended:
            self.add(plan)
        self.latest = rows_of(latest)
        self._judge(latest)

    def add(self, plan: Plan | None) -> None:
        """Note a plan, if there is one."""
        if plan is not None and (worth := self._judge(plan)) is not None:
            self._worth[rows_of(plan)] = worth

    def merge(self) -> None:
        """Seek a better plan over the tasks of the best and the newest plans.

        Tries the contacts of the best plan, and those of another. Does nothing if no plan has been
        noted since the last call.
        """
        if len(self._worth) == self._num_merged:
            return
        self._num_merged = len(self._worth)
        newest = [*reversed(self._worth)][: TUNING.patience]
        best = sorted(self._worth, key=lambda rows: -self._worth[rows])[: TUNING.patience]
        merged: list[Rows] = []
        taken: set[int] = set()
        for rows in dict.fromkeys([rows_of(self.plan), *best, *newest]):
            if len(taken.union(rows)) > TUNING.most_columns:
                break
            taken.update(rows)
            merged.append(rows)
        if len(merged) < 2:
            return
        offered = np.zeros(len(self._problem.opportunities), dtype=np.bool_)
        offered[list(taken)] = True
        another = merged[self._rng.integers(1, len(merged))]
        for rows in (merged[0], another):
            program = FixedContacts(
                self._problem, offered, self._contacts(rows), self._budget, self._seed
            )
            if program.relaxed() >= self.better:
                self.add(program.plan(self.better, is_rounded=True))

    def _contacts(self, rows: Rows) -> Rows:
        kind = self._problem.opportunities.kind
        return tuple(row for row in rows if kind[row] == CONTACT)

    def _judge(self, plan: Plan) -> float | None:
        """Return what a plan is worth, None if it is not valid; keep it if it is the best."""
        if (known := self._worth.get(rows_of(plan))) is not None:
            return known
        timeline = replay(self._problem, plan, in_detail=False)
        if not timeline.is_valid:
            return None
        if timeline.reward > self.reward:
            self.plan, self.reward = plan, timeline.reward
        return timeline.reward


def rows_of(plan: Plan) -> Rows:
    """Return a plan's opportunities."""
    return tuple(action.opportunity for action in plan.actions)
