"""Scenarios over HTTP: frozen, hashed, expanded, and their opportunities."""

from __future__ import annotations

import hashlib
from dataclasses import fields, replace
from datetime import timedelta
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.errors import InvalidScenario
from planner_core.problem import Opportunities
from service.db.rows import OpportunitySetRow, ScenarioRow
from service.scenarios.canonical import canonical
from service.scenarios.freezing import freeze_file
from service.scenarios.translate import read_file, scenario_from_content
from service.stores import opportunity_store
from tests.service.conftest import Service
from tests.service.factories import EPOCH, ground_station, post, satellite, target, tle
from tests.service.problems import assert_problem

PATH = "/v1/scenarios"


def horizon(hours: float = 6.0) -> dict[str, str]:
    end = EPOCH + timedelta(hours=hours)
    return {"start": EPOCH.isoformat(), "end": end.isoformat()}


def catalog(client: httpx.Client, *targets: dict[str, Any]) -> str:
    body = {"name": "Points", "targets": list(targets) or grid()}
    return str(post(client, "/v1/target-catalogs", body)["id"])


def grid() -> list[dict[str, Any]]:
    return [
        target(id=f"{lat}/{lon}", lat_deg=lat, lon_deg=lon)
        for lat in range(-80, 81, 20)
        for lon in range(-180, 180, 30)
    ]


def question(client: httpx.Client, **fields: Any) -> dict[str, Any]:
    """Return the body of a scenario over freshly stored inputs."""
    return {
        "horizon": horizon(),
        "satellite_ids": [post(client, "/v1/satellites", satellite())["id"]],
        "target_catalog_ids": [catalog(client)],
        "ground_station_ids": [post(client, "/v1/ground-stations", ground_station())["id"]],
    } | fields


def get(client: httpx.Client, path: str, **params: str) -> httpx.Response:
    """Get an answer that may still have to be computed (and at first compiled)."""
    while (response := client.get(path, params=params or None)).status_code == 503:
        assert response.json()["code"] == "still_computing"
        assert int(response.headers["retry-after"]) > 0
    assert response.status_code == 200, response.text
    return response


def count(service: Service, table: type[ScenarioRow] | type[OpportunitySetRow]) -> int:
    with service.database.reading() as session:
        number = session.scalar(sa.select(sa.func.count()).select_from(table))
    assert number is not None
    return number


def test_a_scenario_shows_its_defaults_counts_and_links(client: httpx.Client) -> None:
    asked = question(client, name="First")
    response = client.post(PATH, json=asked)
    body = response.json()
    assert response.status_code == 201, response.text
    assert response.headers["location"] == f"{PATH}/{body['id']}"
    assert body["name"] == "First"
    assert body["horizon"] == {
        "start": "2026-03-01T00:00:00.000Z",
        "end": "2026-03-01T06:00:00.000Z",
    }
    for key in ("satellite_ids", "target_catalog_ids", "ground_station_ids"):
        assert body[key] == asked[key]
    assert body["counts"] == {"satellites": 1, "targets": 108, "ground_stations": 1}
    assert (body["use_resources"], body["dynamics"]) == (True, "physical")
    assert (body["collect_spacing_s"], body["continuous_starts"]) == (None, False)
    assert body["collect_alignment"] == "access"
    again = client.get(response.headers["location"])
    assert again.json() == body
    assert again.headers["etag"] == response.headers["etag"]
    long = {"pins", "outages", "states"}
    assert client.get(PATH).json()["items"] == [{k: v for k, v in body.items() if k not in long}]


def test_the_same_content_is_the_same_scenario(service: Service) -> None:
    asked = question(service.client)
    first = service.client.post(PATH, json=asked)
    shifted = {"start": "2026-03-01T02:00:00+02:00", "end": "2026-03-01t06:00:00z"}
    spelt_out = asked | {"name": "Other", "use_resources": True, "horizon": shifted}
    second = service.client.post(PATH, json=spelt_out)
    assert (first.status_code, second.status_code) == (201, 200)
    assert second.json() == first.json()
    other = service.client.post(PATH, json=asked | {"collect_spacing_s": 10})
    assert other.status_code == 201
    assert other.json()["sha256"] != first.json()["sha256"]
    assert count(service, ScenarioRow) == 2


def test_the_file_of_a_scenario_is_the_same_question_without_the_service(
    client: httpx.Client,
) -> None:
    body = post(client, PATH, question(client, name='A "name"'))
    response = client.get(body["links"]["file"])
    file = response.json()
    assert file["name"] == 'A "name"'
    assert hashlib.sha256(canonical(file).encode()).hexdigest() == body["sha256"]
    scenario = scenario_from_content(file)
    assert [s.id for s in scenario.satellites] == body["satellite_ids"]
    assert {t.catalog_id for t in scenario.targets} == set(body["target_catalog_ids"])
    known = {"If-None-Match": response.headers["etag"]}
    assert client.get(body["links"]["file"], headers=known).status_code == 304


def test_quality_is_frozen_with_the_question(client: httpx.Client) -> None:
    asked = question(client)
    plain = post(client, PATH, asked)
    assert plain["quality"] == {"off_nadir_deg": [], "sun_elevation_deg": []}
    curves = {"off_nadir_deg": [[0, 1], [45, 0.6]]}
    body = post(client, PATH, asked | {"quality": curves})
    assert body["sha256"] != plain["sha256"]
    assert body["quality"] == curves | {"sun_elevation_deg": []}
    file = client.get(body["links"]["file"]).json()
    assert file["quality"] == body["quality"]
    assert "quality" not in client.get(plain["links"]["file"]).json()


def test_later_edits_change_nothing_in_a_scenario(client: httpx.Client) -> None:
    asked = question(client)
    body = post(client, PATH, asked)
    before = client.get(body["links"]["file"]).json()
    where = f"/v1/satellites/{asked['satellite_ids'][0]}"
    newer = {"tle": tle(client.get(where).json()["norad_cat_id"], epoch=EPOCH + timedelta(days=1))}
    assert client.put(f"{where}/elements", json=newer).status_code == 200
    changed = client.post(PATH, json=asked)
    assert changed.status_code == 201
    assert client.delete(where).status_code == 204
    assert client.delete(f"/v1/target-catalogs/{asked['target_catalog_ids'][0]}").is_success
    assert client.get(body["links"]["file"]).json() == before
    assert get(client, body["links"]["opportunities"]).json()["items"]


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"satellite_ids": []}, "value_out_of_range", "/satellite_ids"),
        ({"target_catalog_ids": []}, "value_out_of_range", "/target_catalog_ids"),
        ({"satellite_ids": ["no"]}, "unknown_satellite", "/satellite_ids/0"),
        ({"target_catalog_ids": ["no"]}, "unknown_target_catalog", "/target_catalog_ids/0"),
        ({"ground_station_ids": ["no"]}, "unknown_ground_station", "/ground_station_ids/0"),
        ({"horizon": {"start": "2026-03-01T00:00:00Z"}}, "missing_field", "/horizon/end"),
        (
            {"horizon": {"start": "2026-03-01T00:00:00", "end": "2026-03-02T00:00:00Z"}},
            "naive_time",
            "/horizon/start",
        ),
        (
            {"horizon": {"start": "2026-02-30T00:00:00Z", "end": "2026-03-02T00:00:00Z"}},
            "invalid_time",
            "/horizon/start",
        ),
        (
            {"horizon": {"start": 1772323200, "end": "2026-03-02T00:00:00Z"}},
            "invalid_time",
            "/horizon/start",
        ),
        (
            {"horizon": {"start": "2026-03-02T00:00:00Z", "end": "2026-03-01T00:00:00Z"}},
            "horizon_inverted",
            "/horizon/end",
        ),
        (
            {"horizon": {"start": "2026-03-02T00:00:00Z", "end": "2026-03-02T00:00:00Z"}},
            "horizon_inverted",
            "/horizon/end",
        ),
        ({"horizon": horizon(31 * 24 + 0.1)}, "horizon_too_long", "/horizon/end"),
        ({"collect_spacing_s": 0}, "value_out_of_range", "/collect_spacing_s"),
        ({"dynamics": "magic"}, "unknown_value", "/dynamics"),
        ({"use_resources": "yes"}, "invalid_value", "/use_resources"),
        ({"satellites": []}, "unknown_field", "/satellites"),
        (
            {"quality": {"off_nadir_deg": [[0, 1], [20, 0.9], [20, 0.5]]}},
            "value_out_of_range",
            "/quality/off_nadir_deg/2",
        ),
        (
            {"quality": {"sun_elevation_deg": [[10, 0.5], [40, 1]]}, "continuous_starts": True},
            "value_out_of_range",
            "/continuous_starts",
        ),
    ],
)
def test_a_bad_question_is_named_by_its_pointer(
    service: Service, change: dict[str, Any], code: str, pointer: str
) -> None:
    response = service.client.post(PATH, json=question(service.client) | change)
    assert_problem(response, 422, code, pointer)
    assert count(service, ScenarioRow) == 0


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"max_targets": 107}, "The scenario has 108 targets; the limit is 107."),
        (
            {"max_satellite_target_days": 26.9},
            "1 satellites times 108 targets times 0.25 days are 27; the limit is 26.9.",
        ),
    ],
)
def test_a_scenario_that_is_too_large_is_refused_before_it_is_read(
    service: Service, limits: dict[str, float], words: str
) -> None:
    asked = question(service.client)
    file = get(service.client, post(service.client, PATH, asked)["links"]["file"]).json()
    settings = service.settings.model_copy(update=limits)
    service.app.state.settings = settings
    problem = assert_problem(
        service.client.post(PATH, json=asked | {"name": "Again"}), 422, "scenario_too_large"
    )
    assert problem["detail"] == words
    with pytest.raises(InvalidScenario, match=words):
        freeze_file(read_file(file), settings.scenario_limits)


def test_a_spacing_that_makes_too_many_opportunities_is_refused(client: httpx.Client) -> None:
    asked = question(client, collect_spacing_s=1e-3)
    asked["target_catalog_ids"] = [catalog(client, *(target(id=f"t{n}") for n in range(2000)))]
    path = post(client, PATH, asked)["links"]["opportunities"]
    assert_problem(client.get(path), 422, "too_many_opportunities")


def test_naming_a_satellite_twice_is_refused(client: httpx.Client) -> None:
    asked = question(client)
    asked["satellite_ids"] *= 2
    response = client.post(PATH, json=asked)
    assert_problem(response, 422, "duplicate_satellite_id", "/satellite_ids/1")


def test_a_deleted_input_is_unknown(client: httpx.Client) -> None:
    asked = question(client)
    client.delete(f"/v1/ground-stations/{asked['ground_station_ids'][0]}")
    response = client.post(PATH, json=asked)
    assert_problem(response, 422, "unknown_ground_station", "/ground_station_ids/0")


def test_a_target_id_in_two_catalogues_is_refused(client: httpx.Client) -> None:
    asked = question(client)
    asked["target_catalog_ids"] = [catalog(client, target()), catalog(client, target(lat_deg=1))]
    response = client.post(PATH, json=asked)
    assert_problem(response, 422, "duplicate_target_id", "/target_catalog_ids/1")


def test_an_orbit_that_decays_within_the_horizon_is_refused(service: Service) -> None:
    falling = satellite(
        name="FALLING", tle=tle(mean_motion_rev_day=16.4, bstar=0.05, eccentricity=0.0005)
    )
    asked = question(service.client, horizon=horizon(24 * 30))
    asked["satellite_ids"] = [post(service.client, "/v1/satellites", falling)["id"]]
    problem = assert_problem(service.client.post(PATH, json=asked), 422, "propagation_failed")
    assert "FALLING" in problem["detail"]
    assert count(service, ScenarioRow) == 0


def test_old_elements_are_a_warning(client: httpx.Client) -> None:
    asked = question(client)
    old = satellite(name="OLD", tle=tle(epoch=EPOCH - timedelta(days=10)))
    asked["satellite_ids"] = [post(client, "/v1/satellites", old)["id"]]
    (warning,) = post(client, PATH, asked)["warnings"]
    assert "OLD" in warning
    assert post(client, PATH, question(client))["warnings"] == []


def test_a_half_life_without_a_share_that_ages_is_a_warning(client: httpx.Client) -> None:
    asked = question(client, objective={"half_life_s": 3600})
    (warning,) = post(client, PATH, asked)["warnings"]
    assert "half_life_s has no effect" in warning
    asked["objective"]["collected_share"] = 0.5
    assert post(client, PATH, asked)["warnings"] == []


def test_elements_of_more_than_thirty_days_are_refused_unless_allowed(client: httpx.Client) -> None:
    asked = question(client)
    stale = satellite(name="STALE", tle=tle(epoch=EPOCH - timedelta(days=40)))
    asked["satellite_ids"].append(post(client, "/v1/satellites", stale)["id"])
    refused = client.post(PATH, json=asked)
    problem = assert_problem(refused, 422, "elements_too_old", "/satellite_ids/1")
    assert "STALE" in problem["detail"]
    allowed = post(client, PATH, asked | {"allow_old_elements": True})
    assert allowed["allow_old_elements"] is True
    assert any("STALE" in warning for warning in allowed["warnings"])


def test_limits_of_sensor_and_target_narrow_the_opportunities(client: httpx.Client) -> None:
    free = question(client)
    sunny = satellite(sensor={"sun_elevation_min_deg": 10.0})
    lit = free | {"satellite_ids": [post(client, "/v1/satellites", sunny)["id"]]}
    own = [t | {"look_side": "left", "orbit_direction": "descending"} for t in grid()]
    narrow = free | {"target_catalog_ids": [catalog(client, *own)]}
    found = {}
    for name, asked in (("free", free), ("lit", lit), ("narrow", narrow)):
        path = post(client, PATH, asked)["links"]["opportunities"]
        found[name] = get(client, path, kind="collect", limit="500").json()["items"]
    assert 0 < len(found["lit"]) < len(found["free"])
    assert 0 < len(found["narrow"]) < len(found["free"])
    assert min(item["sun_elevation_deg"] for item in found["lit"]) > 9.9
    for item in found["narrow"]:
        assert any(
            wide["target_id"] == item["target_id"]
            and wide["access_start"] <= item["access_start"]
            and wide["access_end"] >= item["access_end"]
            for wide in found["free"]
        )


def test_opportunities_are_those_of_the_core_and_computed_once(service: Service) -> None:
    body = post(service.client, PATH, question(service.client))
    path = body["links"]["opportunities"] + "?limit=50"
    items: list[dict[str, Any]] = []
    while path:
        response = get(service.client, path)
        items += response.json()["items"]
        path = response.links.get("next", {}).get("url", "")
    file = service.client.get(body["links"]["file"]).json()
    scenario = scenario_from_content(file)
    table = compute_opportunities(scenario, Budget()).opportunities
    assert [item["id"] for item in items] == [f"o{row}" for row in range(len(table))]
    assert [item["start"] for item in items] == sorted(item["start"] for item in items)
    for row, item in enumerate(items):
        is_collect = item["kind"] == "collect"
        assert (item["target_id"] is None, item["station_id"] is None) == (
            not is_collect,
            is_collect,
        )
        if is_collect:
            assert 5.0 - 1e-6 <= item["off_nadir_deg"] <= 55.0 + 1e-6
        assert item["elevation_deg"] == pytest.approx(float(table.elevation_deg[row]), abs=1e-6)
        assert item["access_start"] <= item["start"] < item["end"] <= item["access_end"]
    assert {item["kind"] for item in items} == {"collect", "contact"}
    assert count(service, OpportunitySetRow) == 1


def test_opportunities_tell_what_holds_at_their_edges(client: httpx.Client) -> None:
    path = post(client, PATH, question(client))["links"]["opportunities"]
    plain = get(client, path, kind="contact", limit="5").json()["items"]
    edged = get(client, path, kind="contact", limit="5", edges="true").json()["items"]
    assert [item["at_start"] for item in plain] == [None] * len(plain)
    for item in edged:
        # A contact begins and ends at the mask, and is higher and nearer in between.
        for edge in (item["at_start"], item["at_end"]):
            assert edge["elevation_deg"] == pytest.approx(5.0, abs=0.01)
            assert edge["range_km"] > item["range_km"]
        assert item["elevation_deg"] > 5.0
        assert item["nadir"] == "geodetic"


def test_opportunities_can_be_filtered(client: httpx.Client) -> None:
    body = post(client, PATH, question(client))
    path = body["links"]["opportunities"]
    every = get(client, path, limit="500").json()["items"]

    def ids(**wanted: str) -> list[str]:
        return [item["id"] for item in get(client, path, limit="500", **wanted).json()["items"]]

    first = next(item["target_id"] for item in every if item["target_id"] is not None)
    assert ids(kind="contact") == [i["id"] for i in every if i["kind"] == "contact"]
    assert ids(target_id=first) == [i["id"] for i in every if i["target_id"] == first]
    assert ids(satellite_id=body["satellite_ids"][0]) == [i["id"] for i in every]
    assert ids(satellite_id="none") == []
    assert_problem(client.get(path, params={"kind": "nap"}), 422, "unknown_value")


def test_stored_opportunities_are_not_computed_again(service: Service) -> None:
    body = post(service.client, PATH, question(service.client))
    file = service.client.get(body["links"]["file"]).json()
    computed = compute_opportunities(scenario_from_content(file), Budget())
    columns = {f.name: getattr(computed.opportunities, f.name)[:3] for f in fields(Opportunities)}
    three = replace(computed, opportunities=Opportunities(**columns))
    with service.database.transaction() as session:
        opportunity_store.save(session, body["sha256"], three.to_bytes())
    items = get(service.client, body["links"]["opportunities"]).json()["items"]
    assert [item["id"] for item in items] == ["o0", "o1", "o2"]


def test_an_unknown_scenario_is_404(client: httpx.Client) -> None:
    assert_problem(client.get(f"{PATH}/no"), 404, "not_found")
    assert_problem(client.get(f"{PATH}/no?expand=true"), 404, "not_found")
    assert_problem(client.get(f"{PATH}/no/opportunities"), 404, "not_found")
