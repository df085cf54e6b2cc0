"""Pictures of the real pages for README and docs: ``make screenshots``."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Final

import httpx
from PIL import Image

from tests.patience import PATIENCE_S
from tests.service.dashboard.browser.conftest import Browser, start_chromium
from tests.service.dashboard.browser.crowd import show_at
from tests.service.dashboard.browser.missions import (
    WITHIN_S,
    Json,
    light_mission,
    planned,
    small_mission,
)
from tests.service.factories import post
from tests.service.serving import serving

FOLDER: Final = Path(__file__).resolve().parents[4] / "docs" / "images"
LARGEST_BYTES: Final = 300_000
WIDTH: Final = 1400
NUM_COLORS: Final = 256
A_SATELLITE: Final = "#thing option:nth-child(2)"
SCREENS: Final = ((1280, 900), (1920, 1080))


@contextmanager
def opened(url: str) -> Iterator[Browser]:
    """Yield a browser on a service."""
    driver = start_chromium()
    try:
        yield Browser(driver=driver, url=url)
    finally:
        driver.quit()


def colors(browser: Browser, scheme: str) -> None:
    """Set the light or dark colour scheme."""
    media = [{"name": "prefers-color-scheme", "value": scheme}]
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})


def take(
    browser: Browser, name: str, height: int, top: str = "header", *, width: int = WIDTH
) -> None:
    """Write a picture of the page from an element downwards."""
    show_at(browser, width, height)
    browser.run(
        "document.activeElement.blur(); document.querySelector(arguments[0])"
        ".scrollIntoView({block: 'start'})",
        top,
    )
    # Canvases are redrawn at their new width.
    browser.driver.execute_async_script("const [done] = arguments; setTimeout(done, 500);")
    path = FOLDER / f"{name}.png"
    browser.driver.save_screenshot(str(path))
    with Image.open(path) as picture:
        # Small marks keep their colour: they matter most.
        few = picture.convert("RGB").quantize(NUM_COLORS, Image.Quantize.MAXCOVERAGE)
    few.save(path, optimize=True)
    size = path.stat().st_size
    assert size < LARGEST_BYTES, f"{path.name} has {size} bytes"
    print(f"{path.relative_to(FOLDER.parents[1])}: {size // 1000} kB")


def compared(api: httpx.Client, scenario_id: str) -> Json:
    """Compare the quick solvers; return the comparison."""
    names = ("rule", "graph", "forward_search", "mcts", "certified")
    body = {
        "scenario_id": scenario_id,
        "runs": [{"solver": name} for name in names],
        "label": "Which solver",
        "limits": {"time_s": 60},
    }
    table = post(api, "/v1/comparisons", body)
    while table["state"] == "running":
        table = api.get(f"/v1/comparisons/{table['id']}").json()
    return table


def select_blocked(browser: Browser) -> None:
    """Select a target that others displace: it has the longest explanation."""
    displaced = "[data-reason=displaced_by]"
    is_there = browser.driver.find_elements("css selector", displaced)
    group = f"#left-out details{displaced if is_there else '[data-reason=slew_conflict]'}"
    browser.click(f"{group} > summary")
    browser.click(f"{group} tbody tr button")
    browser.wait(lambda: browser.text("#selected table"))


def shift(api: httpx.Client, browser: Browser, scenario_id: str) -> dict[str, tuple[str, str]]:
    """Publish a plan and its change, and picture the plan and the wall; return their addresses."""
    job = planned(api, scenario_id, "certified")
    plan = post(api, "/v1/plans", {"job_id": job["id"], "name": "Monday"})
    start = plan["horizon"]["start"]
    publish(api, plan, start)
    contacts = [
        each
        for each in api.get(f"/v1/plans/{plan['id']}/actions?limit=500").json()["items"]
        if each["mode"] == "contact"
    ]
    lost = sorted(contacts, key=lambda each: str(each["start"]))[len(contacts) // 2]
    body = {
        "now": start,
        "name": "Monday, one pass lost",
        "outages": [{name: lost[name] for name in ("satellite_id", "start", "end")}],
        "limits": {"time_s": WITHIN_S},
    }
    job = post(api, f"/v1/plans/{plan['id']}/replans", body)
    while job["state"] in ("queued", "running"):
        job = api.get(f"/v1/jobs/{job['id']}?wait=10").json()
    replan = api.get(job["links"]["plan"]).json()
    browser.open(f"/plans/{replan['id']}")
    browser.wait(lambda: browser.drawn("gantt") and browser.text("#passes tbody"))
    take(browser, "plan", 1500)
    publish(api, replan, start)
    browser.open(f"/wall#at={lost['start']}")
    browser.wait(lambda: browser.drawn("wall-map") and "OS" in browser.text("#wall-passes"))
    colors(browser, "dark")
    take(browser, "wall", 900)
    colors(browser, "light")
    return {
        "plan": (f"/plans/{replan['id']}", "#passes tbody"),
        "wall": (f"/wall#at={lost['start']}", "#wall-passes tbody"),
    }


def screens(browser: Browser, addresses: dict[str, tuple[str, str]]) -> None:
    """Picture the pages on a laptop and on a large screen, by day and by night, and on paper."""
    for page, (address, is_ready) in addresses.items():
        browser.open(address)
        browser.wait(lambda text=is_ready: browser.text(text), f"{page} is not ready")  # type: ignore[misc]
        if page == "fleet":
            found = partial(browser.driver.find_elements, "css selector", A_SATELLITE)
            browser.wait(found, "nothing to change")
            browser.find(A_SATELLITE).click()
            browser.wait(lambda: browser.text("#edit-fields"), "no figures")
        for width, height in SCREENS:
            for scheme in ("light", "dark"):
                colors(browser, scheme)
                take(browser, f"screens/{page}-{width}-{scheme}", height, width=width)
    colors(browser, "light")
    browser.open(addresses["plan"][0])
    browser.wait(lambda: browser.text("#passes tbody"), "no passes")
    browser.run("window.print = () => {}")
    browser.click("#print-passes")
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    # A4 at 96 dots per inch, between the margins.
    take(browser, "screens/passes-print", 1030, width=703)
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def publish(api: httpx.Client, plan: Json, effective_from: str) -> None:
    """Approve and publish a plan."""
    address = f"/v1/plans/{plan['id']}/transitions"
    api.post(address, json={"to": "approved"}).raise_for_status()
    body = {"to": "published", "effective_from": effective_from}
    api.post(address, json=body).raise_for_status()


def main() -> None:
    """Plan the demonstration's mission and write the pictures."""
    (FOLDER / "screens").mkdir(exist_ok=True, parents=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(Path(folder), "serve", "--workers", "2") as (_, line),
        httpx.Client(base_url=line.split()[-1], timeout=PATIENCE_S, trust_env=False) as api,
        opened(line.split()[-1]) as browser,
    ):
        scenario_id = small_mission(api)
        job = planned(api, scenario_id, "forward_search")
        table = compared(api, scenario_id)
        colors(browser, "light")
        browser.open(f"/jobs/{job['id']}")
        browser.wait_for_answer()
        select_blocked(browser)
        take(browser, "job", 1290)
        take(browser, "job-selected", 900, "#selected-card")
        colors(browser, "dark")
        take(browser, "job-dark", 1290)
        colors(browser, "light")
        browser.open(f"/comparisons/{table['id']}")
        browser.wait(lambda: browser.text("#runs tbody tr:last-child meter") is not None)
        browser.wait(lambda: "valid" in browser.text("#runs tbody"))
        take(browser, "comparison", 640)
        browser.open("/")
        browser.wait(lambda: browser.text("#comparisons tbody tr"))
        take(browser, "jobs", 760)
        browser.open("/new")
        browser.wait(lambda: browser.text("#satellites .choices label"))
        take(browser, "new", 1360)
        pages = shift(api, browser, light_mission(api))
        pages |= {
            "job": (f"/jobs/{job['id']}", "#left-out details"),
            "targets": ("/targets", "#targets tbody"),
            "fleet": ("/fleet", "#thing"),
        }
        screens(browser, pages)


if __name__ == "__main__":
    main()
