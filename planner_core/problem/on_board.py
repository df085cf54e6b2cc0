"""Images that recorders hold when the horizon begins, and the most that they can still earn.

What they earned when they were taken is past. Only their delivery still earns: ``(1 - a)`` of their
worth, less the later they come down. No search or dual function counts this. It is added to what
new images earn: in plans as the referee finds it, in the bound as the most that contacts allow.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.problem.columns import COLLECT, CONTACT, Bools, Floats
from planner_core.problem.delivery import fastest_downlink_per_s
from planner_core.problem.problem import ImageOnBoard, Problem, SatelliteProblem
from planner_core.worth import delivery_share

_ROUNDING_S: Final = 1e-5  # as of new images (``delivery.least_age_s``)
_ROUNDING: Final = 2e-9  # share of a recorder that the referee forgives


def with_on_board(problem: Problem, images: tuple[ImageOnBoard, ...]) -> Problem:
    """Return the problem with images on board; new images of their targets earn nothing."""
    if not images:
        return problem
    problem = replace(problem, on_board=images)
    is_done, full = imaged_before(problem), problem.full_worth
    return replace(
        problem,
        worth=np.where(is_done, 0.0, problem.worth),
        full_worth=None if full is None else np.where(is_done, 0.0, full),
    )


def imaged_before(problem: Problem) -> Bools:
    """Return which rows collect a target imaged before the horizon. Shape ``(n,)``."""
    table = problem.opportunities
    targets = [image.target for image in problem.on_board]
    return np.asarray((table.kind == COLLECT) & np.isin(table.site, targets))


def without_on_board(problem: Problem) -> Problem:
    """Return the problem without images on board, so that only new images earn anything."""
    return replace(problem, on_board=()) if problem.on_board else problem


def most_on_board(problem: Problem) -> float:
    """Return the most that images on board can still earn, whatever is planned."""
    best: dict[int, float] = {}
    for index, satellite in enumerate(problem.satellites):
        own = [image for image in problem.on_board if image.satellite == index]
        if all(image.worth == 0.0 for image in own) or not problem.counts_delivery:
            continue
        amounts = np.array([image.amount for image in own])
        down_s = _earliest_down_s(problem, satellite, np.cumsum(amounts))
        age_s = down_s - _ROUNDING_S - np.array([image.collected_s for image in own])
        share = delivery_share(problem.objective, age_s)
        for image, earned in zip(own, share.tolist(), strict=True):
            if image.amount > 0.0:
                most = max(best.get(image.target, 0.0), earned * image.worth)
                best[image.target] = most
    return float(sum(best.values()))


def _earliest_down_s(problem: Problem, satellite: SatelliteProblem, queued: Floats) -> Floats:
    """Return lower bounds on when these amounts can be down; infinite for never.

    All passes are taken. Each delivers the volume of its largest contact, all of it at the earliest
    end of its contacts' setup; only the last piece takes time, at the highest rate of any contact.
    """
    contacts = np.flatnonzero(satellite.kind == CONTACT)
    if len(contacts) == 0:
        return np.full(len(queued), np.inf)
    setup_s = problem.downlinks.stations.setup_s[satellite.site[contacts]]
    access = problem.opportunities.access[satellite.rows[contacts]]
    _, passes = np.unique(access, return_inverse=True)
    ready_s = np.full(passes.max() + 1, np.inf)
    volume = np.zeros(len(ready_s))
    np.minimum.at(ready_s, passes, satellite.start_s[contacts] + setup_s)
    np.maximum.at(volume, passes, satellite.volume[contacts])
    order = np.argsort(ready_s, kind="stable")
    ready_s, volume = ready_s[order], volume[order]
    taken = np.cumsum(volume)
    at = np.searchsorted(taken, queued - _ROUNDING)
    is_down = at < len(taken)
    at = np.minimum(at, len(taken) - 1)
    missing = np.maximum(queued - _ROUNDING - np.append(0.0, taken)[at], 0.0)
    fastest_per_s = fastest_downlink_per_s(problem, satellite, contacts)
    takes_s = missing / max(fastest_per_s, 1e-12)
    # The next pass may be ready by then and deliver the rest.
    down_s = np.minimum(ready_s[at] + takes_s, np.append(ready_s, np.inf)[at + 1])
    return np.where(is_down, down_s, np.inf)
