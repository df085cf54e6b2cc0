"""Obstacles that the first users of the pages met: texts, keys, clipped links."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import httpx
import pytest
from selenium.webdriver import Keys

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json, planned, small_mission
from tests.service.factories import post
from tests.service.test_first_impressions import JARGON


@pytest.fixture(scope="module")
def scenario_id(api: httpx.Client) -> str:
    return small_mission(api)


@pytest.fixture(scope="module")
def job(api: httpx.Client, scenario_id: str) -> Json:
    return planned(api, scenario_id)


@pytest.fixture(scope="module")
def timeline(api: httpx.Client, job: Json) -> Json:
    document: Json = api.get(f"/v1/jobs/{job['id']}/timeline").json()
    return document


def open_job(browser: Browser, job: Json) -> None:
    browser.open(f"/jobs/{job['id']}")
    browser.wait_for_answer()


def test_a_clock_moves_while_a_job_runs_and_nothing_else_does(
    browser: Browser, api: httpx.Client, scenario_id: str
) -> None:
    body = {
        "scenario_id": scenario_id,
        "solver": "mcts",
        "params": {"num_simulations": 100_000},
        "limits": {"time_s": 600},
    }
    job = post(api, "/v1/jobs", body)
    browser.open(f"/jobs/{job['id']}")
    browser.wait(lambda: "Phase solve" in browser.text("#progress-text"), "no phase")
    # From here on the service reports nothing new.
    browser.run("window.fetch = () => new Promise(() => {})")
    told = {browser.text("#progress-text")}

    def grows() -> bool:
        told.add(browser.text("#progress-text"))
        return len(told) >= 4

    browser.wait(grows, "the text stands still")
    clock = r"(\d\d):(\d\d):(\d\d)"
    text = re.compile(rf"Phase solve.* for {clock}; the search ends within {clock}$")
    for one in told:
        found = text.search(one)
        assert found, one
        h, m, s, to_go_h, to_go_m, to_go_s = (int(digits) for digits in found.groups())
        # Two clocks with whole seconds.
        sum_s = 3600 * (h + to_go_h) + 60 * (m + to_go_m) + s + to_go_s
        assert sum_s in (599, 600)
    api.post(f"/v1/jobs/{job['id']}/cancel").raise_for_status()


def test_enter_selects_in_the_chart_in_the_table_and_in_lists(
    browser: Browser, job: Json, timeline: Json
) -> None:
    open_job(browser, job)
    chart = browser.find("#gantt canvas")
    actions = sorted(timeline["satellites"][0]["actions"], key=lambda one: one["start"])
    for action in (actions[0], actions[1]):
        chart.send_keys(Keys.ENTER)
        browser.wait(partial(selects, browser, action["id"]), "Enter selects nothing")
    chart.send_keys(Keys.SHIFT, Keys.ENTER)
    browser.wait(partial(selects, browser, actions[0]["id"]), "it does not go back")

    browser.click("#tables > details:nth-of-type(1) > summary")
    browser.wait(lambda: browser.text("#tables tbody"))
    collect = [one for one in actions if one["mode"] == "collect"][-1]
    browser.find("#target-find").send_keys(collect["target_id"], Keys.ENTER)
    browser.wait(lambda: browser.text("#selected-target") == collect["target_id"])

    browser.open("/new")
    browser.wait(lambda: browser.text("#satellites .choices label"), "no satellites")
    box = browser.find("#satellites .choices label input[value]")
    before = box.is_selected()
    box.send_keys(Keys.ENTER)
    assert box.is_selected() != before
    box.send_keys(Keys.ENTER)
    assert box.is_selected() == before


def selects(browser: Browser, action_id: str) -> bool:
    return browser.text("#selected-action").startswith(f"{action_id},")


# Whatever is cut off: by the edge of the screen, or by a part of the page that does not scroll.
CLIPPED = """
return [...document.querySelectorAll("a[href], button, summary")].filter((one) => {
  if (!one.checkVisibility() || one.matches(".skip, .hidden-text")) return false;
  for (let frame = one.parentElement; frame; frame = frame.parentElement) {
    if (getComputedStyle(frame).overflowX === "auto") return false;
  }
  const box = one.getBoundingClientRect();
  return box.left < 0 || box.right > document.documentElement.clientWidth ||
    one.scrollWidth > one.clientWidth + 1 && getComputedStyle(one).display !== "inline";
}).map((one) => one.innerText);
"""


@pytest.mark.parametrize("width", [390, 800, 1280, 1920])
def test_no_link_and_no_button_is_clipped(browser: Browser, job: Json, width: int) -> None:
    size = {"width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        open_job(browser, job)
        assert browser.run(CLIPPED) == []
        for path in ("/", "/new", "/plans", "/targets", "/fleet"):
            browser.open(path)
            browser.wait(lambda: "ready," in browser.text("#service-status"))
            assert browser.run(CLIPPED) == []
    finally:
        browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


TOO_WIDE = """
return [...document.querySelectorAll(".scroll")]
  .filter((one) => one.checkVisibility() && one.scrollWidth > one.clientWidth + 1)
  .map((one) => one.getAttribute("aria-label") ?? one.innerText.slice(0, 80));
"""


def test_on_a_laptop_no_table_goes_over_the_edge(browser: Browser, job: Json) -> None:
    size = {"width": 1280, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        open_job(browser, job)
        browser.run("for (const one of document.querySelectorAll('details')) one.open = true")
        browser.wait(lambda: browser.text("#tables > details:nth-of-type(2) tbody"))
        assert browser.run(TOO_WIDE) == []
    finally:
        browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_contact_is_told_by_the_name_of_its_station(
    browser: Browser, job: Json, timeline: Json
) -> None:
    actions = timeline["satellites"][0]["actions"]
    contact = next(one for one in actions if one["mode"] == "contact")
    open_job(browser, job)
    browser.click("#tables > details:nth-of-type(2) > summary")
    rows = "#tables > details:nth-of-type(2) tbody"
    browser.wait(lambda: contact["station_name"] in browser.text(rows), "no name")
    assert contact["station_id"] not in browser.text(rows)


def test_a_plan_that_breaks_limits_is_not_green_in_the_list(
    browser: Browser, api: httpx.Client, scenario_id: str
) -> None:
    body = {"scenario_id": scenario_id, "solver": "graph", "params": {"feasibility": "penalty"}}
    job = post(api, "/v1/jobs", body)
    while job["state"] in ("queued", "running"):
        job = api.get(f"/v1/jobs/{job['id']}?wait=10").json()
    assert (job["state"], job["validity"]) == ("succeeded", "violations")
    browser.open("/")
    badge = f"tr[data-job='{job['id']}'] .state"
    browser.wait(lambda: "breaks limits" in browser.text(badge), "nothing is said")
    color = "return getComputedStyle(document.querySelector(arguments[0])).color"
    bad = "return getComputedStyle(document.documentElement).getPropertyValue('--bad')"
    probe = (
        f"const bad = (() => {{ {bad} }})(); const one = document.createElement('i');"
        "one.style.color = bad; document.body.append(one); return getComputedStyle(one).color"
    )
    assert browser.run(color, badge) == browser.run(probe)


def test_a_priority_column_is_spoken_of(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "urgent.csv"
    file.write_text("id,lat_deg,lon_deg,priority\nharbour,53.54,9.98,9\n")
    browser.open("/new")
    browser.wait(lambda: browser.text("#solver-about"))
    browser.find("#targets-file").send_keys(str(file))
    browser.wait(lambda: "1 target accepted." in browser.text("#targets .outcome"), "no answer")
    assert "Not used: priority." in browser.text("#targets .outcome")
    assert "column reward" in browser.text("#targets .outcome")


def test_the_form_speaks_of_solvers_in_operators_words(browser: Browser) -> None:
    browser.open("/new")
    browser.wait(lambda: browser.text("#solver-about"))
    names = browser.run("return [...document.querySelector('#solver').options].map((o) => o.value)")
    assert "certified" in names
    browser.click("#solver-params > summary")
    choose = """
      const choice = document.querySelector("#solver");
      choice.value = arguments[0];
      choice.dispatchEvent(new Event("change"));
      return document.querySelector("main").innerText;
    """
    for name in names:
        text = browser.run(choose, name)
        assert [phrase for phrase in JARGON if re.search(phrase, text)] == []
        assert "undefined" not in text
