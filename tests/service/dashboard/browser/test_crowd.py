"""20 satellites and 18 stations on the pages: names stay legible, prints stay short."""

from __future__ import annotations

import base64
import itertools
import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from tests.patience import PATIENCE_S
from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.crowd import (
    CUT_OFF,
    NOON_OF_SHIFT,
    SCREENS,
    START,
    STATIONS,
    crowded_plan,
    show_at,
)
from tests.service.dashboard.browser.missions import Json
from tests.service.serving import serving

WALL = (1920, 1080)
MOST_SATELLITES = 15
MOST_STATIONS = 10
MOST_PAGES = 2
# On a screen 1.2 metres wide letters of this size are 12 mm high.
LEAST_LETTERS_PX = 19
LETTERS_PX = "return parseFloat(getComputedStyle(document.querySelector('#wall td')).fontSize)"
# Records where each canvas has text, by the ink of the letters and not by the page's own figures.
RECORD = """
const note = CanvasRenderingContext2D.prototype.fillText;
const clear = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  this.canvas.written = [];
  return clear.apply(this, box);
};
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const ink = this.measureText(text);
  this.canvas.written?.push({
    text, left: x - ink.actualBoundingBoxLeft, right: x + ink.actualBoundingBoxRight,
    top: y - ink.actualBoundingBoxAscent, bottom: y + ink.actualBoundingBoxDescent,
  });
  return note.apply(this, arguments);
};
"""


@pytest.fixture(scope="module")
def service_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A separate service, as other tests would see its plans in force."""
    with serving(tmp_path_factory.mktemp("crowd"), "serve", "--workers", "1") as (_, line):
        yield line.split()[-1]


@pytest.fixture(scope="module")
def api(service_url: str) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service_url, timeout=PATIENCE_S, trust_env=False) as client:
        yield client


@pytest.fixture(scope="module")
def plan(api: httpx.Client) -> Json:
    return crowded_plan(api)


@pytest.fixture
def recorded(browser: Browser) -> Iterator[Browser]:
    """A browser that records what is written on canvases."""
    script = browser.driver.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument", {"source": RECORD}
    )
    yield browser
    browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)
    browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def written(browser: Browser, plot: str) -> list[Json]:
    found: list[Json] = browser.run(
        "return document.querySelector(`#${arguments[0]} canvas`)?.written ?? []", plot
    )
    return found


def overprinted(texts: list[Json]) -> list[tuple[Any, Any]]:
    """Return the pairs of texts that overlap."""
    return [
        (a["text"], b["text"])
        for a, b in itertools.combinations(texts, 2)
        if a["left"] < b["right"]
        and b["left"] < a["right"]
        and a["top"] < b["bottom"]
        and b["top"] < a["bottom"]
    ]


def names_of(plan: Json) -> set[str]:
    return {one["satellite_name"] for one in plan["satellites"]}


def test_names_on_the_map_of_a_job_never_overprint(recorded: Browser, plan: Json) -> None:
    recorded.open(f"/jobs/{plan['job_id']}")
    recorded.wait_for_answer()
    assert overprinted(written(recorded, "map")) == []
    there = {one["text"] for one in written(recorded, "map")}
    assert len(there & names_of(plan)) > MOST_SATELLITES
    assert len(there & set(STATIONS)) > MOST_STATIONS
    assert overprinted(written(recorded, "gantt")) == []
    assert overprinted(written(recorded, "curves")) == []
    for key in ("+", "+", "ArrowUp"):
        press(recorded, key)
        assert overprinted(written(recorded, "map")) == []


def test_what_is_selected_is_named_on_the_map_though_others_are_near(
    recorded: Browser, plan: Json
) -> None:
    recorded.open(f"/jobs/{plan['job_id']}")
    recorded.wait_for_answer()
    recorded.click("#tables > details:nth-of-type(1) > summary")
    recorded.wait(lambda: recorded.text("#tables tbody tr button"))
    target = recorded.text("#tables tbody tr button")
    recorded.click("#tables tbody tr button")
    recorded.wait(lambda: target in {one["text"] for one in written(recorded, "map")})
    assert overprinted(written(recorded, "map")) == []


def press(browser: Browser, key: str) -> None:
    """Press a key on the map, and wait until it is redrawn."""
    before = browser.drawn("map")
    script = """
      const press = new KeyboardEvent("keydown", {key: arguments[0]});
      document.querySelector("#map canvas").dispatchEvent(press);
    """
    browser.run(script, key)
    browser.wait(lambda: browser.drawn("map") > before, "the map stands still")


def test_the_wall_of_a_crowd_is_on_one_screen_and_its_names_never_overprint(
    recorded: Browser, plan: Json
) -> None:
    show_at(recorded, *WALL)
    recorded.open(f"/wall#at={NOON_OF_SHIFT}")
    recorded.wait(lambda: names_of(plan) & {one["text"] for one in written(recorded, "wall-map")})
    recorded.wait(lambda: "OS" in recorded.text("#wall-passes"), "no countdown")
    texts = written(recorded, "wall-map")
    assert overprinted(texts) == []
    there = {one["text"] for one in texts}
    assert len(there & names_of(plan)) > MOST_SATELLITES
    assert len(there & set(STATIONS)) > MOST_STATIONS
    assert len(rows(recorded, "#wall-satellites")) == len(plan["satellites"])
    assert len(rows(recorded, "#wall-passes")) == len(STATIONS)
    assert recorded.run(LETTERS_PX) >= LEAST_LETTERS_PX
    for size in SCREENS:
        show_at(recorded, *size)
        recorded.wait(lambda: recorded.run(CUT_OFF) == [], f"cut off at {size}")


def rows(browser: Browser, table: str) -> list[Any]:
    return browser.driver.find_elements("css selector", f"{table} tbody tr")


def test_a_job_a_plan_and_the_passes_of_a_shift_are_printed_on_two_pages(
    browser: Browser, api: httpx.Client, plan: Json
) -> None:
    browser.open(f"/jobs/{plan['job_id']}")
    browser.wait_for_answer()
    browser.wait(lambda: browser.text("#others tbody"))
    assert num_pages(browser) <= MOST_PAGES
    browser.open(f"/plans/{plan['id']}")
    browser.wait(lambda: browser.drawn("gantt") and browser.text("#history li"))
    shift = {"from": START, "to": NOON_OF_SHIFT, "limit": "500", "planned": "true"}
    planned = api.get(f"/v1/plans/{plan['id']}/passes", params=shift).json()["items"]
    browser.run("document.querySelector('#passes-from').value = arguments[0]", START)
    browser.run("document.querySelector('#passes-hours').value = 6")
    browser.click("#pass-filters button[type=submit]")
    own = "#passes tbody tr.planned"
    browser.wait(lambda: len(browser.driver.find_elements("css selector", own)) == len(planned))
    assert num_pages(browser) <= MOST_PAGES
    browser.run("window.print = () => {}")
    browser.click("#print-passes")
    assert num_pages(browser) <= MOST_PAGES
    # Of hundreds of passes exactly those that the shift flies are printed.
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        on_paper = [one.is_displayed() for one in rows(browser, "#passes")]
        assert (sum(on_paper), len(on_paper) > 100) == (len(planned), True)
        assert all(one["station_name"] in browser.text("#passes") for one in planned)
        assert "planned ones" in browser.text("#passes-caption")
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def num_pages(browser: Browser) -> int:
    paper = browser.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    return len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(paper["data"])))
