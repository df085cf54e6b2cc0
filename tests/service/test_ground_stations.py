"""Ground stations over HTTP: one, GeoJSON, CSV, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.db.rows import GroundStationRow
from tests.service.conftest import Service
from tests.service.factories import ground_station, post, send
from tests.service.problems import assert_problem

IMPORT = "/v1/ground-stations/import"
GEOJSON = "application/geo+json"


def count(service: Service) -> int:
    with service.database.reading() as session:
        number = session.scalar(sa.select(sa.func.count()).select_from(GroundStationRow))
    assert number is not None
    return number


def feature(**changes: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [15.4, 78.2, 400]},
        "properties": {"name": "Svalbard", "provider": "x"},
    } | changes


def collection(*features: object) -> str:
    return json.dumps({"type": "FeatureCollection", "features": features})


def test_a_station_needs_a_name_and_a_place(client: httpx.Client) -> None:
    response = client.post("/v1/ground-stations", json=ground_station())
    body = response.json()
    assert response.status_code == 201
    assert (body["min_elevation_deg"], body["min_contact_s"], body["antennas"]) == (5.0, 0.0, 1)
    again = client.get(response.headers["location"])
    assert again.json() == body
    assert again.headers["etag"] == response.headers["etag"]
    assert client.delete(response.headers["location"]).status_code == 204
    assert_problem(client.get(response.headers["location"]), 404, "not_found")
    assert client.get("/v1/ground-stations").json()["items"] == []


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({"lat_deg": 90.5}, "value_out_of_range", "/lat_deg"),
        ({"lon_deg": -180.5}, "value_out_of_range", "/lon_deg"),
        ({"min_elevation_deg": 90}, "value_out_of_range", "/min_elevation_deg"),
        ({"antennas": 0}, "value_out_of_range", "/antennas"),
        ({"antennas": 1.5}, "invalid_value", "/antennas"),
        ({"elevation_mask": [[0, 5], [0, 6]]}, "value_out_of_range", "/elevation_mask/1"),
        ({"elevation_mask": [[0, 5, 7]]}, "value_out_of_range", "/elevation_mask/0"),
        ({"elevation_mask": [[0, 95]]}, "value_out_of_range", "/elevation_mask/0"),
        ({"latitude": 3}, "unknown_field", "/latitude"),
    ],
)
def test_a_bad_field_is_named(
    service: Service, change: dict[str, Any], code: str, pointer: str
) -> None:
    response = service.client.post("/v1/ground-stations", json=ground_station() | change)
    assert_problem(response, 422, code, pointer)
    assert count(service) == 0


@pytest.mark.parametrize(
    ("name", "number"), [("ksat", 36), ("aws", 12), ("ssc", 10), ("dsn", 3), ("nen", 18)]
)
def test_real_networks_are_imported_whole_and_only_once(
    service: Service, shared_data: Path, name: str, number: int
) -> None:
    data = (shared_data / "stations" / f"{name}.geojson").read_bytes()
    body = send(service.client, IMPORT, data, GEOJSON).json()
    assert (body["accepted"], body["rejected"], body["errors"]) == (number, 0, [])
    first = json.loads(data)["features"][0]
    shown = service.client.get(f"/v1/ground-stations/{body['items'][0]['id']}").json()
    assert shown["name"] == first["properties"]["name"]
    assert [shown["lon_deg"], shown["lat_deg"]] == first["geometry"]["coordinates"][:2]
    again = send(service.client, IMPORT, data, GEOJSON).json()
    assert [i["id"] for i in again["items"]] == [i["id"] for i in body["items"]]
    assert count(service) == len({item["id"] for item in body["items"]})


@pytest.mark.parametrize(
    ("bad", "code", "pointer"),
    [
        (feature(geometry=None), "malformed_geojson", "/features/1/geometry"),
        (feature(type="Point"), "malformed_geojson", "/features/1"),
        (
            feature(geometry={"type": "Point", "coordinates": [200.0, 95.0]}),
            "value_out_of_range",
            "/features/1/geometry/coordinates/1",
        ),
        (
            feature(geometry={"type": "Point", "coordinates": ["x", 5]}),
            "invalid_value",
            "/features/1/geometry/coordinates/0",
        ),
        (
            feature(geometry={"type": "Point", "coordinates": [5]}),
            "malformed_geojson",
            "/features/1/geometry/coordinates",
        ),
        (feature(properties={}), "missing_field", "/features/1/properties/name"),
        (
            feature(properties={"name": "x", "antennas": "two"}),
            "invalid_value",
            "/features/1/properties/antennas",
        ),
    ],
)
def test_a_bad_feature_is_reported_and_the_good_one_stored(
    service: Service, bad: dict[str, Any], code: str, pointer: str
) -> None:
    text = collection(feature(), bad)
    refused = send(service.client, f"{IMPORT}?on_error=reject_all", text, GEOJSON)
    assert_problem(refused, 422, code, pointer)
    assert count(service) == 0
    body = send(service.client, IMPORT, text, GEOJSON).json()
    assert (body["accepted"], body["rejected"]) == (1, 1)
    assert [(e["row"], e["code"]) for e in body["errors"]] == [(None, code)]
    assert body["errors"][0]["detail"].startswith(pointer + ": ")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "malformed_json"),
        ("[" * 5000, "malformed_json"),
        ("{}", "malformed_geojson"),
        ('{"type": "FeatureCollection"}', "malformed_geojson"),
        (collection(), "empty_file"),
        (b"\xff\xfa", "not_utf8"),
    ],
)
def test_what_is_no_collection_is_refused(client: httpx.Client, text: str, code: str) -> None:
    assert_problem(send(client, IMPORT, text, GEOJSON), 422, code)


def test_a_csv_of_stations_may_leave_cells_empty(service: Service) -> None:
    text = (
        "name,latitude,longitude,alt_m,antennas\r\n"
        '"Kiruna, north",67.9,21.1,,2\r\n'
        "Troll,-72.0,2.5,1200,two\r\n"
    )
    body = send(service.client, IMPORT, text, "text/csv").json()
    assert [item["row"] for item in body["items"]] == [2]
    assert [(e["row"], e["code"]) for e in body["errors"]] == [(3, "invalid_value")]
    shown = service.client.get("/v1/ground-stations").json()["items"]
    assert [(s["name"], s["alt_m"], s["antennas"]) for s in shown] == [("Kiruna, north", 0.0, 2)]


def test_stations_are_paged(client: httpx.Client) -> None:
    made = [post(client, "/v1/ground-stations", ground_station())["id"] for _ in range(3)]
    first = client.get("/v1/ground-stations?limit=2").json()
    second = client.get("/v1/ground-stations", params={"cursor": first["next"]}).json()
    assert [s["id"] for s in first["items"] + second["items"]] == made[::-1]
    assert second["next"] is None
