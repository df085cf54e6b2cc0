"""Contacts above a station's azimuth-elevation mask.

The mask has kinks, so its windows are cut from those above its lowest point. Each pass is
sampled every few seconds and at every knot it crosses, so that the mask is linear between
samples, where crossings and near misses are searched for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.sites import Sites, azimuth_elevation_deg

Floats = npt.NDArray[np.float64]
Mask = tuple[tuple[float, float], ...]
Function = Callable[[Floats], Floats]

_SAMPLE_S = 5.0
_GOLDEN = (5.0**0.5 - 1.0) / 2.0


def mask_elevation_deg(mask: Mask, azimuth_deg: Floats) -> Floats:
    """Return the mask's elevation at each azimuth, linear between knots round the compass.

    >>> mask_elevation_deg(((0.0, 10.0), (180.0, 20.0)), np.array([90.0, 270.0, 360.0]))
    array([15., 15., 10.])
    """
    azimuth, elevation = np.array(mask, dtype=np.float64).T
    return np.asarray(np.interp(azimuth_deg, azimuth, elevation, period=360.0))


def windows_above_mask(ephemeris: Ephemeris, station: Sites, mask: Mask, windows: Floats) -> Floats:
    """Return the parts of a station's windows that lie above its mask.

    Parameters
    ----------
    station
        One site.
    windows
        Start and end in seconds. Shape ``(n, 2)``.

    Returns
    -------
    Start and end. Shape ``(m, 2)``.
    """

    def azimuth(t_s: Floats) -> Floats:
        return azimuth_elevation_deg(ephemeris, _repeat(station, t_s), t_s)[0]

    def above(t_s: Floats) -> Floats:
        azimuth_deg, elevation_deg = azimuth_elevation_deg(ephemeris, _repeat(station, t_s), t_s)
        return elevation_deg - mask_elevation_deg(mask, azimuth_deg)

    knots = np.array([knot[0] for knot in mask])
    parts = [
        _positive_parts(above, _samples(azimuth, knots, float(start), float(end)))
        for start, end in windows
    ]
    return np.concatenate([np.empty((0, 2)), *parts])


def _repeat(station: Sites, t_s: Floats) -> Sites:
    return station.at(np.zeros(len(t_s), dtype=np.int32))


def _samples(azimuth: Function, knots_deg: Floats, start_s: float, end_s: float) -> Floats:
    t = np.linspace(start_s, end_s, max(3, int((end_s - start_s) / _SAMPLE_S) + 2))
    turned = np.unwrap(azimuth(t), period=360.0)
    lap = np.floor((turned[:, None] - knots_deg[None, :]) / 360.0)
    i, knot = np.nonzero(np.diff(lap, axis=0))

    def past(at: Floats) -> Floats:
        return (azimuth(at) - knots_deg[knot] + 180.0) % 360.0 - 180.0

    return np.unique(np.concatenate([t, _bisect(past, t[i], t[i + 1])]))


def _positive_parts(value: Function, t: Floats) -> Floats:
    g = value(t)
    middle = np.abs(g[1:-1])
    near = np.flatnonzero((middle <= np.abs(g[:-2])) & (middle <= np.abs(g[2:]))) + 1
    t = np.unique(np.concatenate([t, [_extremum(value, t, g, int(i)) for i in near]]))
    g = value(t)
    inside = g >= 0.0
    change = np.flatnonzero(inside[:-1] != inside[1:])
    edges = _bisect(value, t[change], t[change + 1])
    if inside[0]:
        edges = np.concatenate([t[:1], edges])
    if inside[-1]:
        edges = np.concatenate([edges, t[-1:]])
    return edges.reshape(-1, 2)


def _extremum(value: Function, t: Floats, g: Floats, i: int) -> float:
    """Return where ``value`` comes closest to the other sign around sample ``i``."""
    sign = 1.0 if g[i] < 0.0 else -1.0
    a, b = float(t[i - 1]), float(t[i + 1])
    while b - a > 1e-4:
        c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        at_c, at_d = sign * value(np.array([c, d]))
        a, b = (a, d) if at_c > at_d else (c, b)
    return 0.5 * (a + b)


def _bisect(value: Function, a: Floats, b: Floats) -> Floats:
    inside = value(a) >= 0.0
    for _ in range(40):
        middle = 0.5 * (a + b)
        same = (value(middle) >= 0.0) == inside
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    return 0.5 * (a + b)
