"""Reasons where it counts when images are on the ground: what a change of the plan really earns.

A further image delays all that is recorded after it, and may keep it on board. So the plan with
it is given to the referee, for as many targets as that takes about a second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.reasons.reason import Reason
from planner_core.referee.replay import Timeline, replay

_MOST_ACTIONS: Final = 60_000  # that the referee replays for the reasons of one plan
_NOTHING: Final = 1e-9
_SETTLED: Final = frozenset({"solver_limit", "displaced_by"})
_UNSURE: Final = "When images come down then was not worked out."


def weighed_by_delivery(
    problem: Problem, plan: Plan, timeline: Timeline, reasons: Mapping[int, Reason]
) -> dict[int, Reason]:
    """Return reasons that say what plans with these targets earn, by the referee.

    Parameters
    ----------
    reasons
        By target, as if each image earned the most that it can.
    """
    num_left = _MOST_ACTIONS // max(1, len(plan.actions))
    if problem.pointing is not None:
        num_left = 0  # the reasons speak of other starts than the problem's rows
    told = {}
    for target, reason in reasons.items():
        is_weighed = reason.code in _SETTLED or reason.reward_delta is not None
        if not is_weighed or reason.opportunity is None:
            told[target] = reason
        elif num_left > 0:
            told[target] = _weighed(problem, plan, timeline, target, reason)
            num_left -= 1
        else:
            detail = f"{reason.detail} {_UNSURE}"
            told[target] = replace(reason, certainty="heuristic", detail=detail)
    return told


def _weighed(
    problem: Problem, plan: Plan, timeline: Timeline, target: int, reason: Reason
) -> Reason:
    left = [a for position, a in enumerate(plan.actions) if position not in reason.blocking]
    rows = [action.opportunity for action in left]
    changed = replay(problem, Plan.of(problem, [*rows, int(reason.opportunity or 0)]))
    if not changed.is_valid:
        detail = f"{reason.detail} {_UNSURE}"
        return replace(reason, certainty="heuristic", detail=detail)
    delta = changed.reward - timeline.reward
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
        said = "It could be taken, but would not come down by the end of the horizon."
        return replace(reason, code="not_delivered", reward_delta=delta, detail=said)
    if not reason.blocking:
        said = "It could be taken, but others would come down later or not at all."
        return replace(reason, code="not_delivered", reward_delta=delta, detail=said)
    said = (
        f"It fits in place of {len(reason.blocking)} of the plan's actions; the reward changes "
        f"by {delta:+.3g}."
    )
    if reason.code in _SETTLED:
        return replace(reason, code="displaced_by", reward_delta=delta, detail=said)
    said = f"With it the {reason.code} would reach its limit. {said}"
    return replace(reason, reward_delta=delta, detail=said)
