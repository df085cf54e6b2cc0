"""The page of a job: progress, cancel, linked panels, tables, colours, widths, paper."""

from __future__ import annotations

import base64
import re
from datetime import datetime
from functools import partial
from typing import Any

import httpx
import pytest
from selenium.webdriver import ActionChains

from tests.service.dashboard.browser.conftest import LAPTOP, Browser
from tests.service.dashboard.browser.missions import Json, planned, small_mission
from tests.service.factories import post, satellite

WALL = (2560, 1440)


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


def point_of(browser: Browser, timeline: Json, action: Json) -> tuple[int, int]:
    """Return the position of an action of the first satellite in the Gantt chart."""
    script = """
      const canvas = document.querySelector("#gantt canvas");
      const [start, end, from, to] = [...arguments].map((at) => Date.parse(at));
      const share = ((from + to) / 2 - start) / (end - start);
      return [Math.round(120 + share * (canvas.clientWidth - 132)), 20];
    """
    horizon = timeline["horizon"]
    x, y = browser.run(script, horizon["start"], horizon["end"], action["start"], action["end"])
    return x, y


def click_canvas(browser: Browser, plot: str, x: float, y: float) -> None:
    canvas = browser.find(f"#{plot} canvas")
    browser.run("arguments[0].scrollIntoView({block: 'center'})", canvas)
    size = canvas.size
    chain = ActionChains(browser.driver)
    chain.move_to_element_with_offset(
        canvas, round(x - size["width"] / 2), round(y - size["height"] / 2)
    ).click().perform()


def test_progress_is_followed_and_cancel_keeps_the_best_plan(
    browser: Browser, api: httpx.Client, scenario_id: str
) -> None:
    body = {
        "scenario_id": scenario_id,
        "solver": "mcts",
        "params": {"num_simulations": 100_000},
        "limits": {"time_s": 600},
        "label": "long one",
    }
    job = post(api, "/v1/jobs", body)
    browser.open("/")
    row = f"tr[data-job='{job['id']}']"
    browser.wait(lambda: "running" in browser.text(row), "the list does not show it running")
    browser.click(f"{row} a")
    browser.wait(lambda: "Phase solve" in browser.text("#progress-text"), "no progress")
    points = "return Number(document.querySelector('#progress-chart canvas').dataset.points)"
    browser.wait(lambda: browser.run(points) >= 3, "the chart does not grow")
    browser.click("#cancel")
    browser.wait(lambda: "cancelled" in browser.text("#job-state"), "not cancelled")
    ended = api.get(f"/v1/jobs/{job['id']}").json()
    assert ended["state"] == "cancelled"
    assert not browser.find("#cancel").is_displayed()
    browser.wait_for_answer()
    assert browser.text("[data-figure=ended] strong") == "cancelled"


def test_an_action_clicked_in_the_chart_is_selected_everywhere(
    browser: Browser, job: Json, timeline: Json
) -> None:
    open_job(browser, job)
    actions = timeline["satellites"][0]["actions"]
    # An action with nothing else within a few pixels.
    collects = [a for a in actions if a["mode"] == "collect"]
    alone = max(collects[1:-1], key=lambda a: gap_around(collects, a))
    before = {plot: browser.drawn(plot) for plot in ("gantt", "curves", "map")}
    click_canvas(browser, "gantt", *point_of(browser, timeline, alone))
    browser.wait(lambda: browser.text("#selected-target"), "nothing selected")
    assert browser.text("#selected-target") == alone["target_id"]
    assert browser.text("#selected-action").startswith(alone["id"])
    for plot, count in before.items():
        browser.wait(partial(is_drawn_again, browser, plot, count), f"{plot} not drawn again")
    browser.wait(lambda: "taken" in browser.text("#selected table"), "no opportunities")
    browser.click("#tables > details:nth-of-type(1) > summary")
    browser.wait(lambda: alone["target_id"] in browser.text("#tables tr.marked"))


def has_value(browser: Browser, script: str, value: object) -> bool:
    return bool(browser.run(script) == value)


def is_drawn_again(browser: Browser, plot: str, before: int) -> bool:
    return browser.drawn(plot) > before


def gap_around(collects: list[Json], action: Json) -> float:
    at = datetime.fromisoformat(action["start"])
    others = [datetime.fromisoformat(a["start"]) for a in collects if a is not action]
    return min(abs((at - other).total_seconds()) for other in others)


def test_the_list_is_narrowed_to_a_satellite(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    own = api.get(f"/v1/scenarios/{job['scenario']['id']}").json()["satellite_ids"][0]
    idle = post(api, "/v1/satellites", satellite(name="without a job"))["id"]
    choose = """
      const field = document.querySelector("#filter-satellite_id");
      field.value = arguments[0];
      field.dispatchEvent(new Event("change", {bubbles: true}));
      return field.value === arguments[0];
    """
    browser.open("/")
    row = f"tr[data-job='{job['id']}']"
    browser.wait(lambda: browser.text(row), "the job is not listed")
    browser.wait(lambda: browser.run(choose, idle), "the satellite is not offered")
    browser.wait(lambda: browser.find("#jobs-empty").is_displayed(), "not narrowed")
    assert browser.run(choose, own)
    browser.wait(lambda: browser.text(row), "its job is not listed")
    assert not browser.find("#jobs-empty").is_displayed()


def test_a_left_out_target_tells_its_reason_and_what_blocks_it(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    open_job(browser, job)
    items = api.get(f"/v1/jobs/{job['id']}/targets?limit=500").json()["items"]
    codes = {i["reason"]["code"] for i in items if i["reason"] and i["reason"]["blocking_actions"]}
    code = min(codes)
    item = next(i for i in items if i["reason"] and i["reason"]["code"] == code)
    group = f"#left-out details[data-reason={code}]"
    browser.click(f"{group} > summary")
    browser.click(f"{group} tbody tr:first-child button")
    browser.wait(lambda: browser.text("#selected-target") == item["target_id"])
    browser.wait(lambda: item["reason"]["certainty"] in browser.text("#selected"))
    about = browser.text("#selected")
    assert item["reason"]["detail"] in about
    assert code.replace("_", " ") in about
    assert [a for a in item["reason"]["blocking_actions"] if a not in about] == []
    browser.wait(lambda: item["target_id"] in browser.text(f"{group} tr.marked"))


def test_a_target_clicked_on_the_map_is_selected(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    open_job(browser, job)
    features = api.get(f"/v1/jobs/{job['id']}/timeline.geojson").json()["features"]
    targets = [f for f in features if f["properties"]["kind"] == "target"]

    def distance(feature: Json) -> float:
        x, y = feature["geometry"]["coordinates"]
        others = (f["geometry"]["coordinates"] for f in targets if f is not feature)
        return float(min(abs(x - a) + abs(y - b) for a, b in others))

    alone = max(targets, key=distance)
    lon, lat = alone["geometry"]["coordinates"]
    width, height = browser.run(
        "const c = document.querySelector('#map canvas'); return [c.clientWidth, c.clientHeight]"
    )
    click_canvas(browser, "map", width / 2 + lon * width / 360, height / 2 - lat * width / 360)
    browser.wait(lambda: browser.text("#selected-target"), "nothing selected")
    assert browser.text("#selected-target") == alone["properties"]["target_id"]


def test_unused_opportunities_come_on_demand(
    browser: Browser, api: httpx.Client, job: Json, timeline: Json
) -> None:
    open_job(browser, job)
    satellite = timeline["satellites"][0]
    browser.run(
        "const s = document.getElementById('unused'); s.value = arguments[0];"
        "s.dispatchEvent(new Event('change'))",
        satellite["id"],
    )
    browser.wait(lambda: "unused" in browser.text("#unused-status"))
    used = {a["opportunity_id"] for a in satellite["actions"]} - {None}
    path = f"/v1/scenarios/{job['scenario']['id']}/opportunities?limit=500"
    page = api.get(path).json()
    total = len(page["items"])
    while page["next"]:
        page = api.get(f"{path}&cursor={page['next']}").json()
        total += len(page["items"])
    assert browser.text("#unused-status") == f"{total - len(used)} unused"


def test_keys_move_and_zoom_the_time_axis_of_all_charts(
    browser: Browser, job: Json, timeline: Json
) -> None:
    open_job(browser, job)
    whole = browser.text("#view-span")
    before = browser.drawn("curves")
    browser.find("#gantt canvas").send_keys("+")
    browser.wait(lambda: browser.text("#view-span") != whole)
    browser.wait(lambda: browser.drawn("curves") > before)
    nearer = browser.text("#view-span")
    browser.find("#curves canvas").send_keys("\ue014")  # arrow right
    browser.wait(lambda: browser.text("#view-span") != nearer)
    browser.click("#zoom-all")
    browser.wait(lambda: browser.text("#view-span") == whole)


def test_the_tables_hold_every_action_and_every_target(
    browser: Browser, job: Json, timeline: Json
) -> None:
    open_job(browser, job)
    for number, count in ((1, 1000), (2, len(timeline["satellites"][0]["actions"]))):
        section = f"#tables > details:nth-of-type({number})"
        browser.click(f"{section} > summary")
        browser.wait(partial(browser.text, f"{section} tbody tr"))
        browser.click(f"{section} .pager button:last-child")
        rows = f"return document.querySelectorAll('{section} tbody tr').length"
        # They are created a few at a time.
        browser.wait(partial(has_value, browser, rows, count))
        assert "(UTC)" in browser.text(f"{section} thead")


@pytest.mark.parametrize("size", [LAPTOP, WALL], ids=["laptop", "wall"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_fit_and_follow_the_colours_asked_for(
    browser: Browser, job: Json, size: tuple[int, int], scheme: str
) -> None:
    driver = browser.driver
    driver.set_window_size(*size)
    media = [{"name": "prefers-color-scheme", "value": scheme}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})
    try:
        for path in ("/", "/new", f"/jobs/{job['id']}"):
            browser.open(path)
            browser.wait(lambda: browser.text("#key-button") == "Give a key")
            overflow = "const p = document.scrollingElement; return p.scrollWidth - p.clientWidth"
            assert browser.run(overflow) == 0, path
            ink, paper = browser.run(
                "const s = getComputedStyle(document.body); return [s.color, s.backgroundColor]"
            )
            assert (brightness(ink) > brightness(paper)) == (scheme == "dark")
        browser.wait_for_answer()
        corner = "const pen = document.querySelector('#map canvas').getContext('2d');"
        pixel = browser.run(f"{corner} return [...pen.getImageData(2, 2, 1, 1).data]")
        assert (sum(pixel[:3]) > 384) == (scheme == "light")
    finally:
        driver.set_window_size(*LAPTOP)
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def brightness(color: str) -> float:
    """Return the mean of the red, green and blue of ``rgb(r, g, b)``."""
    parts = color[color.index("(") + 1 : -1].split(",")[:3]
    return sum(float(part) for part in parts) / 3


def test_everything_that_can_be_operated_has_a_name(browser: Browser, job: Json) -> None:
    for path in ("/", "/new", f"/jobs/{job['id']}"):
        browser.open(path)
        browser.wait(lambda: browser.text("#key-button") == "Give a key")
        if path.startswith("/jobs/"):
            browser.wait_for_answer()
        tree = browser.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
        operable = {"button", "link", "textbox", "combobox", "checkbox", "radio", "spinbutton"}
        nodes = [n for n in tree if not n["ignored"]]
        assert [n for n in nodes if role_of(n) in operable and not name_of(n)] == []
        assert [n for n in nodes if role_of(n) in ("image", "img") and not name_of(n)] == []
        assert any(role_of(n) == "main" for n in nodes)


def role_of(node: dict[str, Any]) -> str:
    return str(node.get("role", {}).get("value", ""))


def name_of(node: dict[str, Any]) -> str:
    return str(node.get("name", {}).get("value", ""))


def test_a_print_has_the_tables_that_are_open_on_screen(browser: Browser, job: Json) -> None:
    open_job(browser, job)
    folded = num_pages(browser)
    assert folded <= 2
    browser.click("#tables > details:nth-of-type(1) > summary")
    browser.wait(lambda: browser.text("#tables tbody"))
    assert num_pages(browser) > folded
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        shown = browser.run(
            "return [...document.querySelectorAll('#tables > details')]"
            ".map((one) => one.checkVisibility())"
        )
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert shown == [True] + [False] * (len(shown) - 1)
    assert len(shown) >= 3


def num_pages(browser: Browser) -> int:
    printed = browser.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": False})
    return len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed["data"])))


def test_solvers_are_compared_from_the_page_of_a_job(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    open_job(browser, job)
    browser.click("#compare")
    browser.wait(lambda: "/comparisons/" in browser.driver.current_url)
    path = f"/v1/comparisons/{browser.driver.current_url.rpartition('/')[2]}"
    runs = api.get(path).json()["runs"]
    browser.wait(
        lambda: len(browser.driver.find_elements("css selector", "#runs tbody tr")) == len(runs)
    )
    browser.wait(lambda: "succeeded" in browser.text("#runs tbody tr"))
    for run in runs:
        api.post(f"/v1/jobs/{run['job_id']}/cancel")  # the long ones need not finish
    browser.wait(lambda: browser.find("#runs").get_attribute("data-state") == "finished")
    (first,) = [r for r in api.get(path).json()["runs"] if r["job_id"] == runs[0]["job_id"]]
    assert f"{first['reward']:g}" in browser.text("#runs tbody tr:first-child")
