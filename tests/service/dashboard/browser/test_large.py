"""Many satellites, many targets: work depends on what is visible, not on what exists."""

from __future__ import annotations

from collections import Counter
from functools import partial
from urllib.parse import urlsplit

import httpx
import pytest
from selenium.webdriver import ActionChains

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json, large_mission, planned

MOVES = """
const [done] = arguments;
const canvas = document.querySelector("#gantt canvas");
const bars = [];
const painted = async (act) => {
  const before = canvas.dataset.drawn;
  act();
  while (canvas.dataset.drawn === before) await new Promise(requestAnimationFrame);
  bars.push(Number(canvas.dataset.bars));
};
(async () => {
  const right = "ArrowRight";
  for (const key of ["+", "+", "+", right, right, "ArrowLeft", "-", "+", "+", "Home"]) {
    await painted(() => canvas.dispatchEvent(new KeyboardEvent("keydown", { key })));
  }
  done(bars);
})();
"""
KINDS = 5  # collects, slews, contacts, sun-pointing, eclipses
NUM_TARGETS = 2000
PAGE = 100
TARGETS = "#tables > details:nth-of-type(1)"


@pytest.fixture(scope="module")
def job(api: httpx.Client) -> Json:
    return planned(api, large_mission(api))


@pytest.fixture(scope="module")
def crowded_job(api: httpx.Client) -> Json:
    """A job whose satellites leave most targets out."""
    return planned(api, large_mission(api, num_satellites=2, num_days=1))


def num_rows(browser: Browser, table: str) -> int:
    return len(browser.driver.find_elements("css selector", f"{table} tbody tr"))


def button(table: str, name: str) -> str:
    """Return the selector of a button of a table's pager."""
    order = ("First", "Earlier", "Later", "Last", "All")
    return f"{table} .pager button:nth-of-type({order.index(name) + 1})"


def test_a_large_timeline_is_shown_whole_and_moved_through(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    browser.open(f"/jobs/{job['id']}")
    path = browser.wait_for_answer()
    timeline = api.get(f"{path}/timeline").json()
    num_actions = sum(len(one["actions"]) for one in timeline["satellites"])
    assert num_actions > 4000
    bars = browser.driver.execute_async_script(MOVES)
    assert len(bars) == 10  # each move was drawn
    width = browser.run("return document.querySelector('#gantt canvas').clientWidth")
    assert min(bars) > 0
    assert max(bars) <= KINDS * len(timeline["satellites"]) * width
    # The busiest satellite has more actions than its lanes have pixels: some share a pixel.
    assert bars[-1] < num_actions + sum(len(one["eclipses"]) for one in timeline["satellites"])


def test_a_click_takes_an_action_of_the_row_that_it_is_on(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    browser.open(f"/jobs/{job['id']}")
    path = browser.wait_for_answer()
    timeline = api.get(f"{path}/timeline").json()
    canvas = browser.find("#gantt canvas")
    axis, height = 24, canvas.size["height"]
    row_height = (height - 2 * axis) / len(timeline["satellites"])
    busy = [
        (row, satellite["name"], action)
        for row, satellite in enumerate(timeline["satellites"])
        for action in satellite["actions"]
        if action["mode"] == "collect"
    ]
    for row, name, collect in (busy[0], busy[-1]):
        share = browser.run(
            "const [at, from, to] = [...arguments].map((one) => Date.parse(one));"
            "return (at - from) / (to - from)",
            *(collect["start"], timeline["horizon"]["start"], timeline["horizon"]["end"]),
        )
        x, y = 120 + share * (canvas.size["width"] - 132), axis + (row + 0.2) * row_height
        # The chart is as high as a screen: the row must be in view.
        browser.run(
            "arguments[0].scrollIntoView({block: arguments[1]})",
            canvas,
            "start" if row < 6 else "end",
        )
        chain = ActionChains(browser.driver)
        offset = round(x - canvas.size["width"] / 2), round(y - height / 2)
        chain.move_to_element_with_offset(canvas, *offset).click().perform()
        browser.wait(partial(tells_of, browser, name))
        browser.click("#zoom-all")


def tells_of(browser: Browser, satellite_name: str) -> bool:
    return satellite_name in browser.text("#selected dl:first-child").splitlines()


def test_nothing_large_is_asked_for_twice_and_outcomes_come_by_the_page(
    browser: Browser, api: httpx.Client, crowded_job: Json
) -> None:
    groups = Counter(
        one["properties"]["reason"]
        for one in api.get(f"/v1/jobs/{crowded_job['id']}/timeline.geojson").json()["features"]
        if one["properties"]["kind"] == "target" and one["properties"]["reason"]
    )
    code, count = groups.most_common(1)[0]
    assert count > 2 * PAGE
    browser.requests()
    browser.open(f"/jobs/{crowded_job['id']}")
    path = browser.wait_for_answer()
    group = f"#left-out details[data-reason={code}]"
    browser.wait(lambda: num_rows(browser, group) == PAGE)
    asked = [urlsplit(url) for url in browser.requests()]
    calls = Counter(url.path for url in asked if url.path.startswith(path))
    assert calls[f"{path}/timeline.json"] == calls[f"{path}/timeline.geojson"] == 1
    assert calls[f"{path}/targets"] == len(groups)
    assert all(f"limit={PAGE}" in url.query for url in asked if url.path == f"{path}/targets")

    browser.click(f"{group} > summary")
    browser.click(button(group, "Later"))
    browser.wait(lambda: f"Rows {PAGE + 1} to" in browser.text(f"{group} .pager"))
    assert num_rows(browser, group) == PAGE
    second = api.get(f"{path}/targets?reason={code}&limit={2 * PAGE}").json()["items"][PAGE:]
    browser.wait(lambda: second[0]["target_id"] in browser.text(f"{group} tbody tr:first-child"))
    assert second[-1]["target_id"] in browser.text(f"{group} tbody tr:last-child")
    calls = Counter(urlsplit(url).path for url in browser.requests())
    assert calls[f"{path}/targets"] == 1
    # A target selected on a distant page is scrolled to and explained with one more call.
    browser.click(f"{TARGETS} > summary")
    last = api.get(f"{path}/targets?reason={code}&limit=500").json()["items"][-1]
    browser.find("#target-find").send_keys(last["target_id"])
    browser.click(f"{TARGETS} tbody tr:first-child button")
    browser.wait(lambda: last["target_id"] in browser.text(f"{group} tr.marked"))
    browser.wait(lambda: last["reason"]["certainty"] in browser.text("#selected"))
    assert num_rows(browser, group) <= PAGE


def test_few_rows_of_many_are_in_the_page_and_fields_narrow_them(
    browser: Browser, api: httpx.Client, crowded_job: Json
) -> None:
    browser.open(f"/jobs/{crowded_job['id']}")
    path = browser.wait_for_answer()
    page = api.get(f"{path}/targets?limit=500").json()
    items: list[Json] = page["items"]
    while page["next"] is not None:
        page = api.get(f"{path}/targets?limit=500&cursor={page['next']}").json()
        items += page["items"]
    assert len(items) == NUM_TARGETS
    browser.click(f"{TARGETS} > summary")
    browser.wait(lambda: f"of {NUM_TARGETS}" in browser.text(f"{TARGETS} .pager"))
    assert num_rows(browser, TARGETS) == PAGE
    assert "All" not in browser.text(f"{TARGETS} .pager")  # that many rows would be slow
    browser.click(button(TARGETS, "Last"))
    browser.wait(lambda: items[-1]["target_id"] in browser.text(f"{TARGETS} tbody tr:last-child"))
    assert num_rows(browser, TARGETS) == PAGE

    wanted = [one for one in items if one["outcome"] == "unscheduled"]
    browser.run(
        "const s = document.getElementById('target-outcome'); s.value = 'unscheduled';"
        "s.dispatchEvent(new Event('input'))"
    )
    browser.wait(lambda: browser.text("#target-count") == f"{len(wanted)} of {NUM_TARGETS}")
    browser.find("#target-find").send_keys(wanted[0]["target_id"])
    browser.wait(lambda: num_rows(browser, TARGETS) < PAGE)
    assert wanted[0]["target_id"] in browser.text(f"{TARGETS} tbody")
