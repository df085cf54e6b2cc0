"""The battery over the horizon: constant idle load, images and slews, charge in sunlight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.aeossp.case import Case, Observation
from benchmarks.aeossp.geometry import Sky

Floats = npt.NDArray[np.float64]

_ROUNDING_WH = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """The history of one satellite's battery.

    Attributes
    ----------
    used_wh
        All energy drawn, without subtracting charge.
    lowest_wh
        The lowest level.
    empty_s
        The middle of the first time step that ends below zero, or None.
    """

    used_wh: float
    lowest_wh: float
    imaging_s: float
    empty_s: float | None


def draw(
    case: Case,
    sky: Sky,
    satellite_id: str,
    images: Sequence[Observation],
    turns: Sequence[tuple[float, float]],
) -> Drawn:
    """Return the effect of a satellite's actions and slews on its battery.

    The horizon is cut at the battery's grid and wherever images and slews begin and end; the
    state in the middle of a piece holds for all of it.
    """
    satellite = case.satellites[satellite_id]
    image_spans = [(one.start_s, one.end_s) for one in images]
    grid = np.arange(0.0, case.horizon_s, case.resource_step_s)
    edges = [t for span in (*image_spans, *turns) for t in span]
    # Instants of the benchmark are whole microseconds.
    points = np.unique(np.round(np.concatenate([grid, edges, [case.horizon_s]]), 6))
    length_s, middle_s = np.diff(points), points[:-1] + np.diff(points) / 2.0
    is_imaging, is_turning = _covered(middle_s, image_spans), _covered(middle_s, turns)
    load_w = (
        satellite.idle_power_w
        + satellite.imaging_power_w * is_imaging
        + satellite.slew_power_w * is_turning
    )
    is_lit = sky.is_sunlit(sky.satellite(satellite_id, middle_s), middle_s)
    change_wh = (satellite.sunlit_charge_power_w * is_lit - load_w) * length_s / 3600.0
    level = lowest = satellite.initial_battery_wh
    empty_s = None
    for piece, change in enumerate(change_wh.tolist()):
        level = min(satellite.battery_capacity_wh, level + change)
        lowest = min(lowest, level)
        if level < -_ROUNDING_WH:
            empty_s = float(middle_s[piece])
            break
    return Drawn(
        used_wh=float(load_w @ length_s) / 3600.0,
        lowest_wh=lowest,
        imaging_s=float(length_s @ is_imaging),
        empty_s=empty_s,
    )


def _covered(t_s: Floats, spans: Sequence[tuple[float, float]]) -> npt.NDArray[np.bool_]:
    """Return whether instants lie in any of the spans, which do not overlap each other."""
    is_in = np.zeros(len(t_s), dtype=np.bool_)
    for start_s, end_s in spans:
        is_in[np.searchsorted(t_s, start_s) : np.searchsorted(t_s, end_s)] = True
    return is_in
