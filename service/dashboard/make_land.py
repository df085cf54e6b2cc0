"""Write the land outlines of the dashboard's map.

They come from Natural Earth 4.1.0, 1:110m (public domain), in TopoJSON in the npm package
world-atlas 2.0.2. To regenerate the file::

    npm pack world-atlas@2.0.2 && tar -xzf world-atlas-2.0.2.tgz
    python -m service.dashboard.make_land package/land-110m.json
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import antimeridian
import numpy as np

LAND_FILE: Final = Path(__file__).with_name("static") / "land.json"

_DECIMALS: Final = 2  # of a degree: the outlines are no more precise than that
_CREDIT: Final = "Land: Natural Earth 4.1.0, 1:110m, public domain"

Ring = list[list[float]]


def rings_of(topology: dict[str, Any]) -> list[Ring]:
    """Return all rings of the object ``land``, as positions ``[lon_deg, lat_deg]``."""
    arcs = [_positions(arc, topology["transform"]) for arc in topology["arcs"]]
    rings = []
    for geometry in topology["objects"]["land"]["geometries"]:
        for polygon in geometry["arcs"]:
            rings += [_joined(arcs, ring) for ring in polygon]
    return rings


def _positions(arc: list[list[int]], transform: dict[str, list[float]]) -> Ring:
    # Quantised; each position is given as the step from the one before.
    steps = np.cumsum(arc, axis=0)
    positions: Ring = (steps * transform["scale"] + transform["translate"]).tolist()
    return positions


def _joined(arcs: list[Ring], ring: list[int]) -> Ring:
    joined: Ring = []
    for index in ring:
        # ~i means arc i reversed. Each arc begins where the one before it ended.
        arc = arcs[index] if index >= 0 else arcs[~index][::-1]
        joined += arc[1:] if joined else arc
    return joined


def flat_rings(rings: list[Ring]) -> Iterator[Ring]:
    """Cut rings that cross the antimeridian or surround a pole, since a flat map has edges."""
    for ring in rings:
        if all(abs(b[0] - a[0]) < 180.0 for a, b in pairwise(ring)):
            yield ring
            continue
        polygon = {"type": "Polygon", "coordinates": [ring]}
        fixed = antimeridian.fix_geojson(
            polygon, fix_winding=True, force_south_pole=_is_round_pole(ring)
        )
        parts = [fixed["coordinates"]] if fixed["type"] == "Polygon" else fixed["coordinates"]
        for part in parts:
            yield from ([list(position) for position in own] for own in part)


def _is_round_pole(ring: Ring) -> bool:
    # Steps the short way round add up to a full turn around a pole, and to zero elsewhere.
    steps = ((b[0] - a[0] + 180.0) % 360.0 - 180.0 for a, b in pairwise(ring))
    return abs(sum(steps)) > 180.0


def main(topojson: Path) -> None:
    """Write the file from the package's TopoJSON file."""
    rings = flat_rings(rings_of(json.loads(topojson.read_text(encoding="utf-8"))))
    flat = [[round(degrees, _DECIMALS) for at in ring for degrees in at] for ring in rings]
    document = {"credit": _CREDIT, "rings": flat}
    LAND_FILE.write_text(json.dumps(document, separators=(",", ":")) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
