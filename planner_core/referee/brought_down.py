"""Images that recorders held at the start: when they are downlinked, and what that earns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.referee.delivery import on_ground_s
from planner_core.referee.resource_profile import Profile
from planner_core.worth import delivery_share


@dataclass(frozen=True, slots=True, kw_only=True)
class BroughtDown:
    """What became of an image that a recorder held at the start.

    Attributes
    ----------
    image
        Its index in ``problem.on_board``.
    delivered_s, age_s
        When its last bit is on the ground, and how long after its collect; None for never.
    earned
        What its delivery earns.
    """

    image: int
    satellite: int
    target: int
    delivered_s: float | None
    age_s: float | None
    earned: float


def brought_down_of(
    problem: Problem,
    plan: Plan,
    by_satellite: Sequence[Sequence[int]],
    profiles: Sequence[Profile | None],
) -> tuple[BroughtDown, ...]:
    """Return what images on board at the start earn; only the best one of each target earns."""
    down = np.full(len(problem.on_board), np.nan)
    for index, profile in enumerate(profiles):
        own = [i for i, image in enumerate(problem.on_board) if image.satellite == index]
        if profile is None or not own:
            continue
        queued = np.cumsum([problem.on_board[i].amount for i in own])
        actions = [plan.actions[p] for p in by_satellite[index]]
        down[own] = on_ground_s(problem, problem.satellites[index], actions, profile, queued)
    found = []
    best: dict[int, int] = {}
    for i, image in enumerate(problem.on_board):
        # An image that was on the ground before the horizon earns nothing more.
        is_down = image.amount > 0.0 and not math.isnan(down[i])
        age_s = float(down[i]) - image.collected_s if is_down else math.inf
        earned = 0.0
        if is_down and problem.counts_delivery:
            earned = image.worth * float(delivery_share(problem.objective, np.array([age_s]))[0])
        found.append(
            BroughtDown(
                image=i,
                satellite=image.satellite,
                target=image.target,
                delivered_s=float(down[i]) if is_down else None,
                age_s=age_s if is_down else None,
                earned=earned,
            )
        )
        first = best.setdefault(image.target, i)
        if earned > found[first].earned:
            best[image.target] = i
    return tuple(
        one if best[one.target] == one.image else replace(one, earned=0.0) for one in found
    )
