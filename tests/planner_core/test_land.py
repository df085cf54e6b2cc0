"""Land cells, compared with the outlines that they are made from."""

from __future__ import annotations

import json

import numpy as np
import pytest

from planner_core.geography.land import NUM_LAT, NUM_LON, may_be_land
from planner_core.geography.make_land_cells import cells_of
from service.dashboard.make_land import LAND_FILE

LAND = {
    "Bern": (46.9, 7.4),
    "Singapore": (1.35, 103.8),
    "Sydney": (-33.9, 151.2),
    "Honolulu": (21.3, -157.8),
    "Tokyo": (35.7, 139.7),
    "the south pole": (-90.0, 0.0),
    "Fiji, over the date line": (-16.6, 179.9),
}
SEAS = {
    "the Gulf of Guinea": (0.0, 0.0),
    "the Pacific": (-40.0, -140.0),
    "the Indian Ocean": (-20.0, 80.0),
    "the north pole": (90.0, 0.0),
}


@pytest.mark.parametrize("name", LAND)
def test_land_is_land(name: str) -> None:
    assert may_be_land(*LAND[name])


@pytest.mark.parametrize("name", SEAS)
def test_the_sea_is_none(name: str) -> None:
    assert not may_be_land(*SEAS[name])


def test_the_file_is_what_the_outlines_make() -> None:
    rings = json.loads(LAND_FILE.read_text(encoding="utf-8"))["rings"]
    lat_deg, lon_deg = np.arange(NUM_LAT) - 89.5, np.arange(NUM_LON) - 179.5
    stored = may_be_land(np.repeat(lat_deg, NUM_LON), np.tile(lon_deg, NUM_LAT))
    assert (stored.reshape(NUM_LAT, NUM_LON) == cells_of(rings)).all()
