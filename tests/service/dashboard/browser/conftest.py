"""The real service, and headless Chromium. `.ci/browser` installs it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import httpx
import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service as DriverService
from selenium.webdriver.remote.webelement import WebElement

from tests.patience import PATIENCE_S, wait_until
from tests.service.serving import serving

LAPTOP: Final = (1366, 900)
_CHROMIUM: Final = shutil.which("chromium") or ""
_DRIVER: Final = shutil.which("chromedriver") or ""
_WATCH_POLICY: Final = """
window.policyViolations = [];
document.addEventListener("securitypolicyviolation", (event) =>
  window.policyViolations.push(`${event.violatedDirective} ${event.blockedURI}`));
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Browser:
    """A page in the browser, with its console messages and requests."""

    driver: webdriver.Chrome
    url: str

    def open(self, path: str) -> None:
        """Go to a page of the service."""
        self.driver.get(self.url + path)

    def run(self, script: str, *arguments: object) -> Any:
        """Run a function body in JavaScript and return its result."""
        return self.driver.execute_script(script, *arguments)

    def find(self, selector: str) -> WebElement:
        """Return the first element that matches."""
        return self.driver.find_element("css selector", selector)

    def text(self, selector: str) -> str:
        """Return the visible text of an element; "" if there is none."""
        # In one step: pages replace elements during the look-up.
        script = """
          const found = document.querySelector(arguments[0]);
          return found?.checkVisibility() ? found.innerText.trim() : "";
        """
        return str(self.run(script, selector))

    def click(self, selector: str) -> None:
        """Click an element as soon as it is clickable."""
        script = """
          const found = document.querySelector(arguments[0]);
          return found?.checkVisibility() && !found.disabled;
        """
        self.wait(lambda: self.run(script, selector), f"nothing to click at {selector}")
        self.run("arguments[0].scrollIntoView({block: 'center'})", self.find(selector))
        self.find(selector).click()

    def wait(self, is_so: Callable[[], object], what: str = "") -> None:
        """Wait until a condition holds."""
        wait_until(is_so, lambda: f"{what}\n{self.text('main')[:2000]}")

    def wait_for_answer(self) -> str:
        """Wait for a job's page to show all its panels; return the job's address in the API."""
        self.wait(lambda: "/jobs/" in self.driver.current_url, "no page of a job")
        self.wait(lambda: self.drawn("map"), "no map")
        return f"/v1/jobs/{self.driver.current_url.rpartition('/')[2]}"

    def drawn(self, plot: str) -> int:
        """Return how often a canvas has been drawn."""
        script = "return document.querySelector(`#${arguments[0]} canvas`)?.dataset.drawn"
        return int(self.run(script, plot) or 0)

    def watch(self) -> None:
        """Reset: forget the tab's key and all messages so far."""
        self.open("/problems/not-found")
        self.run("sessionStorage.clear()")
        self.driver.get_log("browser")  # type: ignore[no-untyped-call]
        self.driver.get_log("performance")  # type: ignore[no-untyped-call]

    def complaints(self) -> list[str]:
        """Return the complaints of the console, the policy and the network log about the page."""
        said: list[dict[str, Any]] = self.driver.get_log("browser")  # type: ignore[no-untyped-call]
        found = [entry["message"] for entry in said if entry["level"] in ("SEVERE", "WARNING")]
        found += self.run("return window.policyViolations ?? []")
        return found + [f"asked for {url}" for url in self.requests() if self.is_elsewhere(url)]

    def is_elsewhere(self, url: str) -> bool:
        """Return whether an address belongs to another host."""
        parts = urlsplit(url)
        return parts.scheme in ("http", "https", "ws", "wss") and not url.startswith(self.url)

    def requests(self) -> list[str]:
        """Return every address that the browser has requested since the last call."""
        log: list[dict[str, Any]] = self.driver.get_log("performance")  # type: ignore[no-untyped-call]
        events = [json.loads(entry["message"])["message"] for entry in log]
        sent = [e["params"] for e in events if e["method"] == "Network.requestWillBeSent"]
        return [params["request"]["url"] for params in sent]


def start_chromium() -> webdriver.Chrome:
    """Return a headless browser; the caller ends it."""
    options = webdriver.ChromeOptions()
    options.binary_location = _CHROMIUM
    for argument in (
        "--headless=new",
        "--no-sandbox",  # which root cannot use
        "--disable-dev-shm-usage",
        "--disable-gpu",
        "--disable-background-networking",
        "--disable-component-update",
        "--force-device-scale-factor=1",
        "--lang=de-DE",  # pages must show UTC in their own format in any locale
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=DriverService(_DRIVER))
    driver.set_window_size(*LAPTOP)
    driver.set_script_timeout(PATIENCE_S)
    driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": _WATCH_POLICY})
    driver.execute_cdp_cmd("Emulation.setTimezoneOverride", {"timezoneId": "Pacific/Auckland"})
    return driver


@pytest.fixture(scope="session")
def service_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The service with two workers, for all tests."""
    folder = tmp_path_factory.mktemp("service")
    with serving(folder, "serve", "--workers", "2") as (_, line):
        yield line.split()[-1]


@pytest.fixture(scope="session")
def api(service_url: str) -> Iterator[httpx.Client]:
    """A client of that service."""
    with httpx.Client(base_url=service_url, timeout=PATIENCE_S, trust_env=False) as client:
        yield client


@pytest.fixture(scope="session")
def driver() -> Iterator[webdriver.Chrome]:
    """The browser, for all tests."""
    assert _CHROMIUM, "there is no Chromium here: run .ci/browser"
    assert _DRIVER, "there is no driver of Chromium here: run .ci/browser"
    driver = start_chromium()
    yield driver
    driver.quit()


@pytest.fixture
def browser(driver: webdriver.Chrome, service_url: str) -> Iterator[Browser]:
    """A page without complaints: no error, no other host, no violation of the policy."""
    page = Browser(driver=driver, url=service_url)
    page.watch()
    yield page
    assert page.complaints() == []


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for files to upload."""
    return tmp_path_factory.mktemp("files")
