"""The mission of the demonstration, as bodies for the HTTP API.

Orbit, stations, targets and day are those of arXiv:1910.08419 (section Experiments): a circular
polar orbit at 500 km, two polar ground stations, 1,000 targets drawn from the Landsat scenes on
land. The spacecraft is a generic optical one instead of the paper's, so that plans can be flown.
"""

from __future__ import annotations

import random
from typing import Any, Final

from service.catalogs.wrs2 import load_wrs2_land

NUM_TARGETS: Final = 1000
SEED: Final = 2019

SATELLITE: Final[dict[str, Any]] = {
    "name": "Polar-500",
    "omm": {
        "OBJECT_NAME": "Polar-500",
        "OBJECT_ID": "2019-001A",
        "EPOCH": "2019-01-01T00:00:00.000000",
        "MEAN_MOTION": 15.24162312,
        "ECCENTRICITY": 0.001,
        "INCLINATION": 90.0,
        "RA_OF_ASC_NODE": 0.0,
        "ARG_OF_PERICENTER": 0.0,
        "MEAN_ANOMALY": 0.0,
        "NORAD_CAT_ID": 1,
        "BSTAR": 0.0,
    },
    "spacecraft": "generic_optical",
}

GROUND_STATIONS: Final[tuple[dict[str, Any], ...]] = (
    {
        "name": "Svalbard",
        "lat_deg": 78.2298391,
        "lon_deg": 15.3924483,
        "min_elevation_deg": 5.0,
    },
    {"name": "Troll", "lat_deg": -72.0167, "lon_deg": 2.5333, "min_elevation_deg": 5.0},
)

HORIZON: Final = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-02T00:00:00Z"}


def targets_csv(num_targets: int = NUM_TARGETS, seed: int = SEED) -> str:
    """Return a target catalogue drawn from the shipped scenes, determined by the seed."""
    drawn = random.Random(seed).sample(load_wrs2_land(), num_targets)
    lines = [f"{scene.id},{scene.lat_deg:.6f},{scene.lon_deg:.6f}" for scene in drawn]
    return "\n".join(["id,lat_deg,lon_deg", *lines, ""])
