"""A shift: the wall, hand-over, a lost pass, a replan, its changes, approval, print."""

from __future__ import annotations

import base64
import re
from datetime import datetime
from typing import Any

import httpx
import pytest
from selenium.webdriver.common.keys import Keys

from service.wire.instants import instant_text
from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json, light_mission, planned


@pytest.fixture(scope="module")
def job(api: httpx.Client) -> Json:
    return planned(api, light_mission(api), "certified")


def listed(api: httpx.Client, address: str, **query: str) -> list[Json]:
    items: list[Json] = api.get(address, params={"limit": "500"} | query).json()["items"]
    return items


def plan_id_of(browser: Browser) -> str:
    return browser.driver.current_url.rpartition("/")[2]


def state(browser: Browser) -> str:
    return browser.text("#plan-state")


def step(browser: Browser, to: str, wanted: str) -> None:
    browser.click(f"#step-{to}")
    browser.wait(lambda: state(browser) == wanted, f"the plan does not get {wanted}")


def take_over(browser: Browser, job: Json) -> str:
    """Go from the job to a published plan; return the plan's id."""
    browser.open(f"/jobs/{job['id']}")
    browser.click("#take")
    browser.wait(lambda: "/plans/" in browser.driver.current_url, "no page of a plan")
    browser.wait(lambda: state(browser) == "draft", "no draft")
    step(browser, "approved", "approved")
    step(browser, "published", "published")
    return plan_id_of(browser)


def test_a_shift(browser: Browser, api: httpx.Client, job: Json) -> None:
    browser.open("/wall")
    browser.wait(lambda: browser.text("#wall-status") or browser.text("#wall-passes"), "no wall")
    plan_id = take_over(browser, job)
    watch_the_wall(browser, api, plan_id)
    browser.open(f"/plans/{plan_id}")
    actions = listed(api, f"/v1/plans/{plan_id}/actions")
    contacts = sorted((a for a in actions if a["mode"] == "contact"), key=lambda a: a["start"])
    lost = contacts[len(contacts) // 2]
    browser.wait(lambda: browser.drawn("gantt"), "no timeline")
    choose(browser, lost)
    browser.find("#report-detail").send_keys("No lock on the carrier")
    browser.click("#report-failed")
    browser.wait(lambda: browser.text("#chosen-action p").endswith(", failed"), "not reported")
    (report,) = listed(api, f"/v1/plans/{plan_id}/executions")
    told = (report["action_id"], report["outcome"], report["detail"])
    assert told == (lost["id"], "failed", "No lock on the carrier")
    browser.click("#wish-lose")
    assert "Lost:" in browser.text("#wishes")
    browser.run("document.querySelector('#replan-time').value = 200")
    browser.click("#replan")
    browser.wait(lambda: browser.text("#proposal-changes"), "no proposal")
    assert re.search(r"removed\s+contact", browser.text("#proposal-changes"))
    published = listed(api, "/v1/plans", state="published")
    assert [plan["id"] for plan in published] == [plan_id]
    browser.click("#take-proposal")
    browser.wait(lambda: plan_id_of(browser) != plan_id, "no page of the new plan")
    browser.wait(lambda: state(browser) == "draft", "no draft of the replan")
    changes = api.get(f"/v1/plans/{plan_id_of(browser)}/changes").json()["items"]
    assert lost["id"] in {item["parent_action"]["id"] for item in changes if item["parent_action"]}
    browser.wait(lambda: browser.text("#changes"), "no changes on its page")
    step(browser, "approved", "approved")
    step(browser, "published", "published")
    assert [plan["id"] for plan in listed(api, "/v1/plans", state="published")] == [
        plan_id_of(browser)
    ]
    print_the_passes(browser, api)
    next_plan = plan_id_of(browser)
    watch_the_wall(browser, api, next_plan)
    browser.wait(lambda: "changed after" in browser.text("#wall-changes"), "no changes")
    browser.wait(lambda: browser.drawn("wall-map"), "no map")


def choose(browser: Browser, action: Json) -> None:
    script = """
      const choice = document.querySelector("#action-choice");
      choice.value = arguments[0];
      choice.dispatchEvent(new Event("change"));
      return choice.value;
    """
    browser.wait(lambda: browser.run(script, action["id"]) == action["id"], "no such action")


def print_the_passes(browser: Browser, api: httpx.Client) -> None:
    plan = api.get(f"/v1/plans/{plan_id_of(browser)}").json()
    start = datetime.fromisoformat(plan["horizon"]["start"])
    shift = {
        "from": instant_text(start),
        "to": instant_text(start.replace(hour=start.hour + 8)),
        "limit": "500",
    }
    script = """
      document.querySelector("#passes-from").value = arguments[0];
      document.querySelector("#passes-hours").value = 8;
    """
    browser.run(script, shift["from"])
    browser.click("#pass-filters button[type=submit]")
    wanted: list[Any] = api.get(f"/v1/plans/{plan['id']}/passes", params=shift).json()["items"]
    rows = "return document.querySelectorAll('#passes tbody tr').length"
    browser.wait(lambda: browser.run(rows) == len(wanted) > 0, "not the passes of the shift")
    browser.run("window.print = () => {}")
    browser.click("#print-passes")
    paper = browser.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": False})
    pages = len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(paper["data"])))
    assert 1 <= pages <= 2


def watch_the_wall(browser: Browser, api: httpx.Client, plan_id: str) -> None:
    plan = api.get(f"/v1/plans/{plan_id}").json()
    start = datetime.fromisoformat(plan["horizon"]["start"])
    browser.open(f"/wall#at={instant_text(start.replace(hour=start.hour + 6))}")
    browser.wait(lambda: "AOS" in browser.text("#wall-passes"), "no countdown")
    satellites = browser.text("#wall-satellites")
    assert all(one["satellite_name"] in satellites for one in plan["satellites"])
    assert satellites.count("%") == 2 * len(plan["satellites"])
    before = browser.text("#wall-passes")
    browser.wait(lambda: browser.text("#wall-passes") != before, "the countdown stands still")


def test_the_wall_outlasts_a_service_that_does_not_answer(browser: Browser, job: Json) -> None:
    browser.open("/wall")
    browser.wait(lambda: browser.text("#wall-status") or browser.text("#wall-passes"), "no wall")
    # The page itself stays; its requests fail as when the service is down.
    browser.run(
        """
        window.realFetch = window.fetch;
        window.fetch = () => Promise.reject(new TypeError("Failed to fetch"));
        """
    )
    browser.wait(lambda: "No answer since" in browser.text("#wall-status"), "it does not tell")
    browser.run("window.fetch = window.realFetch")
    browser.wait(lambda: "No answer" not in browser.text("#wall-status"), "it does not come back")


def test_a_station_is_changed_and_reported_as_out(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    station = listed(api, "/v1/ground-stations")[0]
    address = f"/v1/ground-stations/{station['id']}"
    browser.open("/fleet")
    choice = f"#thing option[value='{address}']"
    browser.wait(lambda: browser.driver.find_elements("css selector", choice), "no station")
    browser.run(
        """
        const thing = document.querySelector("#thing");
        thing.value = arguments[0];
        thing.dispatchEvent(new Event("change"));
        """,
        address,
    )
    mask = "[data-path=min_elevation_deg]"
    browser.wait(lambda: browser.driver.find_elements("css selector", mask), "no field")
    browser.find(mask).clear()
    browser.find(mask).send_keys("12.5")
    browser.click("#edit-form button")
    browser.wait(lambda: browser.text("#edit-status") == "Saved.", "it is not saved")
    assert api.get(address).json() == station | {"min_elevation_deg": 12.5}
    browser.click("#edit-form button")
    browser.wait(lambda: browser.text("#edit-status") == "Nothing to save.", "it changed")
    browser.run(
        "document.querySelector('#outage-of').value = arguments[0]", f"station_id {station['id']}"
    )
    browser.find("#outage-reason").send_keys("Antenna in service")
    browser.click("#outage-form button")
    browser.wait(lambda: "Antenna in service" in browser.text("#outages"), "no outage")
    (outage,) = listed(api, "/v1/outages", station_id=station["id"])
    assert outage["reason"] == "Antenna in service"
    browser.click("#outages tbody button")
    browser.wait(lambda: "Antenna in service" not in browser.text("#outages"), "it is still there")
    assert listed(api, "/v1/outages", station_id=station["id"]) == []
    api.patch(address, json={"min_elevation_deg": station["min_elevation_deg"]}).raise_for_status()


def test_priorities_of_targets_are_changed(browser: Browser, api: httpx.Client) -> None:
    rows = "".join(f"p{i},Place {i},{i // 2},{i}\n" for i in range(150))
    catalog = api.post(
        "/v1/target-catalogs?name=Places",
        content=f"id,name,lat_deg,lon_deg\n{rows}",
        headers={"Content-Type": "text/csv"},
    ).json()
    browser.open("/targets")
    option = f"#catalog option[value='{catalog['id']}']"
    browser.wait(lambda: browser.driver.find_elements("css selector", option), "no catalogue")
    browser.find(option).click()
    browser.wait(lambda: browser.text("#count") == "150 of 150 targets", "not its targets")
    # Only one page of them is in the document: typed text survives changing pages.
    for name, priority in (("Place 7 (", "12.5"), ("Place 149", "3")):
        browser.find("#find").clear()
        browser.find("#find").send_keys(name)
        browser.wait(lambda: browser.text("#count") == "1 of 150 targets", "not narrowed")
        field = browser.find("#targets input.priority")
        field.clear()
        field.send_keys(priority)
    assert browser.text("#priorities-status") == "2 changes not saved yet."
    field.send_keys(Keys.ENTER)
    browser.wait(lambda: browser.text("#priorities-status") == "2 priorities saved.", "not saved")
    targets = listed(api, catalog["links"]["targets"])
    changed = {one["id"]: one["reward"] for one in targets if one["reward"] != 1}
    assert changed == {"p7": 12.5, "p149": 3}
    assert "Place 149 (p149)" in browser.text("#targets")


def test_an_image_that_came_in_part_is_reported_with_what_there_is_of_it(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    plan_id = take_over(browser, job)
    browser.wait(lambda: browser.drawn("gantt"), "no timeline")
    actions = listed(api, f"/v1/plans/{plan_id}/actions")
    image = min((a for a in actions if a["mode"] == "collect"), key=lambda a: a["start"])
    choose(browser, image)
    browser.find("#report-mbit").send_keys("12.5")
    browser.find("#report-detail").send_keys("The last lines are missing")
    browser.click("#report-partial")
    browser.wait(lambda: browser.text("#chosen-action p").endswith(", partial"), "not reported")
    (report,) = listed(api, f"/v1/plans/{plan_id}/executions")
    told = {name: report[name] for name in ("action_id", "outcome", "mbit", "detail")}
    assert told == {
        "action_id": image["id"],
        "outcome": "partial",
        "mbit": 12.5,
        "detail": "The last lines are missing",
    }
    listed_as = f"return document.querySelector('#action-choice option[value=\"{image['id']}\"]')"
    assert browser.run(f"{listed_as}.text").endswith(", partial")
    (now,) = (a for a in listed(api, f"/v1/plans/{plan_id}/actions") if a["id"] == image["id"])
    assert now["outcome"] == "partial"
