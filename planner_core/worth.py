r"""What images earn; no other module defines it.

A target earns :math:`W_i(S)` from the images :math:`S` that a plan takes of it. Today every target
is of the kind *once*: it earns the best worth of its images, :math:`W_i(S) = \max_{o \in S} v_o`,
so a better second image adds the difference. The worth :math:`v_o` of a collect is the reward of
the target when the collect starts, times the quality of the image, the probability that the sky is
clear, and the share that the objective lets it earn (``share_earned``). If delivery counts, that
share depends on the whole plan: solvers and bounds use the most that it can be, the referee the
actual one.

Bounds assign a multiplier :math:`\lambda_i \ge 0` to each target. A path is then paid
:math:`w_o = \max(0, v_o - \lambda_i)` for a collect, and the target keeps its *surplus*
:math:`\max_S W_i(S) - \sum_{o \in S} w_o`, which is :math:`\lambda_i` up to the best worth of its
collects. For any multipliers no plan earns more than the sum of all surpluses and of each
satellite's heaviest path. Another kind of target would have another :math:`W_i` with its own
weights and surplus, which the functions here would have to provide.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from planner_core.domain import Forecast, Objective, Quality, SkySeries

Floats = npt.NDArray[np.float64]
_Indices = npt.NDArray[np.integer]

_MOST_WHOLE: Final = 2.0**50  # from here on amounts are not counted in whole units


def quality_of(
    quality: Quality, off_nadir_deg: npt.NDArray[Any], sun_elevation_deg: npt.NDArray[Any]
) -> Floats:
    """Return the quality, from 0 to 1, of images taken at these angles.

    >>> curves = Quality(off_nadir_deg=((0.0, 1.0), (40.0, 0.6)))
    >>> quality_of(curves, np.array([10.0, 50.0]), np.zeros(2))
    array([0.9, 0.6])
    """
    product = np.ones(len(off_nadir_deg))
    for knots, angle_deg in (
        (quality.off_nadir_deg, off_nadir_deg),
        (quality.sun_elevation_deg, sun_elevation_deg),
    ):
        if knots:
            product *= np.interp(angle_deg.astype(np.float64), *np.transpose(knots))
    return product


def clear_probability_of(
    forecast: Forecast | None, target: _Indices, at_s: Floats, num_targets: int
) -> Floats:
    """Return the probability of a clear sky over targets; 1 without a forecast.

    Parameters
    ----------
    target, at_s
        Target and instant of each image. Shape ``(n,)``.
    """
    if forecast is None:
        return np.ones(len(target))
    default = forecast.default_clear_probability
    clear = np.full(len(target), np.nan if default is None else default)
    series = np.full(num_targets, -1)
    own_row = np.zeros(num_targets, dtype=np.int64)
    for number, one in enumerate(forecast.series):
        series[one.target] = number
        own_row[one.target] = np.arange(len(one.target))
    # Vendors' files may have as many series as targets: evaluate each for its own images only.
    order = np.argsort(series[target], kind="stable")
    cuts = np.searchsorted(series[target][order], np.arange(len(forecast.series) + 1))
    for one, first, last in zip(forecast.series, cuts[:-1], cuts[1:], strict=True):
        rows = order[first:last]
        rows = rows[(at_s[rows] >= one.time_s[0]) & (at_s[rows] <= one.time_s[-1])]
        clear[rows] = _between(one, own_row[target[rows]], at_s[rows])
    return clear


def _between(series: SkySeries, row: _Indices, at_s: Floats) -> Floats:
    """Return the values in rows of a series at instants that it covers."""
    time_s, values = series.time_s, series.clear_probability
    if len(time_s) == 1:
        return values[row, np.zeros(len(row), dtype=np.int64)]
    left = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, len(time_s) - 2)
    share = (at_s - time_s[left]) / (time_s[left + 1] - time_s[left])
    return (1.0 - share) * values[row, left] + share * values[row, left + 1]


def urgency_of(waited_s: Floats, half_life_s: Floats) -> Floats:
    """Return what is left of rewards after some time; infinite half-lives leave them whole.

    >>> urgency_of(np.array([0.0, 3600.0, 3600.0]), np.array([3600.0, 3600.0, np.inf]))
    array([1. , 0.5, 1. ])
    """
    left: Floats = np.exp2(-waited_s / half_life_s)
    return left


def worth_of_collects(
    target_reward: Floats, target: _Indices, urgency: Floats, quality: Floats, clear: Floats
) -> Floats:
    """Return what each collect earns alone: its target's reward times all reducing factors."""
    return target_reward[target] * urgency * quality * clear


def share_earned(objective: Objective, age_s: Floats) -> Floats:
    """Return the share of its worth that an image earns if it is on the ground at this age.

    Parameters
    ----------
    age_s
        From the end of the collect to its last bit on the ground; infinite for never.

    >>> share_earned(Objective(collected_share=0.5, half_life_s=3600.0), np.array([3600.0, np.inf]))
    array([0.75, 0.5 ])
    """
    return objective.collected_share + delivery_share(objective, age_s)


def delivery_share(objective: Objective, age_s: Floats) -> Floats:
    """Return the share of its worth that an image earns for its delivery at this age.

    >>> delivery_share(Objective(collected_share=0.5), np.array([3600.0, np.inf]))
    array([0.5, 0. ])
    """
    half_life_s = objective.half_life_s
    if half_life_s is None:
        left = np.isfinite(age_s).astype(np.float64)
    else:
        left = np.exp2(-age_s / half_life_s)
    return (1.0 - objective.collected_share) * left


def best_worths(target: _Indices, worth: Floats, num_targets: int) -> Floats:
    """Return the most that one of these images of each target earns; 0 if there is none.

    Parameters
    ----------
    target, worth
        Target and worth of each image. Shape ``(n,)``.

    Returns
    -------
    Shape ``(num_targets,)``.
    """
    best = np.zeros(num_targets)
    np.maximum.at(best, target, worth)
    return best


def worth_of(target: _Indices, worth: Floats) -> float:
    """Return what a set of images earns: the best image of each target counts.

    The sum is rounded once, so it does not depend on the order of the images.
    """
    if len(target) == 0:
        return 0.0
    return math.fsum(best_worths(target, worth, int(target.max()) + 1))


def gain(worth: float, others: Floats) -> float:
    """Return what an image adds to what others of the same target earn."""
    return max(0.0, worth - float(others.max(initial=0.0)))


def weights(worth: Floats, multiplier: Floats) -> Floats:
    """Return what paths are paid for images, given the multiplier of each image's target."""
    return np.maximum(worth - multiplier, 0.0)


def surplus(multiplier: Floats, best_worth: Floats) -> Floats:
    """Return what targets keep at these multipliers, if paths are paid ``weights``."""
    return np.clip(multiplier, 0.0, best_worth)


def common_unit(worth: Floats) -> float:
    """Return an amount of which any reward from these images is a multiple; 0 for none.

    Whole rewards without quality have one; bounds are rounded down to its multiples.

    >>> common_unit(np.array([4.0, 0.0, 6.0])), common_unit(np.array([0.5, 1.0]))
    (2.0, 0.0)
    """
    worth = worth[worth > 0.0]
    if len(worth) == 0:
        return 1.0
    if worth.max() >= _MOST_WHOLE or np.any(worth != np.round(worth)):
        return 0.0
    return float(np.gcd.reduce(worth.astype(np.int64)))
