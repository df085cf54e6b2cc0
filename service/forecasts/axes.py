"""Requirements on the latitudes and longitudes of a grid."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from planner_core.errors import Fault
from service.forecasts.fields import Floats

_LON_TOLERANCE: Final = 0.02
"""As a share of a step: files hold rounded longitudes."""
_LAT_RATIO: Final = 2.0
"""Between the largest and the smallest step: Gaussian grids are nearly even."""


def fault_of_axes(lat_deg: Floats, lon_deg: Floats) -> Fault | None:
    """Return the fault of a grid's ascending axes, or None."""
    if lat_deg[0] < -90.0 or lat_deg[-1] > 90.0:
        return _fault("latitudes must lie between -90 and 90.")
    if lon_deg[-1] - lon_deg[0] > 360.0 or lon_deg[0] < -360.0 or lon_deg[-1] > 720.0:
        return _fault("longitudes may span at most 360 degrees.")
    steps_deg = np.diff(lat_deg)
    if len(steps_deg) and steps_deg.max() > _LAT_RATIO * steps_deg.min():
        return _fault(
            f"latitudes are not evenly spaced: steps from {steps_deg.min():g} to "
            f"{steps_deg.max():g} degrees."
        )
    steps_deg = np.diff(lon_deg)
    if len(steps_deg) and np.ptp(steps_deg) > _LON_TOLERANCE * steps_deg.max():
        return _fault(
            f"longitudes are not evenly spaced: steps from {steps_deg.min():g} to "
            f"{steps_deg.max():g} degrees. A region across 180 degrees is written 170 to 190."
        )
    return None


def unwrapped(lon_deg: Floats, value: npt.NDArray[Any]) -> tuple[Floats, npt.NDArray[Any]]:
    """Return the grid without a last column that repeats the first, 360 degrees further."""
    if len(lon_deg) > 1 and abs(lon_deg[-1] - lon_deg[0] - 360.0) < 1e-6:
        return lon_deg[:-1], value[..., :-1]
    return lon_deg, value


def _fault(detail: str) -> Fault:
    return Fault(code="invalid_value", detail=f"The grid's {detail}")
