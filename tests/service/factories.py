"""Bodies with readable defaults, and short ways to post them."""

from __future__ import annotations

import itertools
from datetime import UTC, datetime
from typing import Any

import httpx

from planner_core.domain import OrbitElements
from planner_core.orbits.tle import format_tle

EPOCH = datetime(2026, 3, 1, tzinfo=UTC)
# Only one satellite may have a catalogue number.
_NUMBERS = itertools.count(91_001)


def tle(norad_cat_id: int = 90001, **elements: Any) -> list[str]:
    """Return the TLE of a circular sun-synchronous orbit of 560 km."""
    made_up = {
        "name": None,
        "object_id": "2026-001A",
        "epoch": EPOCH,
        "mean_motion_rev_day": 15.0,
        "eccentricity": 0.001,
        "inclination_deg": 97.6,
        "raan_deg": 10.0,
        "arg_perigee_deg": 0.0,
        "mean_anomaly_deg": 0.0,
        "bstar": 1e-5,
    }
    return list(format_tle(OrbitElements(norad_cat_id=norad_cat_id, **made_up | elements)))


def satellite(**fields: Any) -> dict[str, Any]:
    """Return the body of a satellite, by default with the figures of the paper's."""
    return {"name": "EYE-1", "tle": tle(next(_NUMBERS)), "spacecraft": "paper"} | fields


def target(**fields: Any) -> dict[str, Any]:
    """Return a target."""
    return {"id": "t1", "lat_deg": 47.0, "lon_deg": 8.0} | fields


def ground_station(**fields: Any) -> dict[str, Any]:
    """Return the body of a ground station."""
    return {"name": "North", "lat_deg": 78.2, "lon_deg": 15.4} | fields


def post(client: httpx.Client, path: str, body: object) -> dict[str, Any]:
    """Post a body that must be accepted; return the answer."""
    response = client.post(path, json=body)
    assert response.is_success, response.text
    answer: dict[str, Any] = response.json()
    return answer


def send(client: httpx.Client, path: str, content: bytes | str, media_type: str) -> httpx.Response:
    """Post a file."""
    return client.post(path, content=content, headers={"Content-Type": media_type})
