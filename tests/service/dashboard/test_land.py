"""The land outlines of the map."""

from __future__ import annotations

import json

from service.dashboard.make_land import LAND_FILE, rings_of


def rings() -> list[list[tuple[float, float]]]:
    flat = json.loads(LAND_FILE.read_text(encoding="utf-8"))["rings"]
    return [list(zip(ring[::2], ring[1::2], strict=True)) for ring in flat]


def is_land(lon_deg: float, lat_deg: float) -> bool:
    """Return whether a point is on land, by counting the shores between it and the south."""
    crossings = 0
    for ring in rings():
        for (x1, y1), (x2, y2) in zip(ring, ring[1:] + ring[:1], strict=True):
            if (x1 > lon_deg) != (x2 > lon_deg):
                crossings += y1 + (lon_deg - x1) / (x2 - x1) * (y2 - y1) < lat_deg
    return crossings % 2 == 1


def test_land_is_where_land_is() -> None:
    places = {
        "Kansas": (-98.0, 39.0),
        "Chad": (18.0, 15.0),
        "Siberia": (100.0, 62.0),
        "Alice Springs": (133.9, -23.7),
        "South Pole, nearly": (10.0, -85.0),
    }
    seas = {
        "Pacific": (-150.0, 0.0),
        "Atlantic": (-30.0, 20.0),
        "North Pole, nearly": (0.0, 88.0),
        "Indian Ocean": (80.0, -30.0),
    }
    assert [name for name, place in places.items() if not is_land(*place)] == []
    assert [name for name, place in seas.items() if is_land(*place)] == []


def test_the_file_says_whose_outlines_they_are() -> None:
    document = json.loads(LAND_FILE.read_text(encoding="utf-8"))
    assert "Natural Earth" in document["credit"]
    assert "public domain" in document["credit"]


def test_arcs_are_joined_in_either_direction() -> None:
    """A square of two arcs, the second stored the other way round."""
    topology = {
        "transform": {"scale": [0.5, 2.0], "translate": [10.0, -20.0]},
        "arcs": [[[0, 0], [2, 0], [0, 1]], [[0, 0], [0, 1], [2, 0]]],
        "objects": {"land": {"geometries": [{"arcs": [[[0, ~1]]]}]}},
    }
    assert rings_of(topology) == [
        [[10.0, -20.0], [11.0, -20.0], [11.0, -18.0], [10.0, -18.0], [10.0, -20.0]]
    ]
