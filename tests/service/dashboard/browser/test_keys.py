"""Keys in the browser: requested, taken from a wall display's link, and kept out of sight."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from selenium import webdriver

from tests.service.dashboard.browser.conftest import Browser
from tests.service.serving import serving

READ = "read-token-of-the-wall-display-0123456789"
SUBMIT = "submit-token-of-somebody-who-plans-01234"


@pytest.fixture(scope="module")
def locked_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("SLEWLINE_REQUIRE_KEYS", "true")
        environment.setenv("SLEWLINE_API_KEYS", f"wall:read:{READ},ops:submit:{SUBMIT}")
        folder: Path = tmp_path_factory.mktemp("locked")
        with serving(folder, "api") as (_, line):
            yield line.split()[-1]


@pytest.fixture
def locked(driver: webdriver.Chrome, locked_url: str) -> Iterator[Browser]:
    """A page of a service that requires keys; refusals without a key are no complaint."""
    page = Browser(driver=driver, url=locked_url)
    page.watch()
    yield page
    # Without workers the service reports that it is not ready: the browser logs that, too.
    expected = ("status of 401", "/health/ready")
    assert [one for one in page.complaints() if not any(e in one for e in expected)] == []


def test_a_wall_displays_link_shows_the_jobs_and_hides_the_key(locked: Browser) -> None:
    locked.open(f"/#key={READ}")
    locked.wait(lambda: locked.text("#key-button") == "wall: read")
    assert locked.driver.current_url == f"{locked.url}/"
    locked.wait(lambda: "No jobs yet" in locked.text("main"))
    assert locked.text("#notices") == ""
    # There is no key to send.
    assert not locked.find("#filters .needs-submit").is_displayed()
    # The key is in no requested address: not in the server's log either.
    assert [url for url in locked.requests() if READ in url.partition("#")[0]] == []
    locked.open("/new")
    locked.wait(lambda: locked.text("#key-button") == "wall: read")
    assert not locked.find("#send").is_displayed()


def test_a_link_with_a_key_that_can_change_things_is_warned_of(locked: Browser) -> None:
    locked.open(f"/#key={SUBMIT}")
    locked.wait(lambda: "--scope read" in locked.text("#notices"))
    assert "submit" in locked.text("#notices")


def test_without_a_key_the_page_asks_for_one(locked: Browser) -> None:
    locked.open("/")
    locked.wait(lambda: locked.find("#key-dialog").is_displayed())
    locked.find("#key-input").send_keys("no such key")
    locked.click("#key-form button[type=submit]")
    locked.wait(lambda: "unknown" in locked.text("#key-message"))
    locked.find("#key-input").send_keys(SUBMIT)
    locked.click("#key-form button[type=submit]")
    locked.wait(lambda: locked.text("#key-button") == "ops: submit")
    locked.wait(lambda: "No jobs yet" in locked.text("main"))
    locked.driver.refresh()
    locked.wait(lambda: locked.text("#key-button") == "ops: submit")
    locked.click("#key-button")
    locked.click("#key-forget")
    locked.wait(lambda: locked.find("#key-dialog").is_displayed())
