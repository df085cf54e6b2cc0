"""Array types of a problem's columns, kinds of tasks, and why targets have no opportunity."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]

COLLECT: Final = 0
CONTACT: Final = 1

ACCESS_FOUND: Final = 0
NEVER_VISIBLE: Final = 1
OUTSIDE_LIMITS: Final = 2
ACCESS_TOO_SHORT: Final = 3
RULED_OUT: Final = 4
"""Geometry allows it, but pins, outages or the first turn leave no opportunity."""
WRONG_SENSOR_TYPE: Final = 5
OUTSIDE_TIMES: Final = 6
"""An access is long enough, but not between the target's release and due times."""
BETWEEN_STARTS: Final = 7
"""There is room for a collect, but not at a start of the horizon's grid."""
