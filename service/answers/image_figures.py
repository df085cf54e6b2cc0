"""What there is to say of a plan's images, one of each target: how sharp, how clear, by day."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import fmean, median

import numpy as np
import numpy.typing as npt

from planner_core.problem import COLLECT
from planner_core.run import Judged
from planner_core.valuation import clear_probabilities
from planner_core.worth import quality_of
from service.wire.timelines import ImageFiguresOut, SpreadOut

_DIGITS = 9


class ImageFigures:
    """Quality and sky of each opportunity, and what they come to over the images of a plan.

    Parameters
    ----------
    own_off_nadir_deg
        At the middle of collects that do not start where their opportunity does, by position in
        the plan.

    Attributes
    ----------
    quality, clear
        By row of the problem's table. Contacts have 1. ``clear`` is None without a forecast:
        nothing is known then.
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
        """Return the figures of one satellite's images, or of all."""
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
