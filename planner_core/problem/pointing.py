"""Lines of sight at any instant, from satellite paths and site positions in plain arrays.

A collect with a continuous start needs its line of sight at that start, but solvers and the
referee do not propagate orbits. So a problem with continuous starts carries the polynomials that
its accesses were computed from; nothing is approximated a second time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner_core.bundles import bundle
from planner_core.jit import borrowing, borrowing_inner, kernel
from planner_core.problem.slew import (
    INSTANT,
    TIME_TOLERANCE_S,
    angle_between_deg,
    slew_s,
)

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Vector = tuple[float, float, float]


@bundle
class Path(NamedTuple):
    """One satellite's path at evenly spaced nodes that cover the horizon.

    Attributes
    ----------
    step_s
        From one node to the next.
    nodes
        Earth-fixed position (m) and its rate (m/s), then the Earth's orientation: sidereal
        angle and the pole's x and y (rad). Shape ``(num_nodes, 9)``.
    """

    step_s: float
    nodes: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pointing:
    """The data from which lines of sight are computed.

    Attributes
    ----------
    paths
        One per satellite.
    targets_m, stations_m
        Earth-fixed positions. Shape ``(n, 3)`` each.
    """

    paths: tuple[Path, ...]
    targets_m: Floats
    stations_m: Floats


@bundle
class Agile(NamedTuple):
    """How fast a satellite turns; ``acceleration_deg_s2`` may be ``INSTANT``."""

    rate_deg_s: float
    acceleration_deg_s2: float
    settle_s: float


@borrowing_inner
def position_m(path: Path, t_s: float) -> Vector:
    """Return the Earth-fixed position: the cubic between the nodes around an instant."""
    k = min(max(int(t_s / path.step_s), 0), len(path.nodes) - 2)
    u = t_s / path.step_s - k
    # The four Hermite weights.
    v = 1.0 - u
    a, b = (1.0 + 2.0 * u) * v * v, (1.0 + 2.0 * v) * u * u
    c, d = u * v * v * path.step_s, -v * u * u * path.step_s
    now, then = k, k + 1
    nodes = path.nodes
    return (
        a * nodes[now, 0] + b * nodes[then, 0] + c * nodes[now, 3] + d * nodes[then, 3],
        a * nodes[now, 1] + b * nodes[then, 1] + c * nodes[now, 4] + d * nodes[then, 4],
        a * nodes[now, 2] + b * nodes[then, 2] + c * nodes[now, 5] + d * nodes[then, 5],
    )


@borrowing
def sight(path: Path, sites: Floats, site: int, t_s: float) -> Vector:
    """Return the unit vector from the satellite to ``sites[site]``, inertial (TEME)."""
    x, y, z = position_m(path, t_s)
    x, y, z = sites[site, 0] - x, sites[site, 1] - y, sites[site, 2] - z
    range_m = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / range_m, y / range_m, z / range_m
    k = min(max(int(t_s / path.step_s), 0), len(path.nodes) - 2)
    u = t_s / path.step_s - k
    nodes = path.nodes
    angle = nodes[k, 6] + u * (nodes[k + 1, 6] - nodes[k, 6])
    xp = nodes[k, 7] + u * (nodes[k + 1, 7] - nodes[k, 7])
    yp = nodes[k, 8] + u * (nodes[k + 1, 8] - nodes[k, 8])
    x, y, z = x - xp * z, y + yp * z, z + xp * x - yp * y
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * x - sine * y, cosine * y + sine * x, z


@borrowing
def needed_s(agile: Agile, u: Vector, v: Vector) -> float:
    """Return the time to turn from one line of sight to another, and to settle."""
    angle_deg = angle_between_deg(u, v)
    return slew_s(angle_deg, agile.rate_deg_s, agile.acceleration_deg_s2) + agile.settle_s


@borrowing
def earliest_start_s(
    agile: Agile,
    end_s: float,
    looked: Vector,
    path: Path,
    sites: Floats,
    site: int,
    open_s: float,
    close_s: float,
) -> float:
    """Return the earliest start between ``open_s`` and ``close_s`` after another task.

    While lines of sight turn more slowly than the satellite, every start after a feasible one is
    feasible too, and this is the earliest to within a millisecond. Otherwise it is a feasible
    one. Starts are whole milliseconds; infinite if none is found.

    Parameters
    ----------
    end_s, looked
        The end of the previous task, and its line of sight then.
    site
        Row of ``sites`` that the start looks at.
    """
    low = math.ceil(max(open_s, end_s + agile.settle_s) * 1000.0 - 1e-4) / 1000.0
    if low > close_s + 1e-9:
        return np.inf
    missing = end_s + needed_s(agile, looked, sight(path, sites, site, low)) - low
    if missing <= TIME_TOLERANCE_S / 2.0:
        return low
    # Secant steps, each a little too long, until a start is feasible; then narrow the bracket.
    high, left = low + 1.02 * missing, -1.0
    for _ in range(60):
        high = min(high, close_s)
        left = high - end_s - needed_s(agile, looked, sight(path, sites, site, high))
        if left >= 0.0:
            break
        if high >= close_s:
            return np.inf
        gained = (missing + left) / (high - low)
        low, missing = high, -left
        high = low + 1.02 * missing / max(gained, 0.05) + 1e-4
    for _ in range(60):
        if high - low < 1e-3 or left < 1e-5:
            break
        share = missing / (missing + left)
        middle = low + min(max(share, 0.05), 0.95) * (high - low)
        over = middle - end_s - needed_s(agile, looked, sight(path, sites, site, middle))
        if over >= 0.0:
            high, left = middle, over
        else:
            low, missing = middle, -over
    start = math.ceil(high * 1000.0 - 1e-4) / 1000.0
    for _ in range(3):
        if start > close_s + 1e-9:
            return np.inf
        over = start - end_s - needed_s(agile, looked, sight(path, sites, site, start))
        if over >= -TIME_TOLERANCE_S / 2.0:
            return start
        start = math.ceil(start * 1000.0 + 0.5) / 1000.0
    return np.inf


@borrowing
def latest_start_s(
    agile: Agile,
    start_s: float,
    looks: Vector,
    path: Path,
    sites: Floats,
    site: int,
    length_s: float,
    open_s: float,
    close_s: float,
) -> float:
    """Return the latest start between ``open_s`` and ``close_s`` before another task.

    The mirror of ``earliest_start_s``; minus infinity if none is found.

    Parameters
    ----------
    start_s, looks
        The start of the next task, and its line of sight then.
    length_s
        Duration of the task whose start is sought.
    """
    high = math.floor(min(close_s, start_s - agile.settle_s - length_s) * 1000.0 + 1e-4) / 1000.0
    if high < open_s - 1e-9:
        return -np.inf
    late = needed_s(agile, sight(path, sites, site, high + length_s), looks)
    missing = late + high + length_s - start_s
    if missing <= TIME_TOLERANCE_S / 2.0:
        return high
    low, left = high - 1.02 * missing, -1.0
    for _ in range(60):
        low = max(low, open_s)
        left = start_s - low - length_s
        left -= needed_s(agile, sight(path, sites, site, low + length_s), looks)
        if left >= 0.0:
            break
        if low <= open_s:
            return -np.inf
        gained = (missing + left) / (high - low)
        high, missing = low, -left
        low = high - 1.02 * missing / max(gained, 0.05) - 1e-4
    for _ in range(60):
        if high - low < 1e-3 or left < 1e-5:
            break
        share = missing / (missing + left)
        middle = high - min(max(share, 0.05), 0.95) * (high - low)
        over = start_s - middle - length_s
        over -= needed_s(agile, sight(path, sites, site, middle + length_s), looks)
        if over >= 0.0:
            low, left = middle, over
        else:
            high, missing = middle, -over
    start = math.floor(low * 1000.0 + 1e-4) / 1000.0
    for _ in range(3):
        if start < open_s - 1e-9:
            return -np.inf
        over = start_s - start - length_s
        over -= needed_s(agile, sight(path, sites, site, start + length_s), looks)
        if over >= -TIME_TOLERANCE_S / 2.0:
            return start
        start = math.floor(start * 1000.0 - 0.5) / 1000.0
    return -np.inf


def agile_of(rate_deg_s: float, acceleration_deg_s2: float | None, settle_s: float) -> Agile:
    """Return a satellite's agility for kernels."""
    return Agile(rate_deg_s, acceleration_deg_s2 or INSTANT, settle_s)


@kernel
def sights(path: Path, sites: Floats, site: Ints, t_s: Floats) -> Floats:
    """Return the lines of sight to many sites, each at its own instant. Shape ``(n, 3)``."""
    found = np.empty((len(t_s), 3))
    for i in range(len(t_s)):
        found[i, 0], found[i, 1], found[i, 2] = sight(path, sites, site[i], t_s[i])
    return found
