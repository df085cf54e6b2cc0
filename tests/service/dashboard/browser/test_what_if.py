"""A job page's suggestions of what would let a target in, and the result of trying them."""

from __future__ import annotations

import httpx
import pytest

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json, planned
from tests.service.factories import post, satellite

_SELECT = """
  for (const folded of document.querySelectorAll("details")) folded.open = true;
  const buttons = [...document.querySelectorAll("button.link")];
  const found = buttons.find((one) => one.textContent === arguments[0]);
  found?.click();
  return found !== undefined;
"""


@pytest.fixture(scope="module")
def job(api: httpx.Client) -> Json:
    """A plan of a satellite with a narrow off-nadir limit: some targets are never visible."""
    eye = post(api, "/v1/satellites", satellite(sensor={"off_nadir_max_deg": 15.0}))
    rows = "".join(f"t{i},{lat},{2 * i}\n" for i, lat in enumerate(range(-60, 60, 2)))
    catalog = api.post(
        "/v1/target-catalogs?name=Sixty",
        content=f"id,lat_deg,lon_deg\n{rows}",
        headers={"Content-Type": "text/csv"},
    ).json()
    scenario = {
        "name": "Straight down",
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-02T00:00:00Z"},
        "satellite_ids": [eye["id"]],
        "target_catalog_ids": [catalog["id"]],
        "use_resources": False,
        "objective": "collected",
    }
    return planned(api, str(post(api, "/v1/scenarios", scenario)["id"]))


def targets(api: httpx.Client, job: Json) -> list[Json]:
    found: list[Json] = api.get(f"/v1/jobs/{job['id']}/targets?limit=500").json()["items"]
    return found


def tried(browser: Browser, button: str) -> str:
    """Press one of the selection's buttons and run it; return the new job's name."""
    browser.click(button)
    browser.click("#try")
    browser.wait(lambda: browser.text(".what-if-outcome"), "no outcome")
    link = browser.find(".what-if-outcome a").get_attribute("href")
    assert link is not None
    return link.rpartition("/")[2]


def test_the_angle_that_would_do_is_said_and_tried(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    unseen = next(
        item
        for item in targets(api, job)
        if item["reason"] and item["reason"]["code"] == "no_access"
    )
    browser.open(f"/jobs/{job['id']}")
    browser.wait_for_answer()
    group = "#left-out details[data-reason=no_access]"
    browser.click(f"{group} > summary")
    browser.click(f"{group} tbody tr:first-child button")
    browser.wait(lambda: browser.text("#selected-target") == unseen["target_id"])
    browser.wait(lambda: "off-nadir up to " in browser.text(".access-changes"), "no angle")
    explained = api.get(f"/v1/jobs/{job['id']}/targets/{unseen['target_id']}/explanation").json()
    angle_deg = next(
        change["off_nadir_max_deg"]
        for change in explained["access_changes"]
        if "off_nadir_max_deg" in change
    )
    assert f"off-nadir up to {angle_deg:.1f}°" in browser.text(".access-changes")

    varied = tried(browser, ".access-changes button")
    now = {item["target_id"]: item["outcome"] for item in targets(api, {"id": varied})}
    before = {item["target_id"]: item["outcome"] for item in targets(api, job)}
    assert now != before
    assert "added" in browser.text("#what-if-outcomes table")


def test_an_image_is_left_out_to_see_what_the_plan_would_be(
    browser: Browser, api: httpx.Client, job: Json
) -> None:
    taken = next(item for item in targets(api, job) if item["action_id"])
    browser.open(f"/jobs/{job['id']}")
    browser.wait_for_answer()
    browser.wait(lambda: browser.run(_SELECT, taken["target_id"]), "no button of the target")
    browser.wait(lambda: browser.text("#selected-target") == taken["target_id"], "not selected")
    varied = tried(browser, "#wish-drop")
    now = {item["target_id"]: item["action_id"] for item in targets(api, {"id": varied})}
    assert now[taken["target_id"]] is None
    assert taken["target_id"] in browser.text("#what-if-outcomes table")
    assert "removed" in browser.text("#what-if-outcomes table")


def test_several_changes_are_tried_as_one(browser: Browser, api: httpx.Client, job: Json) -> None:
    outcomes = targets(api, job)
    dropped, skipped = [one["target_id"] for one in outcomes if one["action_id"]][:2]
    unseen = next(
        one["target_id"]
        for one in outcomes
        if one["reason"] and one["reason"]["code"] == "no_access"
    )
    browser.open(f"/jobs/{job['id']}")
    browser.wait_for_answer()
    browser.click("#try")
    browser.wait(lambda: "no changes yet" in browser.text("#what-if-outcomes"), "it asks anyway")
    for target, offer in ((dropped, "drop"), (skipped, "skip"), (unseen, "access-0")):
        select(browser, target)
        browser.click(f"#wish-{offer}")
    select(browser, unseen)
    browser.click("#wish-promise")
    browser.click("#wish-priority")
    browser.wait(lambda: browser.text("#priority-title") == f"Priority of {unseen}", "no dialog")
    browser.find("#priority-input").clear()
    browser.find("#priority-input").send_keys("5")
    browser.click("#priority-form button[type=submit]")
    lines = "return document.querySelectorAll('#wishes li').length"
    browser.wait(lambda: browser.run(lines) == 5, browser.text("#wishes"))

    browser.click("#try")
    browser.wait(lambda: browser.text(".what-if-outcome"), "no outcome")
    link = str(browser.find(".what-if-outcome a").get_attribute("href"))
    varied = api.get(f"/v1/jobs/{link.rpartition('/')[2]}").json()
    assert varied["links"]["what_if_of"].endswith(job["id"])
    assert varied["change"]["force"] == [unseen]
    assert dropped in varied["change"]["forbid"]
    assert [p["target_id"] for p in varied["change"]["forbid"] if p != dropped] == [skipped]
    assert varied["change"]["relax"]["targets"][unseen]["reward"] == 5
    now = {one["target_id"]: one for one in targets(api, varied)}
    assert now[dropped]["action_id"] is None
    assert now[unseen]["action_id"] is not None
    assert now[unseen]["worth"] == 5


def select(browser: Browser, target_id: str) -> None:
    browser.wait(lambda: browser.run(_SELECT, target_id), f"no button of {target_id}")
    browser.wait(lambda: browser.text("#selected-target") == target_id, "not selected")
