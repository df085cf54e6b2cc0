"""A clear-sky forecast is uploaded and selected in the form, and the plan uses it."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import httpx

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.test_first_plan import upload
from tests.service.factories import EPOCH, tle
from tests.service.forecasts.test_files import netcdf

TARGETS = [("bern", 46.9, 7.4), ("oslo", 59.9, 10.8)]
CLEAR = {"bern": 0.25, "oslo": 0.75}


def take(browser: Browser, file: Path) -> str:
    """Upload a forecast; return the page's summary of it."""
    browser.find("#forecast-file").send_keys(str(file))
    outcome = "#forecast-outcome .notice"
    browser.wait(lambda: browser.text(outcome), "nothing is said of the forecast")
    return browser.text(outcome)


def test_a_plan_goes_by_the_forecast_that_is_uploaded(
    browser: Browser, api: httpx.Client, files: Path
) -> None:
    browser.open("/new")
    browser.wait(lambda: browser.text("#solver-about"))
    browser.wait(lambda: "every sky counts as clear" in browser.text("#forecast-choice"))
    upload(browser, "satellites", files / "e.tle", "\n".join(["EYE", *tle(93101)]))
    rows = "".join(f"{name},{lat},{lon}\n" for name, lat, lon in TARGETS)
    upload(browser, "targets", files / "two.csv", f"id,lat_deg,lon_deg\n{rows}")
    times = [(EPOCH + timedelta(days=day)).isoformat() for day in (-1, 2)]
    lines = [f"{name},{at},{CLEAR[name]}" for name in CLEAR for at in times]
    file = files / "skies.csv"
    file.write_text("\n".join(["target_id,time,clear_probability", *lines]), encoding="utf-8")
    assert "4 values of 2 targets accepted, 2026-02-28" in take(browser, file)
    (stored,) = api.get("/v1/forecasts").json()["items"]
    assert stored["name"] == "skies"
    assert browser.find("#forecast-choice").get_attribute("value") == stored["id"]
    browser.find("#use-resources").click()
    browser.click("#send")
    path = browser.wait_for_answer()
    scenario = api.get(api.get(path).json()["links"]["scenario"]).json()
    assert scenario["forecast_id"] == stored["id"]
    (one,) = api.get(f"{path}/timeline").json()["satellites"]
    collects = [action for action in one["actions"] if action["mode"] == "collect"]
    assert collects
    for action in collects:
        assert action["clear_probability"] == CLEAR[action["target_id"]]
    api.delete(f"/v1/forecasts/{stored['id']}").raise_for_status()


def test_netcdf_is_taken_and_what_it_leaves_out_counts_as_told(
    browser: Browser, api: httpx.Client, files: Path
) -> None:
    file = files / "europe.nc"
    file.write_bytes(netcdf())
    browser.open("/new")
    browser.wait(lambda: browser.text("#solver-about"))
    browser.find("#forecast-otherwise").send_keys("0.5")
    said = take(browser, file)
    (stored,) = api.get("/v1/forecasts").json()["items"]
    assert (stored["name"], stored["default_clear_probability"]) == ("europe", 0.5)
    assert stored["kind"] == "grid"
    assert f"A grid of {stored['num_values']} values accepted" in said
    assert all(note in said for note in stored["notes"])
    api.delete(f"/v1/forecasts/{stored['id']}").raise_for_status()


def test_a_forecast_that_cannot_be_read_is_told_with_its_line(
    browser: Browser, api: httpx.Client, files: Path
) -> None:
    file = files / "wrong.csv"
    rows = "oslo,2026-03-01T00:00:00Z,0.5\noslo,2026-03-02T00:00:00Z,1.5\n"
    file.write_text(f"target_id,time,clear_probability\n{rows}", encoding="utf-8")
    browser.open("/new")
    browser.wait(lambda: browser.text("#solver-about"))
    assert "Line 3" in take(browser, file)
    assert api.get("/v1/forecasts").json()["items"] == []
    browser.driver.get_log("browser")  # type: ignore[no-untyped-call]  # of the refusal
