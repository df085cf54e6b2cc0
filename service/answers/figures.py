"""Totals of images: how many are on the ground, how old they are there, what is left on board."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.referee.timeline import Collected, SatelliteTimeline, Timeline
from service.wire.timelines import AgesOut, ImageFiguresOut, SatelliteTotalsOut

_QUANTILES = (0.5, 0.9, 1.0)


def ages_of(images: Iterable[Collected]) -> AgesOut | None:
    """Return how old images are when they are on the ground; None where none is."""
    age_s = np.array([image.age_s for image in images if image.age_s is not None])
    if len(age_s) == 0:
        return None
    median_s, p90_s, max_s = np.quantile(age_s, _QUANTILES)
    return AgesOut(
        mean=_seconds(age_s.mean()),
        median=_seconds(median_s),
        p90=_seconds(p90_s),
        max=_seconds(max_s),
    )


def num_delivered(problem: Problem, images: Iterable[Collected]) -> int | None:
    """Return how many images are on the ground; None where there are no contacts."""
    return sum(image.is_downlinked for image in images) if problem.use_resources else None


def in_mbit(scenario: Scenario, problem: Problem, shares: Sequence[float]) -> float | None:
    """Return how much data it is in all; None where a recorder has no capacity in megabits.

    Parameters
    ----------
    shares
        By satellite of the scenario, in recorder capacities.
    """
    capacities = [satellite.resources.recorder_capacity_mbit for satellite in scenario.satellites]
    if not problem.use_resources or None in capacities:
        return None
    pairs = zip(shares, capacities, strict=True)
    return sum(share * (capacity or 0.0) for share, capacity in pairs)


def satellite_totals(
    scenario: Scenario, problem: Problem, timeline: Timeline, index: int, own: ImageFiguresOut
) -> SatelliteTotalsOut:
    """Return what one satellite has a part in; ``own`` is what there is to say of its images."""
    line: SatelliteTimeline = timeline.satellites[index]
    images = [image for image in timeline.collected.values() if image.satellite == index]
    capacity_mbit = scenario.satellites[index].resources.recorder_capacity_mbit
    on_board = timeline.on_board[index]
    is_known = problem.use_resources and capacity_mbit is not None
    return SatelliteTotalsOut(
        reward=math.fsum(
            (
                *(action.reward for action in line.actions),
                *(one.earned for one in timeline.brought_down if one.satellite == index),
            )
        ),
        collects=sum(action.mode == "collect" for action in line.actions),
        contacts=sum(action.mode == "contact" for action in line.actions),
        delivered=num_delivered(problem, images),
        age_s=ages_of(images),
        on_board_mbit_end=round(on_board * (capacity_mbit or 0.0), 6) if is_known else None,
        **own.model_dump(),
    )


def _seconds(value: float) -> float:
    return round(float(value), 3)
