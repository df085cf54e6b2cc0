"""One-degree cells that contain land, for a first look at catalogues of targets."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import Final

import numpy as np
import numpy.typing as npt

NUM_LAT: Final = 180
NUM_LON: Final = 360
FILE: Final = "land_cells.csv"

Cells = npt.NDArray[np.bool_]


def may_be_land(lat_deg: npt.ArrayLike, lon_deg: npt.ArrayLike) -> Cells:
    """Return which points lie in a one-degree cell that contains land or is within 0.2 deg of it.

    Land is that of Natural Earth's outlines at 1:110m, which lack islands of a few kilometres.

    >>> may_be_land([46.9, 0.0], [7.4, -30.0]).tolist()
    [True, False]
    """
    row = np.clip(np.floor(np.asarray(lat_deg) + 90.0).astype(int), 0, NUM_LAT - 1)
    column = np.floor(np.asarray(lon_deg) + 180.0).astype(int) % NUM_LON
    return np.asarray(_cells()[row, column])


@cache
def _cells() -> Cells:
    lines = (files(__package__) / FILE).read_text(encoding="utf-8").splitlines()
    rows = [bytes.fromhex(row["cells"]) for row in csv.DictReader(lines)]
    return np.unpackbits(np.array([list(row) for row in rows], np.uint8), axis=1).astype(np.bool_)
