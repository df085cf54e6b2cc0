"""The time to turn from one line of sight to another."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from planner_core.jit import inlined, inner, kernel

Floats = npt.NDArray[np.float64]
Vector = Floats | tuple[float, float, float]

TIME_TOLERANCE_S = 1e-6
"""Instants are whole milliseconds held in floats: differences below this are rounding."""

INSTANT = 0.0
"""Acceleration value that means "no limit" inside kernels."""


@inlined
def angle_between_deg(u: Vector, v: Vector) -> float:
    """Return the angle between two unit vectors; exact for small and for straight angles."""
    cx = u[1] * v[2] - u[2] * v[1]
    cy = u[2] * v[0] - u[0] * v[2]
    cz = u[0] * v[1] - u[1] * v[0]
    dot = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    return math.degrees(math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), dot))


@kernel
def slew_s(angle_deg: float, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    r"""Return the time to turn through an angle, from rest to rest.

    Parameters
    ----------
    angle_deg
        Angle to turn through, in [0, 180].
    rate_deg_s
        Rate limit, positive.
    acceleration_deg_s2
        Limit of acceleration and braking; ``INSTANT`` (0) for none.

    Notes
    -----
    With rate limit :math:`w` and acceleration :math:`a`, a turn through :math:`\theta` takes
    :math:`2\sqrt{\theta/a}` up to :math:`\theta = w^2/a` and :math:`\theta/w + w/a` beyond.
    Without a limit it is the constant-rate model of the paper, :math:`\theta/w`.

    Examples
    --------
    >>> slew_s(30.0, 1.0, INSTANT), slew_s(30.0, 1.0, 0.5), round(slew_s(1.0, 1.0, 0.5), 6)
    (30.0, 32.0, 2.828427)
    """
    if acceleration_deg_s2 <= 0.0:
        return angle_deg / rate_deg_s
    if angle_deg <= rate_deg_s * rate_deg_s / acceleration_deg_s2:
        return 2.0 * math.sqrt(angle_deg / acceleration_deg_s2)
    return angle_deg / rate_deg_s + rate_deg_s / acceleration_deg_s2


@inner
def reach_deg(room_s: float, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """Return the largest angle, up to 180 degrees, that a satellite turns through in ``room_s``.

    >>> reach_deg(32.0, 1.0, 0.5), round(reach_deg(2.828427, 1.0, 0.5), 6)
    (30.0, 1.0)
    """
    if acceleration_deg_s2 <= 0.0:
        angle_deg = rate_deg_s * room_s
    elif room_s <= 2.0 * rate_deg_s / acceleration_deg_s2:
        angle_deg = acceleration_deg_s2 * room_s * room_s / 4.0
    else:
        angle_deg = rate_deg_s * (room_s - rate_deg_s / acceleration_deg_s2)
    return min(angle_deg, 180.0)
