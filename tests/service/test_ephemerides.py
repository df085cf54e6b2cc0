"""Orbits as ephemerides over HTTP: stored, joined to satellites, planned with, refused."""

from __future__ import annotations

from typing import Any

import httpx

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.translate import scenario_from_content
from tests.planner_core.orbits.test_oem import lines, states, xml_of
from tests.service.conftest import Service
from tests.service.factories import ground_station, post, satellite, send, target
from tests.service.problems import assert_problem

IMPORT = "/v1/satellites/import"
WITHIN = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T03:00:00Z"}
BEYOND = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T06:00:00Z"}


def message() -> list[str]:
    return lines(*states())


def scenario(client: httpx.Client, satellite_id: str, horizon: dict[str, str]) -> dict[str, Any]:
    """Return the body of a scenario with one target."""
    catalog = post(client, "/v1/target-catalogs", {"name": "c", "targets": [target()]})
    station = post(client, "/v1/ground-stations", ground_station())
    return {
        "name": "flown", "horizon": horizon, "satellite_ids": [satellite_id],
        "target_catalog_ids": [catalog["id"]], "ground_station_ids": [station["id"]],
    }  # fmt: skip


def test_a_satellite_is_made_of_an_ephemeris(client: httpx.Client) -> None:
    body = {"name": "FD-1", "oem": message(), "spacecraft": "paper"}
    made = post(client, "/v1/satellites", body)
    assert made["norad_cat_id"] == 0
    assert (made["tle"], made["omm"]) == (None, None)
    assert made["oem"] == {
        "object_name": "PAPER", "object_id": "2019-001A", "num_states": 201,
        "start": "2018-12-31T23:50:00.000Z", "stop": "2019-01-01T03:10:00.000Z",
    }  # fmt: skip
    path = f"/v1/satellites/{made['id']}"
    changed = client.patch(path, json={"name": "FD-2"}).json()
    assert (changed["name"], changed["oem"]) == ("FD-2", made["oem"])


def test_the_ephemeris_comes_back_as_a_file(client: httpx.Client) -> None:
    answer = send(client, IMPORT, "\n".join(message()), "text/plain").json()
    (item,) = answer["items"]
    assert (item["name"], item["status"]) == ("PAPER", "created")
    path = f"/v1/satellites/{item['id']}"
    text = client.get(f"{path}/oem.kvn").text
    again = send(client, IMPORT, text, "text/plain").json()
    assert [(one["id"], one["status"]) for one in again["items"]] == [(item["id"], "unchanged")]
    assert_problem(client.get(f"{path}/omm.json"), 406, "not_acceptable")
    # Only satellites with elements are reported.
    assert client.get("/v1/satellites/omm.json").json() == []


def test_an_ephemeris_joins_the_satellite_of_its_name(client: httpx.Client) -> None:
    known = post(client, "/v1/satellites", satellite(name="PAPER"))
    assert_problem(client.get(f"/v1/satellites/{known['id']}/oem.kvn"), 406, "not_acceptable")
    answer = send(client, IMPORT, xml_of(message()), "application/xml").json()
    assert [(one["id"], one["status"]) for one in answer["items"]] == [
        (known["id"], "elements_added")
    ]
    forms = client.get(f"/v1/satellites/{known['id']}/elements").json()["items"]
    assert [one["oem"] is not None for one in forms] == [True, False]


def test_a_put_ephemeris_is_in_force_where_it_is_newer(client: httpx.Client) -> None:
    known = post(client, "/v1/satellites", {"name": "FD", "oem": message(), "spacecraft": "paper"})
    path = f"/v1/satellites/{known['id']}/elements"
    later = [line.replace("2018-12-31T23:50", "2018-12-31T23:55") for line in message()]
    answer = client.put(path, json={"oem": [*later[:14], *later[20:]]})
    assert answer.status_code == 200, answer.text
    assert answer.json()["oem"]["num_states"] == 195


def test_a_scenario_is_frozen_with_its_ephemeris(service: Service) -> None:
    client = service.client
    flown = post(client, "/v1/satellites", {"name": "FD", "oem": message(), "spacecraft": "paper"})
    asked = post(client, "/v1/scenarios", scenario(client, flown["id"], WITHIN))
    file = client.get(f"/v1/scenarios/{asked['id']}?expand=true").json()
    assert file["satellites"][0]["oem"][0] == "CCSDS_OEM_VERS = 2.0"
    assert sha256_of(canonical(file)) == asked["sha256"]
    read = scenario_from_content(file)
    assert len(compute_opportunities(read, Budget()).opportunities) > 0


def test_a_horizon_outside_the_span_is_refused_by_name(client: httpx.Client) -> None:
    flown = post(client, "/v1/satellites", {"name": "FD", "oem": message(), "spacecraft": "paper"})
    refused = client.post("/v1/scenarios", json=scenario(client, flown["id"], BEYOND))
    problem = assert_problem(refused, 422, "orbit_outside_span", "/satellite_ids/0")
    assert "'PAPER' is usable from 2018-12-31T23:50:00Z" in problem["detail"]


def test_bad_lines_are_named(client: httpx.Client) -> None:
    bad = message()
    bad[30] = "2019-01-01T00:06:00 7000 0 0 0 seven 0"
    body = {"name": "FD", "oem": bad}
    assert_problem(client.post("/v1/satellites", json=body), 422, "oem_number_format", "/oem/30")
    answer = send(client, IMPORT, "\n".join(bad), "text/plain")
    errors = answer.json()["errors"]
    assert [(one["code"], one["row"]) for one in errors] == [("oem_number_format", 31)]
    both = satellite(oem=message())
    assert_problem(client.post("/v1/satellites", json=both), 422, "invalid_value")
