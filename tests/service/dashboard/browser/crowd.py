"""A fleet and a network as large as operators have: 20 satellites and 18 stations."""

from __future__ import annotations

from typing import Final

import httpx

from service.commands import demo_mission
from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json, planned
from tests.service.factories import ground_station, post, satellite, tle

NUM_SATELLITES: Final = 20
START: Final = "2026-03-01T00:00:00Z"
END: Final = "2026-03-01T12:00:00Z"
NOON_OF_SHIFT: Final = "2026-03-01T06:00:00Z"
_FIRST_NUMBER: Final = 95_001
# Stations in Alaska, Florida, Svalbard and Scandinavia are only a few degrees apart.
STATIONS: Final = {
    "Svalbard": (78.2, 15.4), "Kiruna": (67.9, 21.1), "Tromso": (69.7, 18.9),
    "Vardo": (70.3, 31.0), "Troll": (-72.0, 2.5), "McMurdo": (-77.8, 166.7),
    "North Pole": (64.8, -147.7), "Gilmore Creek": (65.0, -147.5), "Prudhoe Bay": (70.2, -148.5),
    "Wallops": (37.9, -75.5), "Merritt Island": (28.5, -80.6), "Ponce de Leon": (29.1, -80.9),
    "White Sands": (32.5, -106.6), "South Point": (19.0, -155.7), "Santiago": (-33.1, -70.7),
    "Hartebeesthoek": (-25.9, 27.7), "Dongara": (-29.1, 115.6), "Singapore": (1.3, 103.7),
}  # fmt: skip

SCREENS: Final = ((1920, 1080), (1280, 720), (1400, 757), (3840, 2160))
# Whatever extends beyond the edge of the screen or of its own section.
CUT_OFF: Final = """
return [...document.querySelectorAll("#wall tr, #wall canvas, #wall p")].filter((one) => {
  const box = one.getBoundingClientRect();
  const frame = one.closest("section").getBoundingClientRect();
  return box.right > Math.min(frame.right, innerWidth) + 1 || box.left < frame.left - 1 ||
    box.bottom > Math.min(frame.bottom, innerHeight) + 1 || box.top < frame.top - 1;
}).map((one) => one.innerText || one.tagName);
"""


def show_at(browser: Browser, width: int, height: int) -> None:
    """Give the page exactly this viewport: a window of this size has less."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


def crowded_plan(api: httpx.Client) -> Json:
    """Store the mission, plan half a day of it and publish the plan; return the plan."""
    satellites = [
        post(
            api,
            "/v1/satellites",
            satellite(
                name=f"OBSERVER {chr(65 + i // 4)}-{i % 4 + 1}",
                # Trains of four, five minutes apart, as in real constellations.
                tle=tle(
                    _FIRST_NUMBER + i, raan_deg=72.0 * (i // 4), mean_anomaly_deg=20.0 * (i % 4)
                ),
                spacecraft="generic_optical",
            ),
        )
        for i in range(NUM_SATELLITES)
    ]
    stations = [
        post(api, "/v1/ground-stations", ground_station(name=name, lat_deg=lat, lon_deg=lon))
        for name, (lat, lon) in STATIONS.items()
    ]
    catalog = api.post(
        "/v1/target-catalogs?name=Crowd",
        content=demo_mission.targets_csv(300),
        headers={"Content-Type": "text/csv"},
    ).json()
    scenario = {
        "name": "20 satellites, 18 stations",
        "horizon": {"start": START, "end": END},
        "satellite_ids": [one["id"] for one in satellites],
        "target_catalog_ids": [catalog["id"]],
        "ground_station_ids": [one["id"] for one in stations],
    }
    job = planned(api, str(post(api, "/v1/scenarios", scenario)["id"]))
    plan = post(api, "/v1/plans", {"job_id": job["id"], "name": "Sunday"})
    path = f"/v1/plans/{plan['id']}/transitions"
    reason = "Not for flight."
    waivers = [{"violation": one["id"], "reason": reason} for one in plan["violations"]]
    post(api, path, {"to": "approved", "reason": reason, "waivers": waivers})
    return post(api, path, {"to": "published", "effective_from": START})
