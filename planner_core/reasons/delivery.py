"""Reasons if the time of delivery counts: what a change of the plan really earns.

A further image delays all that its satellite records after it, and may keep some of it on board.
So the referee replays that satellite's changed plan, for as many targets as about a second allows.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final, NamedTuple

from planner_core.problem import Problem
from planner_core.problem.plan import Action, Plan
from planner_core.reasons.reason import Reason
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline

_MOST_ACTIONS: Final = 10_000
"""The most actions replayed for the reasons of one plan, at 0.13 ms each: just over a second."""
_NOTHING: Final = 1e-9
_SETTLED: Final = frozenset({"solver_limit", "displaced_by"})
_UNSURE: Final = "Its effect on the downlink of images was not computed."


def weighed_by_delivery(
    problem: Problem, plan: Plan, timeline: Timeline, reasons: Mapping[int, Reason]
) -> dict[int, Reason]:
    """Return the reasons with what plans with these targets earn according to the referee.

    Parameters
    ----------
    reasons
        By target, worked out as if each image earned the most that it can.
    """
    trials = _Trials(problem, plan, timeline)
    num_left = _MOST_ACTIONS
    if problem.pointing is not None:
        num_left = 0  # the reasons are about other starts than those of the problem's rows
    told = dict(reasons)
    weighed = [target for target, reason in reasons.items() if _is_weighed(reason)]
    for target in sorted(weighed, key=lambda target: _promise(reasons[target]), reverse=True):
        reason = reasons[target]
        if num_left > 0:
            trial = trials.with_image(int(reason.opportunity or 0), reason.blocking)
            told[target] = _weighed(problem, trial, target, reason)
            num_left -= len(trial.actions)
        else:
            detail = f"{reason.detail} {_UNSURE}"
            told[target] = replace(reason, certainty="heuristic", detail=detail)
    return told


def _is_weighed(reason: Reason) -> bool:
    is_settled = reason.code in _SETTLED or reason.reward_delta is not None
    return is_settled and reason.opportunity is not None


def _promise(reason: Reason) -> float:
    """Return the most that the plan could gain, by its reason; the largest gain is tried first."""
    return math.inf if reason.reward_delta is None else reason.reward_delta


class _Trial(NamedTuple):
    """Actions with one more image, and what they earn without it."""

    actions: tuple[Action, ...]
    reward_before: float


class _Trials:
    """The actions to replay with one more image: only those of its satellite, if that is enough.

    It is not enough if the plan breaks limits or images a target twice: another satellite's image
    may then count in place of one that is dropped.
    """

    def __init__(self, problem: Problem, plan: Plan, timeline: Timeline):
        self._problem, self._plan, self._whole = problem, plan, timeline
        self._satellite_of = problem.opportunities.satellite
        self._is_apart = not timeline.violations
        self._rewards: dict[int, float] = {}

    def with_image(self, opportunity: int, blocking: Collection[int]) -> _Trial:
        """Return the actions with an image in place of those at the ``blocking`` positions."""
        satellite = int(self._satellite_of[opportunity])
        left = [
            action.opportunity
            for position, action in enumerate(self._plan.actions)
            if position not in blocking and self._concerns(action, satellite)
        ]
        actions = Plan.of(self._problem, [*left, opportunity]).actions
        return _Trial(actions, self._reward_before(satellite))

    def _concerns(self, action: Action, satellite: int) -> bool:
        return not self._is_apart or self._satellite_of[action.opportunity] == satellite

    def _reward_before(self, satellite: int) -> float:
        if not self._is_apart:
            return self._whole.reward
        if satellite not in self._rewards:
            own = [a for a in self._plan.actions if self._concerns(a, satellite)]
            self._rewards[satellite] = replay(
                self._problem, Plan(tuple(own)), in_detail=False
            ).reward
        return self._rewards[satellite]


def _weighed(problem: Problem, trial: _Trial, target: int, reason: Reason) -> Reason:
    changed = replay(problem, Plan(trial.actions), in_detail=False)
    if not changed.is_valid:
        detail = f"{reason.detail} {_UNSURE}"
        return replace(reason, certainty="heuristic", detail=detail)
    delta = changed.reward - trial.reward_before
    image = changed.collected.get(target)
    is_down = image is not None and image.is_downlinked
    if delta > _NOTHING:
        said = f"The plan would earn {delta:+.3g} with it" + (
            f" in place of {len(reason.blocking)} of its actions." if reason.blocking else "."
        )
        return replace(
            reason, code="solver_limit", certainty="verified", reward_delta=delta, detail=said
        )
    if not is_down and reason.code in _SETTLED:
        said = "It could be taken, but would not be downlinked by the end of the horizon."
        return replace(reason, code="not_delivered", reward_delta=delta, detail=said)
    if not reason.blocking:
        said = "It could be taken, but others would be downlinked later or not at all."
        return replace(reason, code="not_delivered", reward_delta=delta, detail=said)
    said = (
        f"It fits in place of {len(reason.blocking)} of the plan's actions; the reward changes "
        f"by {delta:+.3g}."
    )
    if reason.code in _SETTLED:
        return replace(reason, code="displaced_by", reward_delta=delta, detail=said)
    said = f"With it, the {reason.code} would reach its limit. {said}"
    return replace(reason, reward_delta=delta, detail=said)
