"""Write the cells that contain land, from the outlines of the dashboard's map.

To make the file again once those outlines have changed::

    python -m planner_core.geography.make_land_cells service/dashboard/static/land.json
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Final

import numpy as np
import shapely

from planner_core.geography.land import FILE, NUM_LAT, NUM_LON, Cells

_NEAR_DEG: Final = 0.2


def cells_of(rings: list[list[float]]) -> Cells:
    """Return which one-degree cells contain land or are near it. Shape ``(180, 360)``.

    Parameters
    ----------
    rings
        Alternating longitude and latitude, in degrees. Lakes count as land.
    """
    outlines = [shapely.Polygon(np.reshape(ring, (-1, 2))).buffer(_NEAR_DEG) for ring in rings]
    tree = shapely.STRtree(outlines)
    lon_deg, lat_deg = np.meshgrid(np.arange(NUM_LON) - 180.0, np.arange(NUM_LAT) - 90.0)
    boxes = shapely.box(lon_deg, lat_deg, lon_deg + 1.0, lat_deg + 1.0).ravel()
    touched, _ = tree.query(boxes, predicate="intersects")
    found = np.zeros(len(boxes), dtype=np.bool_)
    found[touched] = True
    return found.reshape(NUM_LAT, NUM_LON)


def main(outlines: Path) -> None:
    """Write the file: a row for each degree of latitude from the south, its cells from the west."""
    cells = cells_of(json.loads(outlines.read_text(encoding="utf-8"))["rings"])
    packed = np.packbits(cells, axis=1)
    with Path(__file__).with_name(FILE).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["south_deg", "cells"])
        writer.writerows([row - 90, packed[row].tobytes().hex()] for row in range(NUM_LAT))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
