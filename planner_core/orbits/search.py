"""The search for windows: which intervals can matter, and the sweep over their crossings."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from planner_core.jit import inner, kernel
from planner_core.orbits.crossings import crossings, limit_value

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]

GROUP: Final = 8
"""Intervals that one coarse cap covers."""

_CLOSED: Final = -1.0


@kernel
def find_windows(
    track: Floats,
    step_s: float,
    coarse: Floats,
    fine: Floats,
    sites: Floats,
    codes: Ints,
    signs: Floats,
    thresholds: Floats,
    stop: Bytes,
) -> tuple[Ints, Floats]:
    """Return every window in which all limits hold, site by site, ascending in time.

    Parameters
    ----------
    track, step_s
        Cubics of each interval, ``(num_intervals, 4, 9)``, and the length of an interval.
    coarse, fine
        Caps: unit vector, and cosine of the radius outside which no site can meet the limits,
        for each ``GROUP`` of intervals and for each interval. Shape ``(k, 4)``.
    sites
        Position, vertical and two meridians (see ``limit_value``). Shape ``(n, 4, 3)``.
    codes, signs, thresholds
        The limits: shapes ``(m,)``, ``(m,)`` and ``(n, m)``.
    stop
        One byte; not 0 ends the search early.

    Returns
    -------
    Index of the site ``(k,)``; start and end in seconds ``(k, 2)``.
    """
    own = np.empty((len(track) * (len(codes) + 1) + 1, 2))
    site = np.empty(256, dtype=np.int32)
    windows = np.empty((256, 2))
    found = 0
    for p in range(len(sites)):
        if stop[0]:
            break
        num_own = _windows_of_site(
            track, step_s, coarse, fine, sites[p], codes, signs, thresholds[p], own
        )
        if found + num_own > len(site):
            room = 2 * (found + num_own)
            site = np.concatenate((site, np.empty(room - len(site), dtype=np.int32)))
            windows = np.concatenate((windows, np.empty((room - len(windows), 2))))
        for i in range(num_own):
            site[found] = p
            windows[found, 0], windows[found, 1] = own[i, 0], own[i, 1]
            found += 1
    return site[:found], windows[:found]


@inner
def _windows_of_site(
    track: Floats,
    step_s: float,
    coarse: Floats,
    fine: Floats,
    site: Floats,
    codes: Ints,
    signs: Floats,
    thresholds: Floats,
    out: Floats,
) -> int:
    num_limits = len(codes)
    value = np.empty((num_limits + 1, 2))
    value_node = np.full(num_limits, -1)
    events = np.empty((2 * num_limits, 2))
    x, y, z = site[0]
    radius = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / radius, y / radius, z / radius
    found, open_s, last = 0, _CLOSED, -1
    for group in range(len(coarse)):
        cap = coarse[group]
        if x * cap[0] + y * cap[1] + z * cap[2] < cap[3]:
            continue
        for k in range(group * GROUP, min((group + 1) * GROUP, len(fine))):
            cap = fine[k]
            if x * cap[0] + y * cap[1] + z * cap[2] < cap[3]:
                continue
            if open_s != _CLOSED and last != k - 1:
                out[found, 0], out[found, 1] = open_s, (last + 1) * step_s
                found, open_s = found + 1, _CLOSED
            last = k
            holding, num_events = _events_of_interval(
                k, track[k], step_s, site, codes, signs, thresholds, value, value_node, events
            )
            if holding == num_limits and open_s == _CLOSED:
                open_s = k * step_s
            for e in range(num_events):
                held = holding == num_limits
                holding += 1 if events[e, 1] > 0.0 else -1
                if holding == num_limits:
                    open_s = k * step_s + events[e, 0]
                elif held:
                    out[found, 0], out[found, 1] = open_s, k * step_s + events[e, 0]
                    found, open_s = found + 1, _CLOSED
    if open_s != _CLOSED:
        out[found, 0], out[found, 1] = open_s, (last + 1) * step_s
        found += 1
    return found


@inner
def _events_of_interval(
    k: int,
    cubic: Floats,
    step_s: float,
    site: Floats,
    codes: Ints,
    signs: Floats,
    thresholds: Floats,
    value: Floats,
    value_node: Longs,
    events: Floats,
) -> tuple[int, int]:
    """Return how many limits hold at the interval's start, and the number of events after it.

    ``value`` keeps each limit's g and rate at node ``value_node`` from one interval to the
    next. If some limit never holds in the interval, the remaining limits are not examined and the
    result is -1 and no events.
    """
    holding, num_events = 0, 0
    instants = value[-1]
    for m in range(len(codes)):
        limit = (codes[m], signs[m], thresholds[m])
        if value_node[m] == k:
            at_0 = (value[m, 0], value[m, 1])
        else:
            at_0 = limit_value(limit, cubic, site, 0.0)
        at_1 = limit_value(limit, cubic, site, step_s)
        value[m, 0], value[m, 1] = at_1
        value_node[m] = k + 1
        count = crossings(limit, cubic, site, step_s, at_0, at_1, instants)
        inside = at_0[0] >= 0.0
        if inside:
            holding += 1
        elif count == 0:
            return -1, 0
        for i in range(count):
            inside = not inside
            at = num_events
            while at > 0 and events[at - 1, 0] > instants[i]:
                events[at, 0], events[at, 1] = events[at - 1, 0], events[at - 1, 1]
                at -= 1
            events[at, 0], events[at, 1] = instants[i], 1.0 if inside else -1.0
            num_events += 1
    return holding, num_events
