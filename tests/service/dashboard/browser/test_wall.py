"""The wall during a restart of the service: real processes on one database and one port."""

from __future__ import annotations

import contextlib
import socket
from pathlib import Path

import httpx
from selenium import webdriver

from service.commands import demo_mission
from tests.patience import PATIENCE_S
from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.crowd import CUT_OFF, SCREENS, show_at
from tests.service.dashboard.browser.missions import Json, planned, small_mission
from tests.service.factories import post
from tests.service.serving import serving

AT = demo_mission.HORIZON["start"].replace("T00", "T06")

LEAST_MAP_SHARE = 0.3
MAP_SHARE = """
const box = document.querySelector("#wall-map canvas").getBoundingClientRect();
return box.width * box.height / (innerWidth * innerHeight);
"""


def published(api: httpx.Client) -> Json:
    """Plan the small mission and put the plan in force."""
    job = planned(api, small_mission(api))
    plan = post(api, "/v1/plans", {"job_id": job["id"]})
    path = f"/v1/plans/{plan['id']}/transitions"
    post(api, path, {"to": "approved"})
    return post(api, path, {"to": "published", "effective_from": plan["horizon"]["start"]})


def client(url: str) -> httpx.Client:
    return httpx.Client(base_url=url, timeout=PATIENCE_S, trust_env=False)


def free_port() -> str:
    """Return a port that no other program's connection is given while the service is down."""
    for port in range(20_000, 32_000):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return str(port)
    raise OSError("no port is free")


def test_the_wall_comes_back_by_itself_when_the_service_does(
    driver: webdriver.Chrome, tmp_path: Path
) -> None:
    port = free_port()
    with serving(tmp_path, "serve", "--workers", "1", "--port", port) as (_, line):
        url = line.split()[-1]
        with client(url) as api:
            plan = published(api)
        wall = Browser(driver=driver, url=url)
        wall.watch()
        wall.open(f"/wall#at={AT}")
        wall.wait(lambda: "OS" in wall.text("#wall-passes"), "no countdown")
        wall.run("window.nobodyTouchedIt = true")
        for size in SCREENS:
            show_at(wall, *size)
            wall.wait(lambda: wall.run(CUT_OFF) == [], f"cut off at {size}")
            wall.wait(lambda: wall.run(MAP_SHARE) > LEAST_MAP_SHARE, f"much is empty at {size}")
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    wall.wait(lambda: "No answer since" in wall.text("#wall-status"), "it does not tell")
    # It keeps showing what it knows.
    before = wall.text("#wall-passes")
    wall.wait(lambda: wall.text("#wall-passes") != before, "the countdown stands still")
    assert "%" in wall.text("#wall-satellites")
    with serving(tmp_path, "serve", "--workers", "1", "--port", port) as (_, line):
        assert line.split()[-1] == url
        wall.wait(lambda: "No answer" not in wall.text("#wall-status"), "it does not come back")
        with client(url) as api:
            change = {"freeze_until": AT, "now": AT, "limits": {"time_s": 5}}
            job = post(api, f"/v1/plans/{plan['id']}/replans", change)
            while job["state"] in ("queued", "running"):
                job = api.get(f"/v1/jobs/{job['id']}?wait=10").json()
            path = f"{job['links']['plan']}/transitions"
            post(api, path, {"to": "approved"})
            post(api, path, {"to": "published", "effective_from": AT})
        wall.wait(lambda: "changed after" in wall.text("#wall-changes"), "nothing new is shown")
        assert "OS" in wall.text("#wall-passes")
        assert wall.run("return window.nobodyTouchedIt") is True
    # It may complain about a service that is gone or has no worker yet.
    expected = ("ERR_CONNECTION_REFUSED", "/health/ready")
    assert [one for one in wall.complaints() if not any(e in one for e in expected)] == []
