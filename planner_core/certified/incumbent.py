"""The best plan so far, the lowest bound, and how far apart they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.budget import Budget, Progress
from planner_core.certified.proofs.bound import (
    Bound,
    accessible,
    is_optimal,
    reward_unit,
    rounded_bound,
)
from planner_core.certified.sizes import MAX_VERDICTS
from planner_core.certified.tolerances import SAME
from planner_core.problem import CONTACT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.solvers.base import Solution


class Incumbent:
    """The plan and the bound of one search.

    Parameters
    ----------
    gap
        The share of the bound within which a plan is close enough.
    plan, bound
        The initial ones; by default only what must be taken, and what all targets are worth.
    covers_starts
        Whether bounds also hold for plans with continuous starts, if the problem has such starts.
    verdict
        The referee's verdict on the plan with all that must be taken; by default it is computed.

    Attributes
    ----------
    plan, is_valid, reward
        The best plan, and the referee's verdict on it.
    bound
        The lowest proven bound.
    unit
        An amount of which every plan's reward is a multiple; 0 if there is none.
    """

    def __init__(
        self,
        problem: Problem,
        budget: Budget,
        gap: float,
        plan: Plan | None = None,
        bound: Bound | None = None,
        *,
        covers_starts: bool = False,
        verdict: Timeline | None = None,
    ) -> None:
        self.problem, self.budget, self.gap = problem, budget, gap
        self.unit = reward_unit(problem)
        self._verdicts: dict[Plan, Timeline] = {}
        whole = (plan or Plan()).with_kept(problem)
        if verdict is not None:
            self._verdicts[whole] = verdict
        self.plan, timeline = self._in_its_best_form(whole)
        self.is_valid, self.reward = timeline.is_valid, timeline.reward
        self.bound = bound or accessible(problem)
        self._lowest = self.bound.value
        self._is_proof = covers_starts or not problem.continuous_starts

    @property
    def is_optimal(self) -> bool:
        """Whether no plan is better, to the stated tolerance."""
        return self.is_within(0.0)

    @property
    def is_close(self) -> bool:
        """Whether plan and bound are within the requested gap."""
        return self.is_within(self.gap)

    @property
    def is_done(self) -> bool:
        """Whether plan and bound are close enough, or the budget is spent."""
        return self.is_close or self.budget.is_spent()

    @property
    def distance(self) -> float:
        """How far apart plan and bound are, before bounds are rounded to what plans can earn."""
        return self._lowest - self.reward

    @property
    def better(self) -> float:
        """The least reward of a plan that counts as better than the best one.

        Refuting it must suffice for "optimal", so it lies well within the tolerance.
        """
        return self.reward + max(self.unit, 0.5 * SAME * self.reward, 1e-9)

    def is_within(self, gap: float, reward: float = 0.0) -> bool:
        """Return whether the plan, or one worth ``reward``, is within this gap of the bound."""
        reward, bound = max(self.reward, reward), self.bound.value
        return is_optimal(reward, bound, self.unit) or reward >= (1.0 - gap) * bound

    def offer(self, plan: Plan) -> bool:
        """Take over a plan if it is better; return whether it is.

        What must be taken is added to it. A valid plan is better than any invalid one.
        """
        plan, timeline = self._in_its_best_form(plan.with_kept(self.problem))
        if (timeline.is_valid, timeline.reward) <= (self.is_valid, self.reward):
            return False
        self.plan, self.is_valid, self.reward = plan, timeline.is_valid, timeline.reward
        return True

    def judge(self, plan: Plan) -> Timeline:
        """Return the referee's verdict on a plan, without its curves.

        Searches find the same plans again and again: the latest verdicts are remembered.
        """
        timeline = self._verdicts.pop(plan, None) or replay(self.problem, plan, in_detail=False)
        self._verdicts[plan] = timeline
        if len(self._verdicts) > MAX_VERDICTS:
            del self._verdicts[next(iter(self._verdicts))]
        return timeline

    def _in_its_best_form(self, plan: Plan) -> tuple[Plan, Timeline]:
        """Return a plan without images that take space and earn nothing, and its verdict."""
        problem, timeline = self.problem, self.judge(plan)
        if not problem.counts_delivery or not timeline.is_valid:
            return plan, timeline
        earning = {image.position for image in timeline.collected.values() if image.worth > 0.0}
        kind, kept = problem.opportunities.kind, set(problem.kept_rows.tolist())
        actions = tuple(
            action
            for position, action in enumerate(plan.actions)
            if kind[action.opportunity] == CONTACT
            or position in earning
            or action.opportunity in kept
        )
        if len(actions) == len(plan.actions):
            return plan, timeline
        freed = Plan(actions)
        judged = self.judge(freed)
        # A slow satellite may need an image that earns nothing on its way.
        is_better = judged.is_valid and judged.reward >= timeline.reward
        return (freed, judged) if is_better else (plan, timeline)

    def lower(self, bound: Bound) -> bool:
        """Take over a bound if it is lower than the known one; return whether it is."""
        self._lowest = min(self._lowest, bound.value)
        value = rounded_bound(self.problem, bound.value, self.reward)
        if value >= self.bound.value:
            return False
        self.bound = replace(bound, value=value)
        return True

    def report(self, message: str, reward: float = 0.0) -> None:
        """Report how far apart plan and bound are; ``reward`` is of a plan not yet offered."""
        reward = max(self.reward, reward)
        bound = max(self.bound.value, reward)
        is_known = np.isfinite(bound)
        self.budget.report(
            Progress(
                phase="solve",
                fraction=reward / bound if is_known and bound > 0.0 else float(is_known),
                reward=reward,
                bound=bound if is_known else None,
                message=message,
            )
        )

    def solution(self, bound: Bound | None = None) -> Solution:
        """Return the plan, why the search ended, and the proven bound.

        Parameters
        ----------
        bound
            The same bound with its whole proof, if that is put together only at the end.
        """
        if not self._is_proof:
            # Another start may suit the next task better: no bound here covers that.
            ended = self.budget.ending(is_optimal=False, is_close=False)
            return Solution(plan=self.plan, termination=ended)
        proven = bound or self.bound
        termination = self.budget.ending(
            is_optimal=self.is_valid and self.is_optimal, is_close=self.is_valid and self.is_close
        )
        return Solution(
            plan=self.plan,
            termination=termination,
            proven=proven if np.isfinite(proven.value) else None,
        )
