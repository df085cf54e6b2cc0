r"""The effect of idle time on a battery, as a few numbers for each task.

Let :math:`N(t) = c\,S(t) - p\,t` be what a satellite gains that is always at the sun, with the
charging rate :math:`c`, the sunlit seconds :math:`S` so far and the idle draw :math:`p`. After task
``i`` the sun is reached at :math:`a_i`, the task's end plus a slew; for task ``j`` it is left at
:math:`d_j`, the task's start minus a slew. In between the battery gains
:math:`c \max(0, S(d_j) - S(a_i))`, and it loses :math:`p` at all times. If :math:`p > 0`, it may be
full, or lowest, in the middle of an idle span; even so, no pair of tasks need be examined:

* at the start of ``j`` it holds :math:`1 + \min_{t \le d_j}(N(d_j) - N(t)) - p\,(s_j - d_j)` at
  most: it was at most full at every instant before, and no satellite gains more than :math:`N`;
* after ``i`` it must exceed its minimum by
  :math:`p\,(a_i - e_i) + \max_{t \ge a_i}(N(a_i) - N(t))`: whatever follows, it has less at each
  such instant than if the satellite stayed at the sun.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner_core.problem import Floats, SatelliteProblem


class IdleEnergy(NamedTuple):
    """Values for each task; shape ``(m,)`` unless said otherwise.

    Attributes
    ----------
    sun_from_s, sun_until_s
        Sunlit seconds at the instant the sun is reached after a task, and left before it.
    full
        The most that the battery can hold at the task's start.
    reserve, least_reserve
        How far above its minimum it must be at the task's end; and a lower bound of that, which
        holds even if a later task reaches the sun sooner.
    reserve_start
        The reserve at the start of the horizon. A number.
    """

    sun_from_s: Floats
    sun_until_s: Floats
    full: Floats
    reserve: Floats
    least_reserve: Floats
    reserve_start: float


def idle_energy(satellite: SatelliteProblem, horizon_s: float) -> IdleEnergy:
    """Return the effect of idle time on a satellite's battery (``dynamics: physical``)."""
    start_s, end_s = satellite.start_s, satellite.end_s
    arrive_s = end_s + satellite.turns.out_s
    depart_s = np.maximum(start_s - satellite.turns.back_s, 0.0)
    sunlit = satellite.sunlight.seconds_until
    drain = satellite.resources.idle_drain_per_s
    none = np.zeros(len(start_s))
    if drain == 0.0:
        return IdleEnergy(sunlit(arrive_s), sunlit(depart_s), none + 1.0, none, none, 0.0)
    gains = _Gains(satellite, horizon_s)
    # A later task may reach the sun sooner if its line of sight needs a shorter slew to it.
    soonest_s = np.minimum.accumulate(arrive_s[::-1])[::-1]
    return IdleEnergy(
        sun_from_s=sunlit(arrive_s),
        sun_until_s=sunlit(depart_s),
        full=1.0 - gains.fall_until(depart_s) - drain * (start_s - depart_s),
        reserve=gains.reserve(end_s, arrive_s),
        least_reserve=gains.reserve(end_s, np.maximum(soonest_s, end_s)),
        reserve_start=float(gains.reserve(np.zeros(1), np.zeros(1))[0]),
    )


class _Gains:
    """N of the module's docstring, with its maximum up to an instant and minimum from one on."""

    def __init__(self, satellite: SatelliteProblem, horizon_s: float) -> None:
        self._charge = satellite.resources.sunpoint_charge_per_s
        self._drain = satellite.resources.idle_drain_per_s
        self._sunlit = satellite.sunlight.seconds_until
        self._horizon_s = horizon_s
        edges_s = np.concatenate([satellite.sunlight.enter_s, satellite.sunlight.exit_s])
        inside = edges_s[(edges_s > 0.0) & (edges_s < horizon_s)]
        self._corner_s = np.unique(np.concatenate([[0.0, horizon_s], inside]))
        corner = self._at(self._corner_s)
        self._highest_until = np.maximum.accumulate(corner)
        self._lowest_from = np.minimum.accumulate(corner[::-1])[::-1]

    def _at(self, t_s: Floats) -> Floats:
        return self._charge * self._sunlit(t_s) - self._drain * t_s

    def fall_until(self, t_s: Floats) -> Floats:
        """Return how far N at each instant is below its maximum until then."""
        gain = self._at(t_s)
        before = np.searchsorted(self._corner_s, t_s, side="right") - 1
        return np.maximum(self._highest_until[before] - gain, 0.0)

    def reserve(self, end_s: Floats, sun_from_s: Floats) -> Floats:
        """Return the most a battery loses after ``end_s`` if at the sun from ``sun_from_s`` on."""
        at_s = np.minimum(sun_from_s, self._horizon_s)
        gain = self._at(at_s)
        after = np.searchsorted(self._corner_s, at_s, side="left")
        after = np.minimum(after, len(self._corner_s) - 1)
        fall = np.maximum(gain - self._lowest_from[after], 0.0)
        return np.maximum(self._drain * (at_s - end_s), 0.0) + fall
