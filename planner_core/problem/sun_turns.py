"""Turns from the line of sight of a task to the sun, and back.

Panels charge when they face the sun. Their normal is fixed to the body at ``panel_angle_deg`` from
the boresight, and the rotation about the boresight is free: the boresight then lies anywhere on a
cone about the sun, and the smallest turn to it is the difference of two angles. At 180 deg the
cone is a line and the turn is exact; at other angles a visit may arrive at one point of the cone
and leave from another, and the turn between the two is not counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.domain import Agility, Resources
from planner_core.jit import kernel
from planner_core.problem.moving import moving_turn_s, rotation_deg
from planner_core.problem.slew import INSTANT, Vector, angle_between_deg, slew_s

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SunPath:
    """Where the sun stands during the horizon, in the inertial (TEME) frame.

    Attributes
    ----------
    step_s
        From one direction to the next, an hour or so: the sun moves by 1 deg a day.
    directions
        Unit vectors, at least two, from the start of the horizon on. Shape ``(n, 3)``.
    """

    step_s: float
    directions: Floats


class SunTurns(NamedTuple):
    """Seconds to turn from each task's end to the sun, and from there to its start; ``(m,)``."""

    out_s: Floats
    back_s: Floats


def sun_turn_s(
    resources: Resources,
    agility: Agility,
    sun: SunPath | None,
    line_of_sight: Vector,
    t_s: float,
    moving_deg_s: Vector = (0.0, 0.0, 0.0),
) -> float:
    """Return the time to turn between a line of sight and the sun, settling included.

    ``moving_deg_s`` is the line of sight's angular velocity; it counts if ``slew_model`` says so.
    """
    lines = np.array([line_of_sight], dtype=np.float64)
    moving = np.array([moving_deg_s], dtype=np.float64)
    return float(_turns_s(resources, agility, sun, lines, np.array([t_s]), moving)[0])


def angle_to_sun_deg(
    resources: Resources, sun: SunPath | None, line_of_sight: Vector, t_s: float
) -> float:
    """Return the angle by which a satellite turns between a line of sight and the sun."""
    if resources.sun_pointing == "free" or sun is None:
        return 0.0
    hour = np.arange(len(sun.directions)) * sun.step_s
    direction = np.array([np.interp(t_s, hour, axis) for axis in sun.directions.T])
    direction /= np.linalg.norm(direction)
    return abs(float(angle_between_deg(direction, line_of_sight)) - resources.panel_angle_deg)


def sun_turns(
    resources: Resources,
    agility: Agility,
    sun: SunPath | None,
    *,
    start_s: Floats,
    end_s: Floats,
    looks: Floats,
    looked: Floats,
    moves: Floats,
    moved: Floats,
) -> SunTurns:
    """Return the turns of many tasks.

    Parameters
    ----------
    start_s, end_s
        Of the tasks. Shape ``(m,)``.
    looks, looked
        Lines of sight at these instants. Shape ``(m, 3)``.
    moves, moved
        Their angular velocities, in deg/s; they count if ``slew_model`` says so. Shape ``(m, 3)``.
    """
    return SunTurns(
        out_s=_turns_s(resources, agility, sun, looked, end_s, moved),
        # Reversed in time it is the same turn, with the opposite rate.
        back_s=_turns_s(resources, agility, sun, looks, start_s, -moves),
    )


def _turns_s(
    resources: Resources,
    agility: Agility,
    sun: SunPath | None,
    looks: Floats,
    t_s: Floats,
    moving: Floats,
) -> Floats:
    """Return the times of the turns between lines of sight, each at its instant, and the sun.

    Raises
    ------
    ValueError
        The problem does not know where the sun is.
    """
    if resources.sun_pointing == "free":
        return np.zeros(len(t_s))
    if sun is None:
        raise ValueError("turns to the sun need to know where it is")
    acceleration = agility.acceleration_deg_s2 or INSTANT
    turns_s = _least_turns_s(
        float(sun.step_s), sun.directions, looks, np.asarray(t_s, dtype=np.float64),
        moving if agility.tracks else moving[:0],
        float(resources.panel_angle_deg), float(agility.slew_rate_deg_s), float(acceleration),
    )  # fmt: skip
    return turns_s + agility.settle_s


@kernel
def _least_turns_s(
    step_s: float,
    directions: Floats,
    looks: Floats,
    t_s: Floats,
    moving: Floats,
    panel_angle_deg: float,
    rate_deg_s: float,
    acceleration_deg_s2: float,
) -> Floats:
    turns_s = np.empty(len(t_s))
    for i in range(len(t_s)):
        k = min(max(int(t_s[i] / step_s), 0), len(directions) - 2)
        u = t_s[i] / step_s - k
        # Between two directions it is shorter than 1, which does not affect the angle.
        x = (1.0 - u) * directions[k, 0] + u * directions[k + 1, 0]
        y = (1.0 - u) * directions[k, 1] + u * directions[k + 1, 1]
        z = (1.0 - u) * directions[k, 2] + u * directions[k + 1, 2]
        look = looks[i, 0], looks[i, 1], looks[i, 2]
        between_deg = angle_between_deg((x, y, z), look)
        angle_deg = abs(between_deg - panel_angle_deg)
        if len(moving) == 0:
            turns_s[i] = slew_s(angle_deg, rate_deg_s, acceleration_deg_s2)
            continue
        # About the axis of the boresight's turn to the sun, but only as far as the panels need.
        whole = rotation_deg(look, (x, y, z))
        share = (between_deg - panel_angle_deg) / max(between_deg, 1e-9)
        turns_s[i] = moving_turn_s(
            (share * whole[0], share * whole[1], share * whole[2]),
            (moving[i, 0], moving[i, 1], moving[i, 2]),
            (0.0, 0.0, 0.0),
            rate_deg_s,
            acceleration_deg_s2,
        )
    return turns_s
