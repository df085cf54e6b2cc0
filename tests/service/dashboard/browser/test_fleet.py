"""The fleet page by clicks: change satellites, stations and types; create a type."""

from __future__ import annotations

from pathlib import Path

import httpx
import pytest

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import Json
from tests.service.dashboard.browser.test_first_plan import upload
from tests.service.factories import ground_station, post, satellite, tle


def type_into(browser: Browser, path: str, text: str) -> None:
    field = browser.find(f"[data-path='{path}']")
    field.clear()
    field.send_keys(text)


def open_thing(browser: Browser, name: str, address: str, a_field: str) -> None:
    """Choose a thing by its name, as a person does, and wait for its figures."""
    option = f"#thing option[value='{address}']"
    browser.wait(lambda: browser.driver.find_elements("css selector", option), f"no {name}")
    assert browser.find(option).text == name
    browser.find(option).click()
    field = f"[data-path='{a_field}']"
    browser.wait(lambda: browser.driver.find_elements("css selector", field), "no figures")


def save(browser: Browser) -> None:
    browser.click("#edit-form button")
    browser.wait(lambda: browser.text("#edit-status") == "Saved.", browser.text("#edit-error"))


@pytest.fixture
def eye(api: httpx.Client) -> Json:
    return post(api, "/v1/satellites", satellite(name="Eye", spacecraft="generic_optical"))


def test_a_satellite_is_changed_in_figures_choices_and_curves(
    browser: Browser, api: httpx.Client, eye: Json
) -> None:
    address = f"/v1/satellites/{eye['id']}"
    browser.open("/fleet")
    open_thing(browser, "satellite Eye", address, "sensor.off_nadir_max_deg")
    assert browser.text("#edit-fields fieldset:nth-of-type(1)").startswith("Agility")
    assert "Off-nadir, at most, deg" in browser.text("#edit-fields")
    type_into(browser, "name", "Old eye")
    type_into(browser, "sensor.off_nadir_max_deg", "30")
    type_into(browser, "sensor.sun_exclusion_deg", "25")  # it had none
    browser.find("[data-path='sensor.look_side'] option[value=right]").click()
    browser.find("[data-path='resources.eclipse_aware'] option[value=false]").click()
    type_into(browser, "resources.downlink_rate_mbit_s", "5: 100, 90: 400")
    save(browser)
    after = api.get(address).json()
    assert after["name"] == "Old eye"
    changed = {"off_nadir_max_deg": 30, "sun_exclusion_deg": 25, "look_side": "right"}
    assert after["sensor"] == eye["sensor"] | changed
    assert after["agility"] == eye["agility"]
    rate = {"downlink_rate_mbit_s": [[5, 100], [90, 400]], "eclipse_aware": False}
    assert after["resources"] == eye["resources"] | rate
    assert browser.find("#thing option:checked").text == "satellite Old eye"


def test_what_cannot_be_is_told_beside_the_form_and_nothing_changes(
    browser: Browser, api: httpx.Client, eye: Json
) -> None:
    address = f"/v1/satellites/{eye['id']}"
    browser.open("/fleet")
    open_thing(browser, "satellite Eye", address, "sensor.off_nadir_max_deg")
    type_into(browser, "resources.downlink_rate_mbit_s", "5 100")
    browser.click("#edit-form button")
    browser.wait(lambda: "pairs with a colon" in browser.text("#edit-error"), "not told")
    type_into(browser, "resources.downlink_rate_mbit_s", "5: 100")
    type_into(browser, "sensor.off_nadir_max_deg", "1")
    type_into(browser, "sensor.off_nadir_min_deg", "20")
    browser.click("#edit-form button")
    browser.wait(lambda: "off_nadir" in browser.text("#edit-error"), "not told")
    assert api.get(address).json() == eye
    browser.driver.get_log("browser")  # type: ignore[no-untyped-call]  # of the refusal


def test_a_station_gets_a_mask_of_its_horizon(browser: Browser, api: httpx.Client) -> None:
    station = post(api, "/v1/ground-stations", ground_station(name="Valley"))
    address = f"/v1/ground-stations/{station['id']}"
    browser.open("/fleet")
    open_thing(browser, "station Valley", address, "elevation_mask")
    type_into(browser, "elevation_mask", "0: 10, 180: 25")
    type_into(browser, "antennas", "2")
    save(browser)
    changed = {"elevation_mask": [[0, 10], [180, 25]], "antennas": 2}
    assert api.get(address).json() == station | changed


def test_a_type_is_made_changed_and_given_to_uploaded_satellites(
    browser: Browser, api: httpx.Client, files: Path
) -> None:
    browser.open("/fleet")
    browser.wait(lambda: browser.text("#type-base"), "no types")
    browser.find("#type-name").send_keys("Agile")
    browser.find("#type-base option[value=generic_optical]").click()
    browser.click("#type-form button")
    browser.wait(lambda: "Added" in browser.text("#edit-status"), browser.text("#type-error"))
    types = api.get("/v1/spacecraft?limit=500").json()["items"]
    (made,) = (one for one in types if one["name"] == "Agile")
    (base,) = (one for one in types if one["id"] == "generic_optical")
    parts = ("agility", "sensor", "resources")
    assert {part: made[part] for part in parts} == {part: base[part] for part in parts}
    type_into(browser, "agility.slew_rate_deg_s", "4.5")
    save(browser)
    after = api.get(f"/v1/spacecraft/{made['id']}").json()
    assert after["agility"] == base["agility"] | {"slew_rate_deg_s": 4.5}

    browser.open("/new")
    choice = f"#satellites-type option[value='{made['id']}']"
    browser.wait(lambda: browser.driver.find_elements("css selector", choice), "no type")
    browser.find(choice).click()
    upload(browser, "satellites", files / "agile.tle", "\n".join(["AGILE-1", *tle(93001)]))
    assert "the figures of the type Agile" in browser.text("#satellites .outcome")
    (one,) = api.get("/v1/satellites", params={"name": "AGILE-1"}).json()["items"]
    assert one["agility"]["slew_rate_deg_s"] == 4.5
