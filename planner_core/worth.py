r"""What images earn: the one place that says so.

A target earns :math:`W_i(S)` from the images :math:`S` that a plan takes of it. Today every target
is of the kind *once*: it earns the best worth of its images, :math:`W_i(S) = \max_{o \in S} v_o`,
and a second image adds what it is better by. Each collect has its own :math:`v_o`, the reward of
the target times the quality of the image, and of that the part that the objective lets it earn
(``share_earned``). Which part that is hangs on the whole plan where delivery counts: solvers and
bounds go by the most that it can be, the referee by what it is.

Bounds price targets. At a multiplier :math:`\lambda_i \ge 0` a path is paid
:math:`w_o = \max(0, v_o - \lambda_i)` for a collect, and the target keeps its *surplus*
:math:`\max_S W_i(S) - \sum_{o \in S} w_o`, which is :math:`\lambda_i` up to the best worth of its
collects. For any multipliers no plan earns more than all surpluses and, for each satellite, its
heaviest path. Another kind of target is another :math:`W_i` with its own weights and surplus: the
functions here are what it would have to answer.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from planner_core.domain import Objective, Quality

Floats = npt.NDArray[np.float64]
_Indices = npt.NDArray[np.integer]

_MOST_WHOLE: Final = 2.0**50  # from here on amounts are not counted in whole units


def quality_of(
    quality: Quality, off_nadir_deg: npt.NDArray[Any], sun_elevation_deg: npt.NDArray[Any]
) -> Floats:
    """Return how good images are that are taken at these angles, from 0 to 1.

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


def worth_of_collects(target_reward: Floats, target: _Indices, quality: Floats) -> Floats:
    """Return what each collect earns alone: the reward of its target times its quality."""
    return target_reward[target] * quality


def share_earned(objective: Objective, age_s: Floats) -> Floats:
    """Return which part of its worth an image earns that is on the ground at this age.

    Parameters
    ----------
    age_s
        From the end of the collect to its last bit on the ground; infinite for never.

    >>> share_earned(Objective(collected_share=0.5, half_life_s=3600.0), np.array([3600.0, np.inf]))
    array([0.75, 0.5 ])
    """
    a, half_life_s = objective.collected_share, objective.half_life_s
    if half_life_s is None:
        left = np.isfinite(age_s).astype(np.float64)
    else:
        left = np.exp2(-age_s / half_life_s)
    return a + (1.0 - a) * left


def best_worths(target: _Indices, worth: Floats, num_targets: int) -> Floats:
    """Return the most that one of these images of each target earns; 0 where there is none.

    Parameters
    ----------
    target, worth
        Of each image. Shape ``(n,)``.

    Returns
    -------
    Shape ``(num_targets,)``.
    """
    best = np.zeros(num_targets)
    np.maximum.at(best, target, worth)
    return best


def worth_of(target: _Indices, worth: Floats) -> float:
    """Return what a set of images earns: each target the best of its own.

    The sum is rounded once, so it does not hang on the order of the images.
    """
    if len(target) == 0:
        return 0.0
    return math.fsum(best_worths(target, worth, int(target.max()) + 1))


def gain(worth: float, others: Floats) -> float:
    """Return what an image adds to others of the same target."""
    return max(0.0, worth - float(others.max(initial=0.0)))


def weights(worth: Floats, multiplier: Floats) -> Floats:
    """Return what paths are paid for images, at the multiplier of each one's target."""
    return np.maximum(worth - multiplier, 0.0)


def surplus(multiplier: Floats, best_worth: Floats) -> Floats:
    """Return what targets keep at these multipliers, if paths are paid ``weights``."""
    return np.clip(multiplier, 0.0, best_worth)


def common_unit(worth: Floats) -> float:
    """Return an amount of which whatever these images earn is a multiple; 0 for none.

    Whole rewards without quality have one, and bounds are rounded down to it.

    >>> common_unit(np.array([4.0, 0.0, 6.0])), common_unit(np.array([0.5, 1.0]))
    (2.0, 0.0)
    """
    worth = worth[worth > 0.0]
    if len(worth) == 0:
        return 1.0
    if worth.max() >= _MOST_WHOLE or np.any(worth != np.round(worth)):
        return 0.0
    return float(np.gcd.reduce(worth.astype(np.int64)))
