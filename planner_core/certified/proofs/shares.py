"""What images that stay on board earn, in the programme of one satellite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner_core.certified.dp.data_levels import DataLevels
from planner_core.certified.dp.resource_network import Network, image_size
from planner_core.certified.signs import FROM_START
from planner_core.certified.sizes import MAX_UNITS
from planner_core.certified.tolerances import ON_BOARD, ROUNDING
from planner_core.certified.tuning import TUNING
from planner_core.precedence.relation import is_transitive_on
from planner_core.problem import (
    Bools,
    Floats,
    Ints,
    Problem,
    SatelliteProblem,
)
from planner_core.problem.delivery import lost_on_board
from planner_core.problem.slew import TIME_TOLERANCE_S


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shares:
    r"""What images lose by staying on board, as a multiplier of the data left at the end.

    At the multipliers of the targets an image is worth :math:`w_k - l_k` if it stays, :math:`w_k`
    if it comes down. What a recorder holds was recorded last. For any instant :math:`T` there are
    two cases. Either something recorded before it stays, and so do all images after it: a plan
    gains no more than with :math:`w_k - l_k` for those. Or nothing does, and images that ended
    later make up what the recorder holds at the end, apart from the telemetry since :math:`T`:
    :math:`\sum_{stay} s_k \ge g`. For any :math:`\mu \ge 0` such a plan gains at most :math:`\sum_k
    w_k` by the images before and :math:`\sum_k \max(w_k, w_k - l_k + \mu s_k) - \mu g` by those
    after :math:`T`.

    Attributes
    ----------
    lost, size
        :math:`l_k`, and the image's data in recorder capacities, both 0 for contacts. Shape
        ``(m,)``.
    per_data
        :math:`\mu`.
    held
        What the recorder holds at the start.
    typical
        Median worth of an image on the ground.
    telemetry_per_s
        In recorder capacities.
    since_s, telemetry_since_s
        Instants that may separate the two cases, ascending, and the instants since which telemetry
        may have been recorded after them. Shape ``(k,)``.
    start_s, end_s
        Of each task, when it is recorded. Shape ``(m,)``.
    """

    lost: Floats
    size: Floats
    is_kept: Bools
    per_data: float
    held: float
    typical: float
    telemetry_per_s: float
    since_s: Floats
    telemetry_since_s: Floats
    start_s: Floats
    end_s: Floats

    @classmethod
    def of(cls, problem: Problem, satellite: SatelliteProblem, network: Network) -> Shares | None:
        """Return the shares; None if they do not matter or a task may be a detour for others."""
        if network.left_cost == 0.0 or not is_transitive_on(satellite):
            return None
        rows = satellite.rows
        size = image_size(satellite)
        lost = lost_on_board(problem)[rows]
        counts = (lost > 0.0) & (size > 0.0)
        starts = np.unique(satellite.start_s)
        since_s = starts[
            np.unique(
                np.linspace(0, len(starts) - 1, TUNING.several * TUNING.fine + 1).astype(np.int64)
            )
        ]
        is_booked = problem.dynamics == "paper"
        # An event books the telemetry since the event before it.
        events_s = np.concatenate([[0.0], satellite.event_s])
        before_s = events_s[np.searchsorted(satellite.event_s, since_s)]
        return cls(
            lost=lost,
            size=size,
            is_kept=network.is_kept,
            per_data=network.left_cost,
            held=network.data_start,
            typical=float(np.median(problem.worth_on_ground[rows][counts])),
            telemetry_per_s=satellite.resources.telemetry_per_s,
            since_s=since_s,
            telemetry_since_s=before_s if is_booked else since_s,
            start_s=satellite.start_s,
            end_s=satellite.start_s if is_booked else satellite.end_s,
        )

    def latest(self, gained_before: Callable[[int], int], goal: int) -> tuple[int, int]:
        """Return the last instant at which the first case gains no more than a goal, and its gain.

        Parameters
        ----------
        gained_before
            What the first case gains with each instant; the later the instant, the more.
        """
        low, high, gained = FROM_START, len(self.since_s), 0
        while high - low > 1:
            middle = (low + high) // 2
            trial = gained_before(middle)
            if trial <= goal:
                low, gained = middle, trial
            else:
                high = middle
        return low, gained

    def finer(self, unit: float) -> int:
        """Return into how many parts to divide a unit if that takes little time."""
        return int(np.ceil(TUNING.fine * unit / self.typical))

    def weights_before(self, weight: Ints, unit: float, since: int, finer: int) -> Ints:
        """Return what images count in the first case, in units that are ``finer`` times smaller."""
        stays = self.start_s >= self.since_s[since] + TIME_TOLERANCE_S
        worth = np.where(stays, np.maximum(weight * unit - self.lost, 0.0), weight * unit)
        return np.ceil(worth * (finer / unit) - ROUNDING).astype(np.int32)

    def weights(self, weight: Ints, unit: float, since: int) -> Ints:
        """Return the most that images of this worth count in the second case, in units.

        With ``FROM_START`` as the instant this holds for all plans.
        """
        worth = weight.astype(np.float64) * unit
        # Negative weights are what contacts pay for antennas.
        most = np.where(weight < 0, worth, self.worth_at_most(worth, since))
        return np.ceil(most / unit - ROUNDING).astype(np.int32)

    def worth_at_most(self, worth: Floats, since: int) -> Floats:
        """Return the same without units."""
        stays = np.maximum(worth - self.lost, 0.0) + self.per_data * self.size
        if since != FROM_START:
            may_stay = self.end_s > self.since_s[since] - TIME_TOLERANCE_S
            stays = np.where(may_stay, stays, 0.0)
        # A plan that gains nothing by an image can do without it.
        return np.where((worth > 0.0) | self.is_kept, np.maximum(worth, stays), 0.0)

    def end_cost(self, levels: DataLevels, unit: float, since: int) -> Ints:
        """Return the cost of ending with the recorder at each level, in units."""
        cost = np.floor(self.cost_at_end(levels, since) / unit)
        return np.minimum(cost, MAX_UNITS).astype(np.int32)

    def cost_at_end(self, levels: DataLevels, since: int) -> Floats:
        """Return the same without units."""
        without = -self.held
        if since != FROM_START:
            without = self.telemetry_per_s * (self.telemetry_since_s[since] - TIME_TOLERANCE_S)
        return self.per_data * np.maximum(levels.least + without - ON_BOARD, 0.0)
