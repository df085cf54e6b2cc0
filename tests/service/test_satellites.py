"""Satellites over HTTP: one, many at once, element sets, and everything that is refused."""

from __future__ import annotations

import csv
import json
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.db.rows import ElementSetRow, SatelliteRow
from tests.service.conftest import Service
from tests.service.factories import EPOCH, post, satellite, send, tle
from tests.service.problems import assert_problem

IMPORT = "/v1/satellites/import"


def stored(service: Service) -> tuple[int, int]:
    """Return how many satellites and element sets the database holds."""
    with service.database.reading() as session:
        satellites = session.scalar(sa.select(sa.func.count()).select_from(SatelliteRow))
        elements = session.scalar(sa.select(sa.func.count()).select_from(ElementSetRow))
    assert satellites is not None
    assert elements is not None
    return satellites, elements


def test_a_bare_tle_makes_the_papers_satellite(client: httpx.Client) -> None:
    response = client.post("/v1/satellites", json=satellite())
    body = response.json()
    assert response.status_code == 201
    assert response.headers["location"] == f"/v1/satellites/{body['id']}"
    assert body["norad_cat_id"] > 91_000
    assert body["epoch"] == "2026-03-01T00:00:00.000Z"
    assert body["agility"] == {
        "slew_rate_deg_s": 1.0,
        "acceleration_deg_s2": None,
        "settle_s": 0.0,
        "slew_model": "rest",
        "sun_exclusion_deg": None,
    }
    assert body["sensor"]["off_nadir_max_deg"] == 55.0
    assert body["resources"] == "paper"
    again = client.get(response.headers["location"])
    assert again.json() == body
    assert again.headers["etag"] == response.headers["etag"]


def test_a_client_that_has_the_satellite_gets_304(client: httpx.Client) -> None:
    response = client.post("/v1/satellites", json=satellite())
    where = response.headers["location"]
    known = client.get(where, headers={"If-None-Match": response.headers["etag"]})
    assert (known.status_code, known.content) == (304, b"")
    assert client.get(where, headers={"If-None-Match": '"other"'}).status_code == 200


def test_resources_of_its_own_keep_their_defaults(client: httpx.Client) -> None:
    own = {
        "battery_capacity_wh": 100,
        "sunpoint_power_w": 40,
        "collect_power_w": 80,
        "contact_power_w": 30,
        "recorder_capacity_mbit": 8000,
        "collect_rate_mbit_s": 300,
        "downlink_rate_mbit_s": 150,
        "telemetry_rate_mbit_s": 0.01,
    }
    body = post(client, "/v1/satellites", satellite(resources=own))
    assert body["resources"]["battery_min_fraction"] == 0.3
    assert body["resources"]["recorder_max_fraction"] == 0.75
    assert body["resources"]["eclipse_aware"] is False


RESOURCES = {"battery_capacity_wh": 100}


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"colour": "red"}, "unknown_field", "/colour"),
        ({"agility": {"slew_rate": 1}}, "unknown_field", "/agility/slew_rate"),
        ({"agility": {"slew_rate_deg_s": 0}}, "value_out_of_range", "/agility/slew_rate_deg_s"),
        ({"agility": {"slew_rate_deg_s": "1"}}, "invalid_value", "/agility/slew_rate_deg_s"),
        ({"agility": {"slew_rate_deg_s": True}}, "invalid_value", "/agility/slew_rate_deg_s"),
        ({"agility": None}, "invalid_value", "/agility"),
        ({"sensor": {"look_side": "up"}}, "unknown_value", "/sensor/look_side"),
        (
            {"sensor": {"off_nadir_min_deg": 40, "off_nadir_max_deg": 30}},
            "value_out_of_range",
            "/sensor/off_nadir_max_deg",
        ),
        ({"resources": "papper"}, "unknown_value", "/resources"),
        ({"resources": RESOURCES}, "missing_field", "/resources/sunpoint_power_w"),
        ({"name": ""}, "value_out_of_range", "/name"),
        ({"name": "a\x00b"}, "invalid_value", "/name"),
        ({"name": "\ud800"}, "invalid_value", "/name"),
        ({"na\ud800me": 1}, "invalid_value", ""),
        ({"tle": None, "omm": {"EPOCH": "\ud800"}}, "invalid_value", "/omm"),
        ({"tle": None}, "invalid_value", ""),
        ({"omm": {}}, "invalid_value", ""),
        ({"tle": None, "omm": {}}, "omm_missing_key", "/omm/EPOCH"),
        ({"tle": ["1 25544U"]}, "value_out_of_range", "/tle"),
        ({"tle": [tle()[0], tle()[1][:-1] + "x"]}, "tle_checksum", "/tle/1"),
        ({"tle": [tle()[0], tle(90002)[1]]}, "tle_number_mismatch", "/tle/1"),
    ],
)
def test_a_bad_field_is_named_by_its_pointer(
    service: Service, change: dict[str, Any], code: str, pointer: str
) -> None:
    body = json.dumps(satellite() | change)
    response = send(service.client, "/v1/satellites", body, "application/json")
    assert_problem(response, 422, code, pointer)
    assert stored(service) == (0, 0)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999", "1" + "0" * 400])
def test_a_number_that_is_not_finite_is_refused(client: httpx.Client, number: str) -> None:
    text = json.dumps(satellite())[:-1] + f', "agility": {{"settle_s": {number}}}}}'
    response = send(client, "/v1/satellites", text, "application/json")
    assert response.status_code == 422
    assert response.json()["errors"][0]["pointer"] == "/agility/settle_s"
    in_omm = '{"name": "x", "omm": {"EPOCH": ' + number + "}}"
    assert send(client, "/v1/satellites", in_omm, "application/json").status_code == 422


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 5000, '{"name": ' + "9" * 5000 + "}", "\ufeff{}", "\x00"]
)
def test_what_is_no_json_is_422(client: httpx.Client, text: str) -> None:
    response = send(client, "/v1/satellites", text, "application/json")
    assert response.status_code == 422
    assert response.json()["code"] in {"malformed_json", "missing_field", "invalid_value"}


def test_a_satellite_sent_as_another_type_is_415(client: httpx.Client) -> None:
    text = json.dumps(satellite())
    for media_type in ("text/plain", "application/x-www-form-urlencoded"):
        response = send(client, "/v1/satellites", text, media_type)
        assert_problem(response, 415, "unsupported_media_type")
    assert_problem(send(client, IMPORT, b"x", "image/png"), 415, "unsupported_media_type")


def test_a_body_over_the_limit_is_413_declared_or_not(service: Service) -> None:
    text = b"x" * 4_100_000
    declared = send(service.client, IMPORT, text, "text/plain")
    assert_problem(declared, 413, "body_too_large")
    chunks = (text[i : i + 65536] for i in range(0, len(text), 65536))
    chunked = service.client.post(IMPORT, content=chunks, headers={"Content-Type": "text/plain"})
    assert_problem(chunked, 413, "body_too_large")
    assert stored(service) == (0, 0)


def test_lists_are_newest_first_and_paged_by_an_opaque_cursor(client: httpx.Client) -> None:
    made = [post(client, "/v1/satellites", satellite(name=f"S{i}"))["id"] for i in range(5)]
    seen: list[str] = []
    path = "/v1/satellites?limit=2"
    while path:
        response = client.get(path)
        body = response.json()
        seen += [item["id"] for item in body["items"]]
        link = response.links.get("next", {}).get("url", "")
        assert bool(link) == (body["next"] is not None)
        path = link
    assert seen == made[::-1]


@pytest.mark.parametrize("query", ["limit=0", "limit=501", "limit=x", "cursor=%00", "cursor=é"])
def test_a_bad_page_is_422(client: httpx.Client, query: str) -> None:
    response = client.get(f"/v1/satellites?{query}")
    assert response.status_code == 422, response.text
    assert response.json()["code"] in {"value_out_of_range", "invalid_value", "invalid_cursor"}


def test_a_deleted_satellite_is_gone_from_every_call(client: httpx.Client) -> None:
    where = "/v1/satellites/" + post(client, "/v1/satellites", satellite())["id"]
    assert client.delete(where).status_code == 204
    assert_problem(client.get(where), 404, "not_found")
    assert_problem(client.delete(where), 404, "not_found")
    assert client.get("/v1/satellites").json() == {"items": [], "next": None}


def test_newer_elements_are_in_force_and_older_ones_stay(client: httpx.Client) -> None:
    where = "/v1/satellites/" + post(client, "/v1/satellites", satellite(tle=tle()))["id"]
    newer = {"tle": tle(epoch=EPOCH + timedelta(days=2))}
    older = {"tle": tle(epoch=EPOCH - timedelta(days=2))}
    first = client.put(f"{where}/elements", json=newer)
    assert first.status_code == 200
    assert first.json()["epoch"] == "2026-03-03T00:00:00.000Z"
    assert client.put(f"{where}/elements", json=older).json()["tle"] == newer["tle"]
    assert client.put(f"{where}/elements", json=newer).json()["tle"] == newer["tle"]
    sets = client.get(f"{where}/elements").json()["items"]
    assert [one["epoch"][:10] for one in sets] == ["2026-02-27", "2026-03-03", "2026-03-01"]


def test_elements_of_another_object_are_refused(service: Service) -> None:
    where = "/v1/satellites/" + post(service.client, "/v1/satellites", satellite())["id"]
    response = service.client.put(f"{where}/elements", json={"tle": tle(90002)})
    assert_problem(response, 422, "different_satellite", "/tle")
    assert stored(service) == (1, 1)


def test_a_real_catalogue_is_imported_whole_and_only_once(
    service: Service, shared_data: Path
) -> None:
    data = (shared_data / "elements" / "resource_2022-08-15.tle").read_bytes()
    body = send(service.client, IMPORT, data, "text/plain").json()
    assert (body["accepted"], body["rejected"], body["errors"]) == (180, 0, [])
    assert {item["status"] for item in body["items"]} == {"created"}
    again = send(service.client, IMPORT, data, "text/plain").json()
    assert again["accepted"] == 180
    assert {item["status"] for item in again["items"]} == {"unchanged"}
    assert [i["id"] for i in again["items"]] == [i["id"] for i in body["items"]]
    assert stored(service) == (180, 180)


OMM_FORMS = [
    ("derived_eo_2022-08-15.csv", "text/csv"),
    ("derived_eo_2022-08-15.json", "application/json"),
    ("derived_eo_2022-08-15.xml", "application/xml"),
    ("derived_eo_2022-08-15.tle", "text/plain"),
]


def test_the_same_orbits_in_any_form_are_the_same_satellites(
    service: Service, shared_data: Path
) -> None:
    ids = []
    for name, media_type in OMM_FORMS:
        data = (shared_data / "omm" / name).read_bytes()
        body = send(service.client, IMPORT, data, media_type).json()
        assert (body["accepted"], body["rejected"]) == (20, 0), name
        ids.append(sorted(item["id"] for item in body["items"]))
    assert ids == [ids[0]] * len(ids)
    assert stored(service) == (20, 20)


def test_a_bad_record_is_named_and_the_good_ones_are_stored(service: Service) -> None:
    broken = tle(90002)
    broken[1] = broken[1][:-1] + str((int(broken[1][-1]) + 1) % 10)
    text = "\r\n".join([*tle(90001), *broken, *tle(90003)])
    body = send(service.client, IMPORT, text, "text/plain; charset=utf-8").json()
    assert set(body) == {"accepted", "rejected", "items", "errors"}
    assert [item["norad_cat_id"] for item in body["items"]] == [90001, 90003]
    assert [(e["row"], e["code"]) for e in body["errors"]] == [(4, "tle_checksum")]
    assert stored(service) == (2, 2)


def test_reject_all_stores_nothing_when_one_record_is_bad(service: Service) -> None:
    text = "\n".join([*tle(90001), tle(90002)[0]])
    refused = send(service.client, f"{IMPORT}?on_error=reject_all", text, "text/plain")
    problem = assert_problem(refused, 422, "tle_missing_line")
    assert problem["errors"][0]["row"] == 3
    assert stored(service) == (0, 0)
    wrong = send(service.client, f"{IMPORT}?on_error=maybe", text, "text/plain")
    assert_problem(wrong, 422, "unknown_value")


def test_a_newer_epoch_joins_the_satellite_that_is_known(service: Service) -> None:
    send(service.client, IMPORT, "\n".join(tle()), "text/plain")
    newer = tle(epoch=EPOCH + timedelta(days=1))
    body = send(service.client, IMPORT, "\n".join(newer), "text/plain").json()
    assert [item["status"] for item in body["items"]] == ["elements_added"]
    shown = service.client.get(f"/v1/satellites/{body['items'][0]['id']}").json()
    assert shown["tle"] == newer
    assert stored(service) == (1, 2)


def test_each_bad_file_gets_what_its_table_says(service: Service, shared_data: Path) -> None:
    folder = shared_data / "elements" / "bad"
    with (folder / "EXPECTED.csv").open(newline="") as table:
        expected = {row["file"]: row["valid"] for row in csv.DictReader(table)}
    for name, valid in expected.items():
        response = send(service.client, IMPORT, (folder / name).read_bytes(), "text/plain")
        if valid == "no":
            assert response.status_code == 422, name
            assert response.json()["errors"], name
        elif valid.startswith("yes"):
            body = response.json()
            assert (body["accepted"], body["rejected"]) == (int(valid[5]), 0), name
        else:
            body = response.json()
            assert (body["accepted"], body["rejected"]) == (1, 1), name


def test_a_catalogue_number_is_taken_once(client: httpx.Client) -> None:
    first = post(client, "/v1/satellites", satellite(tle=tle()))
    second = client.post("/v1/satellites", json=satellite(name="rival", tle=tle()))
    assert_problem(second, 409, "duplicate_norad_cat_id")
    assert first["id"] in second.json()["detail"]
    lines = "\n".join(tle(epoch=EPOCH + timedelta(days=1)))
    imported = send(client, "/v1/satellites/import", lines, "text/plain").json()
    assert [item["id"] for item in imported["items"]] == [first["id"]]
    # After deleting the first one, another one may take its number.
    assert client.delete(f"/v1/satellites/{first['id']}").status_code == 204
    assert client.post("/v1/satellites", json=satellite(tle=tle())).status_code == 201


def test_any_number_of_satellites_may_have_no_catalogue_number(client: httpx.Client) -> None:
    made = [post(client, "/v1/satellites", satellite(tle=tle(0)))["id"] for _ in range(2)]
    assert len(set(made)) == 2
