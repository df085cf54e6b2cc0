"""The WRS-2 grid against real scene centres, and the shipped catalogue against the grid."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from service.catalogs.wrs2 import (
    DAYTIME_ROWS,
    NUM_PATHS,
    NUM_ROWS,
    Floats,
    grid,
    load_wrs2_land,
    scene_centers_deg,
    scene_id,
    wrs2_land_csv,
)

# The real centres agree with the constants to a millimetre.
TOLERANCE_M = 1.0
EARTH_RADIUS_M = 6_371_000.0


@pytest.fixture(scope="module")
def real_centers_deg(shared_data: Path) -> Floats:
    """Return the distinct real scene centres at hand, latitude and longitude, ``(n, 2)``."""
    sites = set()
    for name in ("landsat_1200.csv", "landsat_dev_half.csv"):
        with (shared_data / "targets" / name).open(encoding="utf-8") as file:
            sites |= {(float(row["lat"]), float(row["lon"])) for row in csv.DictReader(file)}
    return np.array(sorted(sites))


def _unit(lat_deg: Floats, lon_deg: Floats) -> Floats:
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)


def _nearest_m(places_deg: Floats, lat_deg: Floats, lon_deg: Floats) -> Floats:
    """Return the distance from each site to the nearest of the other points."""
    centers = _unit(lat_deg, lon_deg)
    sites = _unit(places_deg[:, 0], places_deg[:, 1])
    nearest: npt.NDArray[np.intp] = np.array([int((centers @ site).argmax()) for site in sites])
    apart: Floats = np.linalg.norm(sites - centers[nearest], axis=1)
    return EARTH_RADIUS_M * apart


def test_every_real_center_is_a_point_of_the_computed_grid(real_centers_deg: Floats) -> None:
    lat_deg, lon_deg = scene_centers_deg(*grid(tuple(range(1, NUM_ROWS + 1))))
    distance_m = _nearest_m(real_centers_deg, lat_deg, lon_deg)
    assert len(distance_m) > 3800
    assert distance_m.max() < TOLERANCE_M


def test_shipped_scenes_hold_nearly_all_real_centers(real_centers_deg: Floats) -> None:
    """The others lie on open water: reefs, sea ice and calibration sites far from any shore."""
    shipped = load_wrs2_land()
    lat_deg = np.array([scene.lat_deg for scene in shipped])
    lon_deg = np.array([scene.lon_deg for scene in shipped])
    is_shipped = _nearest_m(real_centers_deg, lat_deg, lon_deg) < TOLERANCE_M
    assert is_shipped.mean() > 0.96
    assert is_shipped[real_centers_deg[:, 0] > -60.0].mean() > 0.97


def test_grid_recomputed_equals_the_shipped_positions() -> None:
    path, row = grid(DAYTIME_ROWS)
    lat_deg, lon_deg = scene_centers_deg(path, row)
    computed = {
        scene_id(p, r): (lat, lon)
        for p, r, lat, lon in zip(
            path.tolist(), row.tolist(), lat_deg.tolist(), lon_deg.tolist(), strict=True
        )
    }
    for scene in load_wrs2_land():
        assert (scene.lat_deg, scene.lon_deg) == pytest.approx(computed[scene.id], abs=1e-6)


def test_shipped_file_is_a_catalogue_as_the_api_takes_it() -> None:
    lines = wrs2_land_csv().splitlines()
    ids = [line.split(",")[0] for line in lines[1:]]
    assert lines[0] == "id,lat_deg,lon_deg"
    assert len(set(ids)) == len(ids)
    assert 15_000 < len(ids) < 20_000


@pytest.mark.parametrize(
    ("path", "row", "is_land"),
    [
        (16, 41, True),  # Florida
        (196, 24, True),  # western Germany
        (62, 47, True),  # Hawaii
        (30, 60, False),  # the open Pacific on the equator
        (220, 50, False),  # the open Atlantic
    ],
)
def test_land_is_listed_and_open_ocean_is_not(path: int, row: int, is_land: bool) -> None:
    listed = {scene.id for scene in load_wrs2_land()}
    assert (scene_id(path, row) in listed) == is_land


def test_row_60_crosses_the_equator_and_paths_are_spaced_evenly() -> None:
    path = np.arange(1, NUM_PATHS + 1)
    lat_deg, lon_deg = scene_centers_deg(path, np.full(NUM_PATHS, 60))
    assert np.all(lat_deg == 0.0)
    steps_deg = np.diff(np.unwrap(lon_deg, period=360.0))
    assert steps_deg == pytest.approx(-360.0 / NUM_PATHS)
