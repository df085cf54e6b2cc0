"""Lines and areas cut at the antimeridian, as required by RFC 7946 (section 3.1.9)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import antimeridian
import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon, mapping

Floats = npt.NDArray[np.float64]

_OVER_THE_POLE_DEG = 90.0


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A part of a line that lies between -180 and 180 degrees. Arrays of shape ``(n,)``."""

    lon_deg: Floats
    lat_deg: Floats
    t_s: Floats


def pieces_of_line(lon_deg: Floats, lat_deg: Floats, t_s: Floats) -> Iterator[Piece]:
    """Yield a line in pieces that end where it leaves the map, and begin where it re-enters.

    A step of more than a quarter turn passes a pole, where all longitudes meet: the line leaves
    the map at its top or bottom.

    Parameters
    ----------
    lon_deg
        From -180 to 180. Shape ``(n,)`` like the others; ``n`` is 2 or more.
    t_s
        Time at each point.
    """
    step_deg = (np.diff(lon_deg) + 180.0) % 360.0 - 180.0
    is_polar = np.abs(step_deg) > _OVER_THE_POLE_DEG
    is_cut = is_polar | (np.abs(np.diff(lon_deg)) > 180.0)
    points = np.stack([lon_deg, lat_deg, t_s], axis=1)
    first, entry = 0, points[:0]
    for row in np.flatnonzero(is_cut).tolist():
        if is_polar[row]:
            at = np.copysign(90.0, lat_deg[row]), (t_s[row] + t_s[row + 1]) / 2.0
            ends = np.array([[[lon_deg[row], *at]], [[lon_deg[row + 1], *at]]])
        else:
            edge_deg = np.copysign(180.0, lon_deg[row])
            # A step from 180 to -180 has length zero.
            share = (edge_deg - lon_deg[row]) / (step_deg[row] or 1.0)
            at = points[row, 1:] + share * (points[row + 1, 1:] - points[row, 1:])
            ends = np.array([[[edge_deg, *at]], [[-edge_deg, *at]]])
        yield Piece(*np.concatenate([entry, points[first : row + 1], ends[0]]).T)
        first, entry = row + 1, ends[1]
    yield Piece(*np.concatenate([entry, points[first:]]).T)


def area(lon_deg: Floats, lat_deg: Floats, decimals: int) -> dict[str, Any]:
    """Return the GeoJSON geometry inside a ring; a ring around a pole contains the pole.

    Parameters
    ----------
    lon_deg, lat_deg
        Counter-clockwise. Shape ``(n,)``.
    """
    ring = Polygon(np.stack([lon_deg, lat_deg], axis=1))
    geometry = mapping(antimeridian.fix_polygon(ring))
    return {"type": geometry["type"], "coordinates": _rounded(geometry["coordinates"], decimals)}


def _rounded(coordinates: Any, decimals: int) -> Any:
    if isinstance(coordinates, float):
        return round(coordinates, decimals)
    return [_rounded(part, decimals) for part in coordinates]
