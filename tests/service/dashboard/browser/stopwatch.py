"""From own satellites to a published plan, in the browser alone, at a person's pace, timed.

    .ci/browser .venv/bin/python -m tests.service.dashboard.browser.stopwatch \
        SATELLITES.tle TARGETS.csv STATIONS.geojson [SOLVER TIME_LIMIT_S]

prints each step with its seconds. Pauses stand for a person's hands and eyes; the rest is the
service's time.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from selenium.webdriver.common.action_chains import ActionChains

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.screenshots import opened
from tests.service.serving import serving

AIM_S: Final = 1.5
"""To find a button and click it."""
KEY_S: Final = 0.2
"""To type a letter."""
CHOOSE_FILE_S: Final = 8.0
"""To find a file in the system's dialog, which a test cannot open."""
LOOK_S: Final = 10.0
"""To read an answer."""


class Walk:
    """A person at a browser; ``steps`` are names with seconds."""

    def __init__(self, browser: Browser):
        self.browser = browser
        self.steps: list[tuple[str, float]] = []

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Measure the time of a step."""
        began_s = time.monotonic()
        yield
        self.steps.append((name, time.monotonic() - began_s))
        print(f"{self.steps[-1][1]:6.1f} s  {name}", flush=True)

    def click(self, selector: str) -> None:
        """Aim and click."""
        time.sleep(AIM_S)
        self.browser.click(selector)

    def type(self, selector: str, text: str) -> None:
        """Click a field and type."""
        self.click(selector)
        for letter in text:
            ActionChains(self.browser.driver).send_keys(letter).perform()
            time.sleep(KEY_S)

    def upload(self, kind: str, file: Path) -> None:
        """Choose a file, and read the page's summary of it."""
        with self.step(f"Upload {file.name}"):
            time.sleep(AIM_S + CHOOSE_FILE_S)
            self.browser.find(f"#{kind}-file").send_keys(str(file.resolve()))
            outcome = f"#{kind} .outcome"
            self.browser.wait(lambda: "accepted" in self.browser.text(outcome), f"no {kind}")
        print(f"          {self.browser.text(outcome)}")


def to_a_published_plan(walk: Walk, files: tuple[Path, Path, Path], how: tuple[str, ...]) -> None:
    """Walk from the first page to the plan; solver and time limit are the form's unless given."""
    browser = walk.browser
    with walk.step("Open the address, choose New plan"):
        browser.open("/")
        walk.click("nav a[href='/new']")
        browser.wait(lambda: browser.text("#satellites .choices"), "no form")
    for kind, file in zip(("satellites", "targets", "stations"), files, strict=True):
        walk.upload(kind, file)
    if how:
        solver, time_s = how
        with walk.step(f"Choose {solver}, type a time limit of {time_s} s"):
            time.sleep(AIM_S)
            browser.find(f"#solver option[value={solver}]").click()
            browser.find("#time-s").clear()
            walk.type("#time-s", time_s)
    with walk.step("Look at the suggested start, press Plan"):
        time.sleep(LOOK_S)
        walk.click("#send")
        browser.wait(lambda: "/jobs/" in browser.driver.current_url, "no job")
    with walk.step("Wait for the plan"):
        browser.wait_for_answer()
    print(f"          {' '.join(browser.text('#summary').split())}")
    with walk.step("Look at summary, timeline and map, take it into operations"):
        time.sleep(LOOK_S)
        walk.click("#take")
        browser.wait(lambda: browser.text("#plan-state") == "draft", "no draft")
    with walk.step("Type a reason, approve"):
        walk.type("#step-reason", "Checked by the shift lead")
        walk.click("#step-approved")
        browser.wait(lambda: browser.text("#plan-state") == "approved", "not approved")
    with walk.step("Look at the instant from which it is in force, publish"):
        time.sleep(LOOK_S)
        walk.click("#step-published")
        browser.wait(lambda: browser.text("#plan-state") == "published", "not published")


def main(satellites: str, targets: str, stations: str, *how: str) -> None:
    """Start an empty service, and walk through."""
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(Path(folder), "serve", "--workers", "1") as (_, line),
        opened(line.split()[-1]) as browser,
    ):
        walk = Walk(browser)
        to_a_published_plan(walk, (Path(satellites), Path(targets), Path(stations)), how)
        whole_s = sum(seconds for _, seconds in walk.steps)
        print(f"{whole_s:6.1f} s  in {len(walk.steps)} steps")


if __name__ == "__main__":
    main(*sys.argv[1:])
