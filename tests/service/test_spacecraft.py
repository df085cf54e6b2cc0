"""Spacecraft types: built in and user-defined, what satellites take from them, and in files."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from planner_core.domain import Resources
from planner_core.errors import InvalidScenario
from service.scenarios.canonical import canonical
from service.scenarios.stored_question import StoredQuestion
from service.scenarios.translate import scenario_from_content
from service.wire.satellites import WholeSatellite
from service.wire.spacecraft_types import BUILT_IN, filled
from tests.service.factories import post, satellite, send, target, tle


def bare(**fields: Any) -> dict[str, Any]:
    """Return a satellite without any of its capabilities."""
    return {"name": "EYE-1", "tle": tle()} | fields


def file(**fields: Any) -> dict[str, Any]:
    return {
        "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-02T00:00:00Z"},
        "satellites": [bare()],
        "targets": [target()],
    } | fields


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_types_are_whole_and_valid(name: str) -> None:
    (made,) = scenario_from_content(file(satellites=[bare(spacecraft=name)])).satellites
    if name.startswith("generic"):
        assert made.agility.tracks
        assert made.resources.sun_pointing == "slew"
        assert made.resources.eclipse_aware
        assert made.resources.downlink_by_elevation
    else:
        period_s = made.orbit.period_s
        preset = Resources.paper if name == "paper" else Resources.paper_code
        assert made.resources == preset(period_s)
        assert not made.agility.tracks


def test_files_of_the_first_release_keep_the_papers_figures_and_their_hash() -> None:
    old = file()
    assert scenario_from_content(old).satellites[0].resources.sun_pointing == "free"
    assert canonical(old) == canonical(file(satellites=[bare(spacecraft="paper")]))
    assert canonical(old) == canonical(file(satellites=[bare(resources="paper")], release=2))
    assert "spacecraft" not in canonical(old)
    assert "release" not in canonical(old)
    new = file(release=2)
    (made,) = scenario_from_content(new).satellites
    assert made.spacecraft == "generic_optical"
    assert made.sensor.sun_elevation_min_deg == 10.0
    assert canonical(new) != canonical(old)


OVERRIDES: list[dict[str, Any]] = [
    {},
    {"spacecraft": "generic_sar", "agility": {"acceleration_deg_s2": None}},
    {"spacecraft": "generic_optical", "resources": {"sun_pointing": "free", "idle_power_w": 0.0}},
    {"sensor": {"sun_elevation_min_deg": None}, "resources": {"battery_capacity_wh": 90.0}},
    {"resources": "paper_code", "agility": {"slew_rate_deg_s": 2.0}},
    {"resources": {"preset": "paper", "sun_pointing": "slew"}},
    {"spacecraft": "paper_code", "resources": {"recorder_max_fraction": 0.6}},
]


@pytest.mark.parametrize("release", [1, 2])
@pytest.mark.parametrize("fields", OVERRIDES)
def test_an_export_is_the_same_question(fields: dict[str, Any], release: int) -> None:
    if release == 1 and "resources" in fields and not isinstance(fields["resources"], str):
        fields = {"spacecraft": "generic_optical", **fields}
    content = canonical(file(satellites=[bare(**fields)], release=release))
    assert canonical(json.loads(content)) == content
    exported = json.loads(StoredQuestion(content).exported("Monday"))
    assert (exported["release"], exported["name"]) == (2, "Monday")
    assert canonical(exported) == content


def test_what_a_body_says_comes_before_its_type() -> None:
    given = {
        "agility": {"acceleration_deg_s2": None},
        "resources": {"idle_power_w": 5.0},
        "sensor": {"sun_elevation_min_deg": None},
    }
    whole = WholeSatellite.model_validate(bare() | filled(given, BUILT_IN["generic_optical"]))
    assert whole.agility.slew_model == "rest"
    assert whole.agility.slew_rate_deg_s == 3.0
    assert whole.sensor.sun_elevation_min_deg is None
    resources = whole.resources
    assert not isinstance(resources, str)
    assert resources.model_dump()["idle_power_w"] == 5.0
    assert resources.model_dump()["battery_capacity_wh"] == 500.0


@pytest.mark.parametrize(
    "kind", ["paper_code", {"preset": "paper_code", "battery_min_fraction": 0.4}]
)
def test_a_type_that_is_a_preset_is_overridden_field_by_field(kind: object) -> None:
    base = {**BUILT_IN["paper_code"], "resources": kind}
    whole = filled({"resources": {"initial_battery_fraction": 0.5}}, base)
    known = {} if isinstance(kind, str) else {"battery_min_fraction": 0.4}
    assert whole["resources"] == {
        "preset": "paper_code", "initial_battery_fraction": 0.5, **known
    }  # fmt: skip
    WholeSatellite.model_validate(bare() | whole)
    in_watts = {"battery_capacity_wh": 90.0}
    assert filled({"resources": in_watts}, base)["resources"] == in_watts


def test_an_unknown_type_in_a_file_is_named() -> None:
    with pytest.raises(InvalidScenario) as refused:
        canonical(file(satellites=[bare(spacecraft="nimbus")]))
    assert refused.value.fault.pointer == "/satellites/0/spacecraft"


def test_a_satellite_without_figures_is_a_generic_optical_one(client: httpx.Client) -> None:
    stored = post(client, "/v1/satellites", bare())
    assert stored["spacecraft"] == "generic_optical"
    assert stored["resources"]["sun_pointing"] == "slew"
    plain = post(client, "/v1/satellites", bare(resources="paper", tle=tle(90002)))
    assert (plain["spacecraft"], plain["resources"]) == ("paper", "paper")
    assert plain["agility"]["slew_model"] == "rest"
    own = {"battery_capacity_wh": 90.0}
    partly = post(client, "/v1/satellites", bare(resources=own, tle=tle(90003)))
    assert partly["resources"]["battery_capacity_wh"] == 90.0
    refused = client.post("/v1/satellites", json=bare(spacecraft="nimbus"))
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/spacecraft"
    assert refused.json()["errors"][0]["code"] == "unknown_spacecraft"


def test_types_of_ones_own_have_a_life(client: httpx.Client) -> None:
    made = post(client, "/v1/spacecraft", {"name": "Bus", "agility": {"slew_rate_deg_s": 2.0}})
    where = f"/v1/spacecraft/{made['id']}"
    assert made["agility"]["acceleration_deg_s2"] == 0.5
    assert not made["is_built_in"]
    listed = client.get("/v1/spacecraft").json()["items"]
    assert [one["id"] for one in listed] == [made["id"], *BUILT_IN]
    own = post(client, "/v1/satellites", bare(spacecraft=made["id"]))
    assert own["spacecraft"] == made["id"]
    assert own["agility"]["slew_rate_deg_s"] == 2.0
    etag = client.get(where).headers["etag"]
    change = {"sensor": {"off_nadir_max_deg": 30.0}, "resources": {"idle_power_w": 50.0}}
    stale = client.patch(where, json=change, headers={"If-Match": '"other"'})
    assert stale.status_code == 412
    changed = client.patch(where, json=change, headers={"If-Match": etag}).json()
    assert changed["sensor"]["off_nadir_max_deg"] == 30.0
    assert changed["resources"]["idle_power_w"] == 50.0
    assert changed["resources"]["battery_capacity_wh"] == 500.0
    assert client.get(f"/v1/satellites/{own['id']}").json() == own
    assert client.delete(where).status_code == 204
    assert client.get(where).status_code == 404
    gone = client.post("/v1/satellites", json=bare(spacecraft=made["id"]))
    assert gone.json()["errors"][0]["code"] == "unknown_spacecraft"


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_types_are_read_only(client: httpx.Client, name: str) -> None:
    where = f"/v1/spacecraft/{name}"
    assert client.get(where).json()["is_built_in"]
    for refused in (client.patch(where, json={"name": "mine"}), client.delete(where)):
        assert (refused.status_code, refused.json()["code"]) == (409, "built_in")


def test_figures_that_do_not_go_together_are_refused(client: httpx.Client) -> None:
    body = {"name": "Bus", "sensor": {"off_nadir_min_deg": 50.0}}
    refused = client.post("/v1/spacecraft", json=body)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/sensor/off_nadir_max_deg"


def test_a_satellite_changes_its_type(client: httpx.Client) -> None:
    stored = post(client, "/v1/satellites", satellite())
    where = f"/v1/satellites/{stored['id']}"
    body = {"spacecraft": "generic_sar", "agility": {"settle_s": 1.0}}
    changed = client.patch(where, json=body).json()
    assert changed["spacecraft"] == "generic_sar"
    assert (changed["agility"]["settle_s"], changed["agility"]["slew_rate_deg_s"]) == (1.0, 1.0)
    assert changed["resources"]["collect_power_w"] == 2000.0


def test_imports_say_of_which_type_new_satellites_are(client: httpx.Client) -> None:
    lines = "\n".join(tle(90321))

    def imported(query: str) -> httpx.Response:
        return send(client, f"/v1/satellites/import{query}", lines, "text/plain")

    assert imported("?spacecraft=nimbus").status_code == 422
    (item,) = imported("?spacecraft=generic_sar").json()["items"]
    assert client.get(f"/v1/satellites/{item['id']}").json()["spacecraft"] == "generic_sar"
    (known,) = imported("").json()["items"]
    assert known["id"] == item["id"]
    assert client.get(f"/v1/satellites/{item['id']}").json()["spacecraft"] == "generic_sar"


def test_a_scenario_says_that_it_plans_with_a_built_in_type(client: httpx.Client) -> None:
    catalog = post(client, "/v1/target-catalogs", {"name": "One", "targets": [target()]})

    def warnings(body: dict[str, Any]) -> str:
        own = post(client, "/v1/satellites", body)
        asked = {
            "horizon": {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T03:00:00Z"},
            "satellite_ids": [own["id"]],
            "target_catalog_ids": [catalog["id"]],
        }
        return " ".join(post(client, "/v1/scenarios", asked)["warnings"])

    assert "built-in type generic_optical" in warnings(bare())
    assert "built-in" not in warnings(satellite())
