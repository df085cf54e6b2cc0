"""When a satellite is in sunlight: the access search, with the Earth's shadow as its limit."""

from __future__ import annotations

import numpy as np

from planner_core.orbits.crossings import SUNLIT
from planner_core.orbits.ephemeris import Ephemeris
from planner_core.orbits.search import GROUP, find_windows
from planner_core.problem import Sunlight


def sunlight(ephemeris: Ephemeris) -> Sunlight:
    """Return the satellite's time outside the Earth's cylindrical shadow over the horizon."""
    track = ephemeris.track("geocentric")
    everywhere = np.array([0.0, 0.0, 1.0, -2.0])
    _, windows = find_windows(
        track,
        ephemeris.step_s,
        np.tile(everywhere, (-(-len(track) // GROUP), 1)),
        np.tile(everywhere, (len(track), 1)),
        np.ones((1, 4, 3)),
        np.array([SUNLIT], dtype=np.int32),
        np.ones(1),
        np.zeros((1, 1)),
        np.zeros(1, dtype=np.uint8),
    )
    windows = np.clip(windows, 0.0, ephemeris.duration_s)
    return Sunlight(enter_s=windows[:, 0].copy(), exit_s=windows[:, 1].copy())


def always_sunlit(duration_s: float) -> Sunlight:
    """Return one interval that covers the horizon."""
    return Sunlight(enter_s=np.zeros(1), exit_s=np.array([duration_s]))
