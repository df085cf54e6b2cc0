"""The Landsat WRS-2 grid: scene centres from the orbit constants, and the shipped land scenes.

The Worldwide Reference System 2 numbers the scenes of the Landsat 4 to 9 orbit: 233 paths
(the orbits of one 16-day cycle, numbered westward) of 248 rows each (equal steps along the
orbit; row 60 is the descending crossing of the equator).
"""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

NUM_PATHS = 233
NUM_ROWS = 248
CYCLE_DAYS = 16
EQUATOR_ROW = 60
PATH_1_NODE_LON_DEG = -64.6
INCLINATION_DEG = 98.2
DAYTIME_ROWS = (*range(1, 142), 246, 247, 248)
"""Rows that Landsat images by day: the descending half, and beyond both ends in polar summer."""

CATALOG_FILE = "wrs2_land.csv"
_WGS84_FLATTENING = 1.0 / 298.257223563


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """The centre of one scene; ``id`` is ``WRS2-PPPRRR`` with path and row."""

    id: str
    lat_deg: float
    lon_deg: float


def scene_id(path: int, row: int) -> str:
    """Return the catalogue's id of a scene.

    >>> scene_id(16, 48)
    'WRS2-016048'
    """
    return f"WRS2-{path:03d}{row:03d}"


def scene_centers_deg(path: Ints, row: Ints) -> tuple[Floats, Floats]:
    r"""Return geodetic latitudes and longitudes of scene centres.

    Parameters
    ----------
    path, row
        Path (1 to 233) and row (1 to 248) of each scene. Shape ``(n,)``.

    Returns
    -------
    Latitudes and longitudes (in [-180, 180)) in degrees, each of shape ``(n,)``.

    Notes
    -----
    Row :math:`r` lies :math:`u = (r - 60) \cdot 360 / 248` degrees of orbit after the descending
    node. Its geocentric latitude is :math:`-\arcsin(\sin i \sin u)`. In longitude it turns from
    the node by :math:`\operatorname{atan2}(\cos i \sin u, \cos u)` in space, while the Earth
    turns under the orbit plane by :math:`16/233` of a revolution per orbit. Because the orbit
    is sun-synchronous, that share holds exactly, and it is what spaces the paths.

    Examples
    --------
    >>> lat, lon = scene_centers_deg(np.array([1]), np.array([60]))
    >>> float(lat[0]), round(float(lon[0]), 6)
    (0.0, -64.6)
    """
    u = (np.asarray(row) - EQUATOR_ROW) * (2.0 * math.pi / NUM_ROWS)
    inclination = math.radians(INCLINATION_DEG)
    geocentric = np.arcsin(-math.sin(inclination) * np.sin(u))
    geodetic = np.arctan2(np.tan(geocentric), (1.0 - _WGS84_FLATTENING) ** 2)
    in_space_deg = np.degrees(np.arctan2(math.cos(inclination) * np.sin(u), np.cos(u)))
    earth_turn_deg = np.degrees(u) * CYCLE_DAYS / NUM_PATHS
    node_deg = PATH_1_NODE_LON_DEG - (np.asarray(path) - 1) * 360.0 / NUM_PATHS
    lon_deg = (node_deg + in_space_deg - earth_turn_deg + 180.0) % 360.0 - 180.0
    return np.degrees(geodetic) + 0.0, lon_deg


def grid(rows: tuple[int, ...]) -> tuple[Ints, Ints]:
    """Return path and row of every scene in ``rows``, row by row. Each of shape ``(n,)``."""
    row, path = np.meshgrid(np.array(rows), np.arange(1, NUM_PATHS + 1), indexing="ij")
    return path.ravel(), row.ravel()


def wrs2_land_csv() -> str:
    """Return the shipped catalogue in the form that the API takes: ``id,lat_deg,lon_deg``."""
    return resources.files(__package__).joinpath(CATALOG_FILE).read_text(encoding="utf-8")


@cache
def load_wrs2_land() -> tuple[Scene, ...]:
    """Return the shipped land and coast scenes, in the order of the file."""
    return tuple(
        Scene(id=line["id"], lat_deg=float(line["lat_deg"]), lon_deg=float(line["lon_deg"]))
        for line in csv.DictReader(io.StringIO(wrs2_land_csv()))
    )
