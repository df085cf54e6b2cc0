"""Working on a plan by clicks, and by keys alone: the collected wishes are what is requested."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import httpx
import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json, light_mission, planned
from tests.service.dashboard.browser.test_job_page import click_canvas, point_of
from tests.service.factories import post

MENU: Final = "[role=menu]"
MOST_TABS: Final = 2000


@pytest.fixture(scope="module")
def job(api: httpx.Client) -> Json:
    return planned(api, light_mission(api), "certified")


@pytest.fixture
def plan(api: httpx.Client, job: Json, browser: Browser) -> Json:
    """A new draft, on its page."""
    made: Json = post(api, "/v1/plans", {"job_id": job["id"]})
    browser.open(f"/plans/{made['id']}")
    browser.wait(lambda: browser.text("#tables summary"), "no tables")
    browser.wait(lambda: browser.drawn("gantt") and browser.drawn("map"), "no pictures")
    browser.run("document.querySelector('#replan-time').value = 200")
    return made


def actions_of(api: httpx.Client, plan: Json, mode: str) -> list[Json]:
    found = api.get(f"/v1/plans/{plan['id']}/actions", params={"limit": "500"}).json()["items"]
    return sorted((one for one in found if one["mode"] == mode), key=lambda one: one["start"])


def places(api: httpx.Client, plan: Json) -> list[Json]:
    """Return the targets as the map has them."""
    features = api.get(f"/v1/plans/{plan['id']}/timeline.geojson").json()["features"]
    return [
        one["properties"] | dict(zip(("lon", "lat"), one["geometry"]["coordinates"], strict=True))
        for one in features
        if one["properties"]["kind"] == "target"
    ]


def asked(api: httpx.Client, plan: Json) -> Json:
    """Return the scenario of a plan, expanded."""
    scenario_id = api.get(f"/v1/jobs/{plan['job_id']}").json()["scenario"]["id"]
    file: Json = api.get(f"/v1/scenarios/{scenario_id}?expand=true").json()
    return file


def spans(pins: list[Json]) -> set[tuple[str, str]]:
    return {(one["target_id"] or one["station_id"], one["start"]) for one in pins}


def span(action: Json) -> tuple[str, str]:
    return action["target_id"] or action["station_id"], action["start"]


def choose_in_table(browser: Browser, table: int, text: str, offer: str) -> None:
    """Click a line of a table, and an entry of its menu."""
    script = """
      const details = document.querySelectorAll("#tables > details")[arguments[0]];
      details.open = true;
      const all = [...details.querySelectorAll("button")];
      const found = all.find((one) => one.textContent === arguments[1]);
      if (!found) all.find((one) => one.textContent === "All" && !one.disabled)?.click();
      found?.scrollIntoView({block: "center"});
      return found;
    """
    browser.wait(lambda: browser.run(script, table, text), f"no line of {text}")
    browser.run(script, table, text).click()
    browser.click(f"{MENU} [data-offer={offer}]")
    browser.wait(lambda: not browser.text(MENU), "the menu stays open")


def proposal(browser: Browser, api: httpx.Client, plan: Json, ask: Callable[[], object]) -> Json:
    """Request the replan; return the proposed draft."""
    ask()
    browser.wait(lambda: browser.text("#proposal-changes"), "no proposal")
    drafts = api.get("/v1/plans", params={"state": "draft", "limit": "500"}).json()["items"]
    (made,) = [one for one in drafts if one["parent_id"] == plan["id"]]
    return dict(made)


def alone_on_the_map(targets: list[Json], width: float) -> Json:
    """Return a target without image that is far from all others, in pixels of the map."""
    scale = width / 360

    def is_near(one: Json, other: Json) -> bool:
        away = max(abs(one["lon"] - other["lon"]), abs(one["lat"] - other["lat"])) * scale
        return one is not other and away < 4

    left_out = [one for one in targets if one["action_id"] is None and abs(one["lat"]) < 70]
    return next(one for one in left_out if not any(is_near(one, other) for other in targets))


def test_a_plan_is_worked_on_by_clicks(browser: Browser, api: httpx.Client, plan: Json) -> None:
    collects, contacts = actions_of(api, plan, "collect"), actions_of(api, plan, "contact")
    timeline = api.get(f"/v1/plans/{plan['id']}/timeline.json").json()
    by_id = {one["id"]: one for one in (*collects, *contacts)}

    click_canvas(browser, "gantt", *point_of(browser, timeline, collects[0]))
    browser.click(f"{MENU} [data-offer=keep]")
    kept = by_id[browser.run("return document.querySelector('#action-choice').value")]
    skipped, dropped, promised, *_ = (
        one for one in reversed(collects) if one["target_id"] != kept["target_id"]
    )
    choose_in_table(browser, 1, skipped["id"], "skip")
    choose_in_table(browser, 1, dropped["id"], "drop")
    choose_in_table(browser, 0, promised["target_id"], "promise")
    choose_in_table(browser, 1, contacts[0]["id"], "keep")

    # A contradicting wish replaces a line; a removed line is gone.
    before = browser.text("#wishes")
    choose_in_table(browser, 1, promised["id"], "drop")
    assert f"Promised: {promised['target_id']}" not in browser.text("#wishes")
    choose_in_table(browser, 0, promised["target_id"], "promise")
    assert sorted(browser.text("#wishes").splitlines()) == sorted(before.splitlines())

    size = browser.find("#map canvas").size
    lone = alone_on_the_map(places(api, plan), size["width"])
    scale = size["width"] / 360
    x, y = size["width"] / 2 + lone["lon"] * scale, size["height"] / 2 - lone["lat"] * scale
    click_canvas(browser, "map", x, y)
    offers = "return [...document.querySelectorAll('[role=menuitem]')].map((o) => o.dataset.offer)"
    assert browser.run(offers) == ["promise", "priority"]
    browser.click(f"{MENU} [data-offer=priority]")
    browser.wait(lambda: browser.text("#priority-title") == f"Priority of {lone['target_id']}")
    given = browser.find("#priority-input")
    assert float(given.get_attribute("value") or "nan") == lone["reward"]
    given.clear()
    given.send_keys("77.5")
    browser.click("#priority-form button[type=submit]")
    browser.wait(lambda: f"Priority of {lone['target_id']}: 77.5." in browser.text("#wishes"))

    next_plan = proposal(browser, api, plan, lambda: browser.click("#replan"))
    question = asked(api, next_plan)
    assert spans(question["pins"]["keep"]) == {span(kept), span(contacts[0])}
    assert spans(question["pins"]["skip"]) == {span(skipped)}
    assert question["pins"]["forbid"] == [dropped["target_id"]]
    assert [one["target_id"] for one in question["replan"]["promises"]] == [promised["target_id"]]
    weights = {one["id"]: one["reward"] for one in question["targets"]}
    assert weights[lone["target_id"]] == 77.5

    browser.click("#take-proposal")
    browser.wait(lambda: next_plan["id"] in browser.driver.current_url, "it is not taken")
    for to in ("approved", "published"):
        browser.click(f"#step-{to}")
        browser.wait(lambda to=to: browser.text("#plan-state") == to, f"not {to}")  # type: ignore[misc]
    published = api.get("/v1/plans", params={"state": "published"}).json()["items"]
    assert next_plan["id"] in {one["id"] for one in published}
    images = {one["target_id"] for one in actions_of(api, next_plan, "collect")}
    assert {kept["target_id"], promised["target_id"]} <= images
    assert dropped["target_id"] not in images


def test_a_plan_is_worked_on_by_keys_alone(browser: Browser, api: httpx.Client, plan: Json) -> None:
    def press(*keys: str) -> None:
        ActionChains(browser.driver).send_keys(*keys).perform()

    def has_focus(selector: str) -> bool:
        return bool(browser.run("return document.activeElement.matches(arguments[0])", selector))

    def tab_to(selector: str) -> None:
        for _ in range(MOST_TABS):
            if has_focus(selector):
                return
            press(Keys.TAB)
        pytest.fail(f"Tab does not get to {selector}")

    def chosen() -> str:
        return str(browser.run("return document.querySelector('#action-choice').value"))

    actions = {
        one["id"]: one for mode in ("collect", "contact") for one in actions_of(api, plan, mode)
    }
    tab_to("#gantt canvas")
    press(Keys.ENTER)
    # Turns to the sun are selected as well, and have no menu.
    while chosen() not in actions or actions[chosen()]["mode"] != "collect":
        press(Keys.ENTER)
    skipped = actions[chosen()]
    press(Keys.SPACE)
    assert has_focus(f"{MENU} [data-offer=keep]")
    press(Keys.ARROW_UP)
    assert has_focus(f"{MENU} [data-offer=priority]")
    press(Keys.ESCAPE)
    assert has_focus("#gantt canvas")
    assert chosen() == skipped["id"]
    press(Keys.SPACE, Keys.ARROW_DOWN, Keys.ENTER)
    assert has_focus("#gantt canvas")
    assert skipped["target_id"] in browser.text("#wishes")

    left_out = {one["target_id"] for one in places(api, plan) if one["action_id"] is None}
    tab_to("#map canvas")
    press(Keys.ENTER)
    while (target := browser.text("#chosen-action p").split(":")[0]) not in left_out:
        press(Keys.ENTER)
    press(Keys.SPACE, Keys.END, Keys.ENTER)
    browser.wait(lambda: browser.text("#priority-title") == f"Priority of {target}", "no dialog")
    press("3", Keys.ENTER)
    browser.wait(lambda: f"Priority of {target}: 3." in browser.text("#wishes"), "no priority")
    assert has_focus("#map canvas")

    tab_to("#wishes li:last-child button")
    press(Keys.ENTER)
    assert f"Priority of {target}" not in browser.text("#wishes")
    assert has_focus("#wishes li:last-child button")
    tab_to("#replan")
    next_plan = proposal(browser, api, plan, lambda: press(Keys.ENTER))
    question = asked(api, next_plan)
    assert (spans(question["pins"]["skip"]), question["pins"]["keep"]) == ({span(skipped)}, [])
    browser.wait(lambda: has_focus("#take-proposal"), "the proposal has no focus")
    tab_to("#drop-proposal")
    press(Keys.ENTER)
    browser.wait(lambda: "withdrawn" in browser.text("#replan-progress"), "it is not withdrawn")
    assert api.get(f"/v1/plans/{next_plan['id']}").json()["state"] == "withdrawn"
    # The wishes are still there, to be requested differently.
    assert skipped["target_id"] in browser.text("#wishes")
