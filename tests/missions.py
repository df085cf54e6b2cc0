"""Real-size scenario files for tests."""

from __future__ import annotations

import copy
import csv
from pathlib import Path
from typing import Any

import numpy as np

from service.catalogs.wrs2 import load_wrs2_land

Document = dict[str, Any]

PAPER_ORBIT: Document = {
    "OBJECT_NAME": "PAPER",
    "OBJECT_ID": "",
    "EPOCH": "2019-01-01T00:00:00.000000",
    "MEAN_MOTION": 15.24162312,
    "ECCENTRICITY": 0.001,
    "INCLINATION": 90.0,
    "RA_OF_ASC_NODE": 0.0,
    "ARG_OF_PERICENTER": 0.0,
    "MEAN_ANOMALY": 0.0,
    "EPHEMERIS_TYPE": 0,
    "CLASSIFICATION_TYPE": "U",
    "NORAD_CAT_ID": 1,
    "ELEMENT_SET_NO": 999,
    "REV_AT_EPOCH": 0,
    "BSTAR": 0.0,
    "MEAN_MOTION_DOT": 0.0,
    "MEAN_MOTION_DDOT": 0.0,
}
"""The paper's satellite, with its authors' orbital elements."""

STATIONS: list[Document] = [
    {"name": "Svalbard", "lat_deg": 78.2298391, "lon_deg": 15.3924483, "min_elevation_deg": 5.0},
    {"name": "Troll", "lat_deg": -72.0167, "lon_deg": 2.5333, "min_elevation_deg": 5.0},
]


def drawn_targets(number: int, seed: int = 0) -> list[Document]:
    """Return targets drawn from the shipped WRS-2 catalogue."""
    scenes = load_wrs2_land()
    picked = np.random.default_rng(seed).choice(len(scenes), number, replace=False)
    return [
        {"id": scenes[i].id, "lat_deg": scenes[i].lat_deg, "lon_deg": scenes[i].lon_deg}
        for i in picked
    ]


def landsat_targets(shared_data: Path, number: int) -> list[Document]:
    """Return real scene centres."""
    with (shared_data / "targets" / "landsat_dev_half.csv").open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    step = len(rows) // number
    return [
        {"id": r["id"], "lat_deg": float(r["lat"]), "lon_deg": float(r["lon"])}
        for r in rows[::step][:number]
    ]


def paper_mission(targets: list[Document], **flags: Any) -> Document:
    """Return the paper's mission as a scenario file."""
    return {
        "horizon": {"start": "2019-01-01T00:00:00Z", "end": "2019-01-02T00:00:00Z"},
        "satellites": [{"name": "PAPER", "omm": PAPER_ORBIT}],
        "targets": targets,
        "ground_stations": copy.deepcopy(STATIONS),
        "use_resources": True,
        "dynamics": "physical",
        **flags,
    }
