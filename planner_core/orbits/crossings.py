"""Geometric limits as smooth functions of time, and the instants at which they change sign.

Every limit compares the angle between two moving vectors with a bound, so all have the form

    g(t) = sign * cos(angle between x(t) and y(t)) - threshold,    inside where g >= 0.

``limit_value`` picks x and y; the rest of the search knows only g and its rate.
Vectors come from a *track* (``Ephemeris.track``): cubics of the satellite's position, its
local vertical and the sun, all Earth-fixed.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from planner_core.jit import inlined, inner, kernel
from planner_core.orbits.frames import EARTH_RADIUS_M

Floats = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Limit = tuple[int, float, float]
"""Which angle (one of the codes below), sign, threshold."""
Value = tuple[float, float]
"""g and its rate per second."""

OFF_NADIR: Final = 0
ELEVATION: Final = 1
SUN_ELEVATION: Final = 2
LOCAL_TIME: Final = 3
OWN_LOCAL_TIME: Final = 4
LOOK_SIDE: Final = 5
HEADING: Final = 6
SUNLIT: Final = 7
SUN_EXCLUSION: Final = 8

_POSITION: Final = 0
_VERTICAL: Final = 3
_SUN: Final = 6
_PRECISION_S: Final = 1e-7
_NO_TURN: Final = -1.0


@inner
def _at(cubic: Floats, column: int, t: float) -> Vector:
    i, j, k = column, column + 1, column + 2
    return (
        cubic[0, i] + t * (cubic[1, i] + t * (cubic[2, i] + t * cubic[3, i])),
        cubic[0, j] + t * (cubic[1, j] + t * (cubic[2, j] + t * cubic[3, j])),
        cubic[0, k] + t * (cubic[1, k] + t * (cubic[2, k] + t * cubic[3, k])),
    )


@inner
def _rate(cubic: Floats, column: int, t: float) -> Vector:
    i, j, k = column, column + 1, column + 2
    return (
        cubic[1, i] + t * (2.0 * cubic[2, i] + t * 3.0 * cubic[3, i]),
        cubic[1, j] + t * (2.0 * cubic[2, j] + t * 3.0 * cubic[3, j]),
        cubic[1, k] + t * (2.0 * cubic[2, k] + t * 3.0 * cubic[3, k]),
    )


@inner
def _rate_of_rate(cubic: Floats, column: int, t: float) -> Vector:
    i, j, k = column, column + 1, column + 2
    return (
        2.0 * cubic[2, i] + t * 6.0 * cubic[3, i],
        2.0 * cubic[2, j] + t * 6.0 * cubic[3, j],
        2.0 * cubic[2, k] + t * 6.0 * cubic[3, k],
    )


@inner
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def _cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def limit_value(limit: Limit, cubic: Floats, site: Floats, t: float) -> Value:
    """Return g and its rate at ``t`` seconds after the interval's start.

    Parameters
    ----------
    limit
        Code; +1 for "angle at most" or -1 for "at least"; ``sign * cos(bound)``.
    cubic
        One interval of a track. Shape ``(4, 9)``.
    site
        Position (m) and vertical of the site, and the middle meridians of the two local-time
        limits. Shape ``(4, 3)``.
    """
    code, sign, threshold = limit
    x, dx = (site[1, 0], site[1, 1], site[1, 2]), (0.0, 0.0, 0.0)
    y, dy = _at(cubic, _POSITION, t), _rate(cubic, _POSITION, t)
    if code <= ELEVATION:
        y = (y[0] - site[0, 0], y[1] - site[0, 1], y[2] - site[0, 2])
        if code == OFF_NADIR:
            x, dx = _at(cubic, _VERTICAL, t), _rate(cubic, _VERTICAL, t)
    elif code == SUN_ELEVATION:
        y, dy = _at(cubic, _SUN, t), _rate(cubic, _SUN, t)
    elif code in (LOCAL_TIME, OWN_LOCAL_TIME):
        sun, sun_rate = _at(cubic, _SUN, t), _rate(cubic, _SUN, t)
        row = 2 + code - LOCAL_TIME
        x = (site[row, 0], site[row, 1], site[row, 2])
        y, dy = (sun[0], sun[1], 0.0), (sun_rate[0], sun_rate[1], 0.0)
    elif code == LOOK_SIDE:
        x = (site[0, 0], site[0, 1], site[0, 2])
        y, dy = _cross(y, dy), _cross(y, _rate_of_rate(cubic, _POSITION, t))
    elif code == SUN_EXCLUSION:
        # The sun's direction against the one from site to satellite, the reversed line of sight.
        y = (y[0] - site[0, 0], y[1] - site[0, 1], y[2] - site[0, 2])
        x, dx = _at(cubic, _SUN, t), _rate(cubic, _SUN, t)
    elif code == HEADING:
        x = (0.0, 0.0, 1.0)
        y, dy = dy, _rate_of_rate(cubic, _POSITION, t)
    else:
        x, dx = _at(cubic, _SUN, t), _rate(cubic, _SUN, t)
    xx, yy = _dot(x, x), _dot(y, y)
    scale2 = 1.0 / (xx * yy)
    scale = math.sqrt(scale2)
    cosine = _dot(x, y) * scale
    stretch = (_dot(x, dx) * yy + _dot(y, dy) * xx) * scale2
    rate = (_dot(dx, y) + _dot(x, dy)) * scale - cosine * stretch
    g, g_rate = sign * cosine - threshold, sign * rate
    if code == SUNLIT:
        # Sunlit while the sun is above the Earth's limb as seen from the satellite; the limb's
        # cosine changes with the altitude.
        ratio2 = min(EARTH_RADIUS_M * EARTH_RADIUS_M / yy, 1.0 - 1e-12)
        limb = math.sqrt(1.0 - ratio2)
        g += limb
        g_rate += ratio2 * _dot(y, dy) / yy / limb
    return g, g_rate


@inner
def _root(
    limit: Limit, cubic: Floats, site: Floats, a: float, b: float, g_a: float, g_b: float
) -> float:
    """Return where g changes sign between ``a`` and ``b``, by Newton's method or bisection."""
    t = a + (b - a) * g_a / (g_a - g_b)
    for _ in range(80):
        g, rate = limit_value(limit, cubic, site, t)
        if (g >= 0.0) == (g_a >= 0.0):
            a = t
        else:
            b = t
        step = -g / rate if rate != 0.0 else b - a
        if abs(step) < _PRECISION_S or b - a < _PRECISION_S:
            return min(max(t + step, a), b)
        t += step
        if not a < t < b:
            t = 0.5 * (a + b)
    return t


@inner
def _turn(
    limit: Limit, cubic: Floats, site: Floats, a: float, b: float, at_a: Value, at_b: Value
) -> float:
    """Return an instant near the extremum where g has the other sign, or ``_NO_TURN``.

    At both ends g has the same sign and heads for the other one. The two tangents bound g only
    if it has no inflection in between, which is assumed on a quarter of the interval or less.
    """
    trusted_s = 0.25 * (b - a) + 1e-9
    g_a, rate_a = at_a
    g_b, rate_b = at_b
    while b - a > _PRECISION_S:
        if b - a <= trusted_s:
            meet_s = (g_b - g_a - rate_b * (b - a)) / (rate_a - rate_b)
            if (g_a + rate_a * meet_s >= 0.0) == (g_a >= 0.0):
                return _NO_TURN
        t = 0.5 * (a + b)
        g, rate = limit_value(limit, cubic, site, t)
        if (g >= 0.0) != (g_a >= 0.0):
            return t
        if rate == 0.0:
            return _NO_TURN
        if (rate > 0.0) == (rate_a > 0.0):
            a, g_a, rate_a = t, g, rate
        else:
            b, g_b, rate_b = t, g, rate
    return _NO_TURN


@kernel
def crossings(
    limit: Limit,
    cubic: Floats,
    site: Floats,
    step_s: float,
    at_0: Value,
    at_1: Value,
    out: Floats,
) -> int:
    """Write the instants (0 to ``step_s``) where a limit changes sign; return how many.

    Complete if g has at most one extremum in the interval: a pair of crossings between nodes
    (a grazing pass, a short gap) shows in rates at both ends that head for the other sign.
    """
    inside = at_0[0] >= 0.0
    if inside != (at_1[0] >= 0.0):
        out[0] = _root(limit, cubic, site, 0.0, step_s, at_0[0], at_1[0])
        return 1
    heads_over = at_0[1] < 0.0 < at_1[1] if inside else at_0[1] > 0.0 > at_1[1]
    if not heads_over:
        return 0
    turn = _turn(limit, cubic, site, 0.0, step_s, at_0, at_1)
    if turn == _NO_TURN:
        return 0
    g_turn = limit_value(limit, cubic, site, turn)[0]
    out[0] = _root(limit, cubic, site, 0.0, turn, at_0[0], g_turn)
    out[1] = _root(limit, cubic, site, turn, step_s, g_turn, at_1[0])
    return 2
