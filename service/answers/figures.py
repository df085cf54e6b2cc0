"""Figures of a plan's images.

How many are on the ground and how old they were on arrival, how much data is left on board; and for
one image of each target its sharpness, its chance of clear sky, and whether it is by day.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean, median

import numpy as np
import numpy.typing as npt

from planner_core.domain import Scenario
from planner_core.problem import COLLECT, Problem
from planner_core.referee.timeline import Collected, SatelliteTimeline, Timeline
from planner_core.run import Judged
from planner_core.valuation import clear_probabilities
from planner_core.worth import quality_of
from service.wire.timelines import AgesOut, ImageFiguresOut, SatelliteTotalsOut, SpreadOut

_DIGITS = 9


def ages_of(images: Iterable[Collected]) -> AgesOut | None:
    """Return the ages of images at delivery; None if no image is delivered."""
    age_s = np.array([image.age_s for image in images if image.age_s is not None])
    if len(age_s) == 0:
        return None
    told_s = (age_s.mean(), *np.quantile(age_s, (0.5, 0.9, 1.0)))
    mean_s, median_s, p90_s, max_s = (round(float(one_s), 3) for one_s in told_s)
    return AgesOut(mean=mean_s, median=median_s, p90=p90_s, max=max_s)


def num_delivered(problem: Problem, images: Iterable[Collected]) -> int | None:
    """Return how many images are on the ground; None if there are no contacts."""
    return sum(image.is_downlinked for image in images) if problem.use_resources else None


def in_mbit(scenario: Scenario, problem: Problem, shares: Sequence[float]) -> float | None:
    """Return the total amount of data; None if a recorder has no capacity in megabits.

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
    """Return the totals of one satellite; ``own`` are the figures of its images."""
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


class ImageFigures:
    """Quality and clear-sky probability of each opportunity, and their totals over a plan's images.

    Parameters
    ----------
    own_off_nadir_deg
        At the middle of collects that do not start where their opportunity does, by position in
        the plan.

    Attributes
    ----------
    quality, clear
        By row of the problem's table; 1 for contacts. ``clear`` is None without a forecast,
        since nothing is known then.
    """

    def __init__(self, judged: Judged, own_off_nadir_deg: Mapping[int | None, float]):
        table = judged.problem.opportunities
        self._judged = judged
        self._own_off_nadir_deg = own_off_nadir_deg
        self.quality = quality_of(
            judged.scenario.quality, table.off_nadir_deg, table.sun_elevation_deg
        )
        self.clear: npt.NDArray[np.float64] | None = None
        if judged.scenario.forecast is not None:
            collects = np.flatnonzero(table.kind == COLLECT)
            self.clear = np.ones(len(table))
            self.clear[collects] = clear_probabilities(judged.scenario, table, collects)

    def of(self, satellite: int | None = None) -> ImageFiguresOut:
        """Return the figures of the images of one satellite, or of all."""
        images = [
            image.position
            for image in self._judged.timeline.collected.values()
            if satellite is None or image.satellite == satellite
        ]
        actions = self._judged.solution.plan.actions
        rows = [actions[position].opportunity for position in images]
        table = self._judged.problem.opportunities
        off_nadir_deg = [
            self._own_off_nadir_deg.get(position, float(table.off_nadir_deg[row]))
            for position, row in zip(images, rows, strict=True)
        ]
        return ImageFiguresOut(
            images=len(images),
            expected_clear=None
            if self.clear is None
            else round(float(self.clear[rows].sum()), _DIGITS),
            night_images=int(np.count_nonzero(table.sun_elevation_deg[rows] < 0.0)),
            off_nadir_deg=_spread(off_nadir_deg),
            quality_mean=round(float(self.quality[rows].mean()), _DIGITS) if rows else None,
        )


def _spread(values: list[float]) -> SpreadOut | None:
    if not values:
        return None
    return SpreadOut(mean=round(fmean(values), 4), median=round(median(values), 4))
