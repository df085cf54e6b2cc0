"""A new user's steps: upload satellites, targets and stations, plan, read the result."""

from __future__ import annotations

from pathlib import Path

import httpx

from tests.service.dashboard.browser.conftest import Browser
from tests.service.factories import tle

TARGETS = [("bern", 46.9, 7.4), ("quito", -0.2, -78.5), ("lagos", 6.5, 3.4), ("oslo", 59.9, 10.8)]


def upload(browser: Browser, kind: str, path: Path, text: str) -> None:
    """Choose a file, and wait for the page's summary of it."""
    path.write_text(text, encoding="utf-8")
    browser.find(f"#{kind}-file").send_keys(str(path))
    browser.wait(lambda: "Sending" not in browser.text(f"#{kind} .outcome"))
    browser.wait(lambda: browser.text(f"#{kind} .outcome"))


def fill_in(browser: Browser, files: Path) -> None:
    """Upload all that a plan needs."""
    browser.open("/new")
    browser.wait(lambda: browser.text("#params") is not None and browser.text("#solver-about"))
    upload(browser, "satellites", files / "eye.tle", "\n".join(["EYE", *tle(90200)]))
    assert "1 satellite accepted, 0 rejected" in browser.text("#satellites .outcome")
    rows = [f"{name},{lat},{lon},{number}" for number, (name, lat, lon) in enumerate(TARGETS, 1)]
    upload(browser, "targets", files / "towns.csv", "\n".join(["id,lat_deg,lon_deg,reward", *rows]))
    assert "4 targets accepted" in browser.text("#targets .outcome")
    upload(browser, "stations", files / "s.csv", "name,lat_deg,lon_deg\nSvalbard,78.23,15.39\n")
    assert "1 station accepted" in browser.text("#stations .outcome")


def test_from_files_to_a_timeline_in_the_browser_alone(
    browser: Browser, api: httpx.Client, files: Path
) -> None:
    fill_in(browser, files)
    # The orbit is old: its own day is suggested, in the page's format in any locale.
    assert browser.find("#horizon-start").get_attribute("value") == "2026-03-01 00:00:00"
    browser.find("#label").send_keys("first plan")
    browser.find("#collect-spacing").send_keys("60")
    browser.click("#send")
    path = browser.wait_for_answer()
    job, timeline = api.get(path).json(), api.get(f"{path}/timeline").json()
    assert (job["label"], job["solver"]) == ("first plan", "certified")
    assert timeline["horizon"]["start"] == "2026-03-01T00:00:00.000Z"
    scenario = api.get(job["links"]["scenario"]).json()
    assert (scenario["collect_spacing_s"], scenario["continuous_starts"]) == (60.0, False)
    totals = timeline["totals"]
    assert browser.text("[data-figure=reward] strong") == f"{totals['reward']:g}"
    assert browser.text("[data-figure=validity] strong") == timeline["validity"] == "valid"
    assert f"{totals['collects']} collected" in browser.text("[data-figure=targets]")
    assert browser.text("#job-about").endswith("2026-03-01 00:00:00 to 2026-03-02 00:00:00 UTC")


def test_a_file_with_mistakes_is_answered_with_their_lines(browser: Browser, files: Path) -> None:
    browser.open("/new")
    browser.wait(lambda: browser.text("#solver-about"))
    text = "id,lat_deg,lon_deg\nok,1,2\nfar,95,2\n"
    upload(browser, "targets", files / "bad.csv", text)
    assert "Line 3" in browser.text("#targets .outcome")
    # The browser itself logs a refusal; nothing else may be logged.
    said = browser.complaints()
    assert len(said) == 1
    assert "422" in said[0]


def test_a_satellite_is_entered_with_its_own_figures(browser: Browser, api: httpx.Client) -> None:
    browser.open("/new")
    browser.wait(lambda: browser.driver.find_elements("css selector", "#one-tle"))
    browser.click("#one-satellite > summary")
    browser.find("#one-name").send_keys("Own")
    browser.run("document.getElementById('one-tle').value = arguments[0]", "\n".join(tle(90300)))
    browser.find("#one-AgilityIn-slew_rate_deg_s").send_keys("2.5")
    browser.find("#one-SensorIn-off_nadir_max_deg").send_keys("40")
    browser.click("#satellite-form button")
    browser.wait(lambda: "Own (90300)" in browser.text("#satellites .choices"))
    (stored,) = api.get("/v1/satellites?norad_cat_id=90300").json()["items"]
    assert stored["agility"]["slew_rate_deg_s"] == 2.5
    assert stored["sensor"]["off_nadir_max_deg"] == 40.0
    # Empty fields take the values of the spacecraft's type.
    assert stored["sensor"]["sun_elevation_min_deg"] == 10.0
    assert browser.run(
        "return document.querySelector(`input[value='${arguments[0]}']`).checked", stored["id"]
    )


def test_parameters_of_a_solver_come_from_its_schema(browser: Browser, files: Path) -> None:
    fill_in(browser, files)
    browser.run(
        "const s = document.getElementById('solver'); s.value = 'mcts';"
        "s.dispatchEvent(new Event('change'))"
    )
    browser.click("#solver-params > summary")
    browser.find("#param-num_simulations").send_keys("7")
    browser.find("#param-depth").send_keys("0")
    browser.click("#send")
    # Below the schema's minimum: reported before anything is sent.
    browser.wait(lambda: "depth" in browser.text("#send-outcome"))
    assert browser.driver.current_url.endswith("/new")
    browser.find("#param-depth").clear()
    browser.click("#send")
    path = browser.wait_for_answer()
    with httpx.Client(base_url=browser.url, trust_env=False) as client:
        params = client.get(path).json()["params"]
    assert (params["num_simulations"], params["depth"]) == (7, 100)
