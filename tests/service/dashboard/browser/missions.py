"""Missions of the browser's tests, sent through the API."""

from __future__ import annotations

import time
from typing import Any

import httpx

from service.client import Client
from service.commands import demo, demo_mission
from tests.service.factories import post, satellite, tle

Json = dict[str, Any]
WITHIN_S = 300.0


def small_mission(api: httpx.Client) -> str:
    """Store the demonstration's mission once; return the id of its scenario."""
    name = {"name": demo_mission.SATELLITE["name"]}
    # Tests share a service, which accepts a catalogue number only once.
    if not api.get("/v1/satellites", params=name).json()["items"]:
        with Client(str(api.base_url), key="") as client:
            return demo.create_mission(client).id
    stored = api.get("/v1/scenarios", params={"name": "Day of a polar satellite"}).json()["items"]
    return str(stored[-1]["id"])


def light_mission(api: httpx.Client) -> str:
    """Store that mission's day over fewer targets, quickly planned and replanned to a proof."""
    small_mission(api)
    names = [demo_mission.SATELLITE["name"], *(s["name"] for s in demo_mission.GROUND_STATIONS)]
    (satellite_id, *station_ids) = (
        api.get(f"/v1/{kind}", params={"name": name}).json()["items"][0]["id"]
        for kind, name in zip(
            ("satellites", "ground-stations", "ground-stations"), names, strict=True
        )
    )
    catalog = api.post(
        "/v1/target-catalogs?name=A+hundred",
        content=demo_mission.targets_csv(100),
        headers={"Content-Type": "text/csv"},
    ).json()
    scenario = {
        "name": "Light day",
        "horizon": demo_mission.HORIZON,
        "satellite_ids": [satellite_id],
        "target_catalog_ids": [catalog["id"]],
        "ground_station_ids": station_ids,
    }
    return str(post(api, "/v1/scenarios", scenario)["id"])


def large_mission(api: httpx.Client, num_satellites: int = 12, num_days: int = 7) -> str:
    """Store a fleet, 2,000 targets and some days; return the id of the scenario."""
    satellites = [
        post(
            api,
            "/v1/satellites",
            satellite(name=f"EYE-{i + 1}", tle=tle(90000 + 100 * num_days + i, raan_deg=30.0 * i)),
        )
        for i in range(num_satellites)
    ]
    stations = [post(api, "/v1/ground-stations", one) for one in demo_mission.GROUND_STATIONS]
    catalog = api.post(
        "/v1/target-catalogs?name=Two+thousand",
        content=demo_mission.targets_csv(2000),
        headers={"Content-Type": "text/csv"},
    ).json()
    scenario = {
        "name": f"{num_satellites} satellites for {num_days} days",
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": f"2026-03-{1 + num_days:02}T00:00:00Z"},
        "satellite_ids": [one["id"] for one in satellites],
        "target_catalog_ids": [catalog["id"]],
        "ground_station_ids": [one["id"] for one in stations],
    }
    return str(post(api, "/v1/scenarios", scenario)["id"])


def planned(
    api: httpx.Client, scenario_id: str, solver: str = "rule", *, time_s: float = WITHIN_S
) -> Json:
    """Plan a scenario; return the job once it has ended."""
    body = {"scenario_id": scenario_id, "solver": solver, "limits": {"time_s": time_s}}
    job = post(api, "/v1/jobs", body)
    deadline_s = time.monotonic() + WITHIN_S
    while job["state"] in ("queued", "running"):
        assert time.monotonic() < deadline_s, job
        job = api.get(f"/v1/jobs/{job['id']}?wait=10").json()
    assert job["state"] == "succeeded", job["error"]
    return job
