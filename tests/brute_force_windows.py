"""A second search for windows: checks every limit of every pair at every second, no shortcuts.

If a limit comes close to changing between two seconds without showing it, the search samples
hundredths of a second there. Positions are Skyfield's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from planner_core.domain import Sensor
from tests.geometry import Ground, SkyfieldTable, vertical_at

Floats = npt.NDArray[np.float64]
Windows = list[tuple[float, float]]

_NEAR_DEG = 1.5  # about how far the fastest angle turns in a second
_FINE_S = 0.01


@dataclass(frozen=True, eq=False)
class BruteForce:
    """Windows of one satellite, from its positions at every second of the horizon."""

    table: SkyfieldTable
    sensor: Sensor

    @cached_property
    def _vertical(self) -> Floats:
        return vertical_at(self.table.at_seconds_m, self.sensor.nadir)

    def windows(self, ground: Ground) -> Windows:
        """Return start and end of every window, to a tenth of a millisecond."""
        position = self.table.at_seconds_m
        near = np.flatnonzero(position @ ground.up > ground.position_m @ ground.up - 50e3)
        if len(near) == 0:
            return []
        t = self.table.seconds[near]
        m = self._margin_deg(position[near], self._vertical[near], ground)
        t, m = self._with_fine_samples(t, m, ground)
        inside = m >= 0.0
        change = np.flatnonzero((inside[:-1] != inside[1:]) & (np.diff(t) < 1.5))
        edges = self._edges(t[change], t[change + 1], ground)
        if inside[0]:
            edges = np.concatenate([t[:1], edges])
        if inside[-1]:
            edges = np.concatenate([edges, t[-1:]])
        return [(float(a), float(b)) for a, b in edges.reshape(-1, 2)]

    def _margin_at(self, t: Floats, ground: Ground) -> Floats:
        position = self.table.position_m(t)
        return self._margin_deg(position, vertical_at(position, self.sensor.nadir), ground)

    def _margin_deg(self, position: Floats, vertical: Floats, ground: Ground) -> Floats:
        """Return how far inside the nearest limit the satellite is; negative outside."""
        sight = position - ground.position_m
        sight /= np.sqrt((sight * sight).sum(axis=1))[:, None]
        off_nadir = np.degrees(np.arccos(np.clip((sight * vertical).sum(axis=1), -1.0, 1.0)))
        elevation = np.degrees(np.arcsin(np.clip(sight @ ground.up, -1.0, 1.0)))
        margin = np.minimum(
            self.sensor.off_nadir_max_deg - off_nadir, elevation - self.sensor.min_elevation_deg
        )
        if self.sensor.off_nadir_min_deg > 0.0:
            margin = np.minimum(margin, off_nadir - self.sensor.off_nadir_min_deg)
        return np.asarray(margin)

    def _with_fine_samples(self, t: Floats, m: Floats, ground: Ground) -> tuple[Floats, Floats]:
        middle = m[1:-1]
        top = (middle < 0.0) & (middle >= m[:-2]) & (middle >= m[2:])
        bottom = (middle >= 0.0) & (middle <= m[:-2]) & (middle <= m[2:])
        turning = np.flatnonzero((top | bottom) & (np.abs(middle) < _NEAR_DEG)) + 1
        near = np.unique(np.concatenate([turning - 1, turning]))
        near = near[np.diff(t, append=np.inf)[near] < 1.5]
        fine = (t[near][:, None] + np.arange(_FINE_S, 1.0, _FINE_S)).ravel()
        if len(fine) == 0:
            return t, m
        everything = np.concatenate([t, fine])
        order = np.argsort(everything)
        return everything[order], np.concatenate([m, self._margin_at(fine, ground)])[order]

    def _edges(self, a: Floats, b: Floats, ground: Ground) -> Floats:
        inside = self._margin_at(a, ground) >= 0.0 if len(a) else np.zeros(0, dtype=np.bool_)
        for _ in range(14 if len(a) else 0):
            middle = 0.5 * (a + b)
            same = (self._margin_at(middle, ground) >= 0.0) == inside
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        return np.asarray(0.5 * (a + b))


@dataclass
class Comparison:
    """Which windows of the same pairs two lists lack or add, and by how much their edges differ."""

    missing: int = 0
    extra: int = 0
    num_windows: int = 0
    long_edge_errors_s: list[float] = field(default_factory=list)

    def add(self, found: Windows, expected: Windows, resolution_s: float = 0.02) -> None:
        """Compare one pair's windows; ones (and gaps) near the resolution may be missing in one."""
        self.num_windows += len(expected)
        found, expected = _gaps_closed(found, resolution_s), _gaps_closed(expected, resolution_s)
        for start, end in expected:
            partner = [w for w in found if w[0] < end and start < w[1]]
            if len(partner) != 1:
                self.missing += end - start >= resolution_s or len(partner) > 1
            elif end - start >= 20.0:
                self.long_edge_errors_s += [partner[0][0] - start, partner[0][1] - end]
        for start, end in found:
            overlaps = sum(1 for w in expected if w[0] < end and start < w[1])
            self.extra += (overlaps == 0 and end - start >= resolution_s) or overlaps > 1

    def edge_errors_ms(self) -> Floats:
        """Return the edge differences of windows of 20 s and longer."""
        return np.asarray(np.abs(self.long_edge_errors_s) * 1000.0)


def _gaps_closed(windows: Windows, shorter_than_s: float) -> Windows:
    closed: Windows = []
    for window in windows:
        if closed and window[0] - closed[-1][1] < shorter_than_s:
            closed[-1] = (closed[-1][0], window[1])
        else:
            closed.append(window)
    return closed
