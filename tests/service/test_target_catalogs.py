"""Target catalogues over HTTP: three formats, every bad row named, none partly stored."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import httpx
import pytest
import sqlalchemy as sa

from service.db.rows import TargetCatalogRow, TargetRow
from tests.service.conftest import Service
from tests.service.factories import send, target
from tests.service.problems import assert_problem

PATH = "/v1/target-catalogs"


def stored(service: Service) -> tuple[int, int]:
    with service.database.reading() as session:
        catalogs = session.scalar(sa.select(sa.func.count()).select_from(TargetCatalogRow))
        targets = session.scalar(sa.select(sa.func.count()).select_from(TargetRow))
    assert catalogs is not None
    assert targets is not None
    return catalogs, targets


def targets_of(client: httpx.Client, catalog: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    path = catalog["links"]["targets"] + "?limit=500"
    while path:
        response = client.get(path)
        found += response.json()["items"]
        path = response.links.get("next", {}).get("url", "")
    return found


def catalog(*targets: dict[str, Any]) -> dict[str, Any]:
    return {"name": "Points", "targets": list(targets)}


def test_a_json_catalogue_fills_in_defaults(client: httpx.Client) -> None:
    response = client.post(PATH, json=catalog(target(), target(id="t2", reward=3)))
    assert response.status_code == 201
    body = response.json()
    assert (body["name"], body["num_targets"]) == ("Points", 2)
    assert client.get(response.headers["location"]).json()["id"] == body["id"]
    assert targets_of(client, body)[1] == {
        "id": "t2",
        "lat_deg": 47.0,
        "lon_deg": 8.0,
        "name": None,
        "alt_m": 0.0,
        "reward": 3.0,
        "collect_s": 30.0,
        "off_nadir_min_deg": None,
        "off_nadir_max_deg": None,
        "min_elevation_deg": None,
        "look_side": "any",
        "sun_elevation_min_deg": None,
        "sun_elevation_max_deg": None,
        "local_time_from_h": None,
        "local_time_to_h": None,
        "orbit_direction": "any",
        "release": None,
        "due": None,
        "sensor_type": None,
        "reward_half_life_s": None,
    }


@pytest.mark.parametrize(
    ("bad", "code", "pointer"),
    [
        (target(id="t2", lat_deg=91), "value_out_of_range", "/targets/1/lat_deg"),
        (target(id="t2", reward=-1), "value_out_of_range", "/targets/1/reward"),
        (target(id="t2", reward="1"), "invalid_value", "/targets/1/reward"),
        (target(id="t2", rewrad=1), "unknown_field", "/targets/1/rewrad"),
        (target(), "duplicate_target_id", "/targets/1/id"),
        ({"id": "t2", "lat_deg": 3}, "missing_field", "/targets/1/lon_deg"),
        (
            target(id="t2", off_nadir_min_deg=30, off_nadir_max_deg=20),
            "value_out_of_range",
            "/targets/1/off_nadir_max_deg",
        ),
        (
            target(id="t2", release="2026-03-01T10:00:00Z", due="2026-03-01T10:00:00Z"),
            "value_out_of_range",
            "/targets/1/due",
        ),
        (target(id="t2", due="2026-03-01T10:00:00"), "naive_time", "/targets/1/due"),
        (target(id="t2", release=1772323200), "invalid_time", "/targets/1/release"),
        (target(id="t2", sensor_type=""), "value_out_of_range", "/targets/1/sensor_type"),
        (target(id="t2", sensor_type="a\nb"), "invalid_value", "/targets/1/sensor_type"),
    ],
)
def test_one_bad_target_refuses_the_catalogue(
    service: Service, bad: dict[str, Any], code: str, pointer: str
) -> None:
    response = service.client.post(PATH, json=catalog(target(), bad))
    assert_problem(response, 422, code, pointer)
    assert stored(service) == (0, 0)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "malformed_json"),
        ("{", "malformed_json"),
        ('{"name": "x"}', "missing_field"),
        ('{"name": "x", "targets": []}', "value_out_of_range"),
        ("[]", "invalid_value"),
        ('{"name": "x", "targets": [{"id": "a", "lat_deg": NaN, "lon_deg": 1}]}', "not_finite"),
    ],
)
def test_what_is_no_catalogue_is_refused(service: Service, text: str, code: str) -> None:
    assert_problem(send(service.client, PATH, text, "application/json"), 422, code)
    assert stored(service) == (0, 0)


@pytest.mark.parametrize(
    ("name", "number"),
    [("landsat_dev_half.csv", 3267), ("worldcities_top2000.csv", 2000)],
)
def test_real_csv_files_are_stored_whole_and_in_order(
    service: Service, shared_data: Path, name: str, number: int
) -> None:
    data = (shared_data / "targets" / name).read_bytes()
    response = send(service.client, f"{PATH}?name=Real", data, "text/csv")
    assert response.status_code == 201, response.text
    body = response.json()
    assert (body["name"], body["num_targets"]) == ("Real", number)
    shown = targets_of(service.client, body)
    ids = [line.split(",")[0] for line in data.decode().splitlines()[1:]]
    assert [one["id"] for one in shown] == ids
    assert stored(service) == (1, number)


def test_a_real_file_drawn_with_replacement_has_its_repeats_named(
    service: Service, shared_data: Path
) -> None:
    data = (shared_data / "targets" / "landsat_1200.csv").read_bytes()
    problem = assert_problem(
        send(service.client, PATH, data, "text/csv"), 422, "duplicate_target_id"
    )
    assert len(problem["errors"]) == 1200 - 1153
    assert stored(service) == (0, 0)


def test_csv_may_be_quoted_with_bom_crlf_blank_lines_and_other_columns(
    client: httpx.Client,
) -> None:
    text = (
        "\ufeff Lat ,lng,ID,note,reward\r\n"
        '1.5,2.5,"a, ""b""","two\r\nlines",\r\n'
        "\r\n"
        "-1e1,+190.0,c,,2\r\n"
    )
    body = send(client, PATH, text, "text/csv").json()
    assert body["ignored_columns"] == ["note"]
    first, second = targets_of(client, body)
    assert (first["id"], first["lat_deg"], first["lon_deg"]) == ('a, "b"', 1.5, 2.5)
    assert (second["lat_deg"], second["lon_deg"], second["reward"]) == (-10.0, 190.0, 2.0)


HEADER = "id,lat_deg,lon_deg,reward\n"


@pytest.mark.parametrize(
    ("row", "code", "hint"),
    [
        ("b,95,10,1", "value_out_of_range", "lat_deg"),
        ("b,151.2,-33.9,1", "value_out_of_range", "swapped"),
        ("b,10,361,1", "value_out_of_range", "lon_deg"),
        ("b,ten,10,1", "invalid_value", "lat_deg"),
        ("b,nan,10,1", "invalid_value", "lat_deg"),
        ("b,inf,10,1", "invalid_value", "lat_deg"),
        ("b,1e999,10,1", "not_finite", "lat_deg"),
        ("b,1_0,10,1", "invalid_value", "lat_deg"),
        ("b,,10,1", "missing_field", "lat_deg"),
        (",10,10,1", "missing_field", "id"),
        ("b,10,10,-1", "value_out_of_range", "reward"),
        ("b,10,10", "malformed_csv", "3 cells"),
        ("b,10,10,1,2", "malformed_csv", "5 cells"),
        ('b"c",10,10,1', None, ""),
        ("a,10,10,1", "duplicate_target_id", "line 2"),
    ],
)
def test_a_bad_row_is_named_by_its_line_and_nothing_is_stored(
    service: Service, row: str, code: str | None, hint: str
) -> None:
    text = f"{HEADER}a,10,20,1\n\n{row}\nz,10,20,1\n"
    response = send(service.client, PATH, text, "text/csv")
    if code is None:
        assert response.status_code == 201
        return
    problem = assert_problem(response, 422, code)
    assert [(e["row"], e["pointer"]) for e in problem["errors"]] == [(4, None)]
    assert hint in problem["errors"][0]["detail"]
    assert stored(service) == (0, 0)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "empty_file"),
        (HEADER, "empty_file"),
        ("id,lat_deg\na,1\n", "missing_field"),
        ("id,lat,lat_deg,lon\na,1,1,1\n", "malformed_csv"),
        ("id,lat,lon,rewards\na,1,1,1\n", "unknown_field"),
        ("id|lat|lon\na|1|1\n", "missing_field"),
        ("id;lat;lon\na;1.234,5;1\n", "invalid_value"),
        ("id;lat;lon\na;1,2,3;1\n", "invalid_value"),
        (HEADER + '"a', "malformed_csv"),
        (HEADER + "a\x00,1,1,1", "invalid_value"),
        (b"\xff\xfe\x00", "not_utf8"),
    ],
)
def test_an_unreadable_file_is_refused(service: Service, text: str | bytes, code: str) -> None:
    assert_problem(send(service.client, PATH, text, "text/csv"), 422, code)
    assert stored(service) == (0, 0)


@pytest.mark.parametrize(
    "data",
    [
        b"id;lat;lon;reward;name\na;48,5;-3,25;2;x,y\nb;-1;10;1,5;\n",
        b"id;lat;lon;reward;name\na;48.5;-3.25;2;x,y\nb;-1;10;1.5;\n",
        b"id\tlat\tlon\treward\na\t48,5\t-3,25\t2\nb\t-1\t10\t1,5\n",
        "id,lat,lon,reward\r\na,48.5,-3.25,2\r\nb,-1,10,1.5\r\n".encode("utf-16"),
        b"\xfe\xff" + "id;lat;lon;reward\na;48,5;-3,25;2\nb;-1;10;1,5\n".encode("utf-16-be"),
    ],
)
def test_files_of_spreadsheets_are_read_as_they_come(client: httpx.Client, data: bytes) -> None:
    answer = send(client, PATH, data, "text/csv")
    assert answer.status_code == 201, answer.text
    targets = client.get(f"{PATH}/{answer.json()['id']}/targets").json()["items"]
    places = [(one["lat_deg"], one["lon_deg"], one["reward"]) for one in targets]
    assert places == [(48.5, -3.25, 2.0), (-1.0, 10.0, 1.5)]


def test_every_bad_row_is_named_up_to_a_hundred(service: Service) -> None:
    rows = "".join(f"t{i},{95 if i % 2 else 5},1,1\n" for i in range(400))
    problem = assert_problem(
        send(service.client, PATH, HEADER + rows, "text/csv"), 422, "value_out_of_range"
    )
    assert [e["row"] for e in problem["errors"]] == list(range(3, 203, 2))
    assert "100 more" in problem["detail"]
    assert stored(service) == (0, 0)


def test_ten_thousand_rows_go_in_one_call(service: Service) -> None:
    rows = "".join(f"t{i},{i % 90},{i % 180},1\n" for i in range(10_000))
    body = send(service.client, PATH, HEADER + rows, "text/csv").json()
    assert body["num_targets"] == 10_000
    assert stored(service) == (1, 10_000)


TIMED = "id,lat_deg,lon_deg,release,due,sensor_type\n"


def test_times_and_sensor_types_come_from_csv_and_geojson_alike(client: httpx.Client) -> None:
    text = f"{TIMED}a,1,2,2026-03-01T12:00:00+02:00,2026-03-01T11:30:00.5Z,4\nb,1,2,,,\n"
    point = {"type": "Point", "coordinates": [2.0, 1.0]}
    wanted = {"release": "2026-03-01T10:00:00Z", "due": "2026-03-01T11:30:00.500Z"}
    features = [
        {"type": "Feature", "id": "a", "geometry": point,
         "properties": wanted | {"sensor_type": "4"}},
        {"type": "Feature", "id": "b", "geometry": point, "properties": {"release": None}},
    ]  # fmt: skip
    collection = json.dumps({"type": "FeatureCollection", "features": features})
    found = [
        targets_of(client, send(client, PATH, content, media_type).json())
        for content, media_type in ((text, "text/csv"), (collection, "application/geo+json"))
    ]
    assert found[0] == found[1]
    first, second = found[0]
    assert first["release"] == "2026-03-01T10:00:00.000Z"
    assert (first["due"], first["sensor_type"]) == ("2026-03-01T11:30:00.500Z", "4")
    assert (second["release"], second["due"], second["sensor_type"]) == (None, None, None)


@pytest.mark.parametrize(
    ("cells", "code", "words"),
    [
        ("2026-03-01T10:00:00Z,2026-03-01T09:00:00Z,", "value_out_of_range",
         "due is 2026-03-01T09:00:00Z: it must be later than release"),
        ("2026-03-01T10:00:00,,", "naive_time", "release"),
        (",2026-02-30T10:00:00Z,", "invalid_time", "due"),
        (",tomorrow,", "invalid_time", "due"),
        (f",,{'x' * 101}", "value_out_of_range", "sensor_type"),
    ],
)  # fmt: skip
def test_a_bad_time_is_named_by_row_and_field(
    service: Service, cells: str, code: str, words: str
) -> None:
    text = f"{TIMED}a,1,2,,,\nb,1,2,{cells}\n"
    problem = assert_problem(send(service.client, PATH, text, "text/csv"), 422, code)
    assert [(e["row"], e["pointer"]) for e in problem["errors"]] == [(3, None)]
    assert words in problem["errors"][0]["detail"]
    assert stored(service) == (0, 0)


def test_geojson_points_keep_their_ids_altitudes_and_properties(client: httpx.Client) -> None:
    features = [
        {
            "type": "Feature",
            "id": 7,
            "geometry": {"type": "Point", "coordinates": [-180, 5, 120]},
            "properties": {"reward": 4, "collect_s": 20.5, "colour": "red"},
        },
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [180.0, -5.0]},
            "properties": {"id": "b", "reward": None},
        },
    ]
    text = json.dumps({"type": "FeatureCollection", "name": "From a map", "features": features})
    body = send(client, PATH, text, "application/geo+json").json()
    assert body["name"] == "From a map"
    first, second = targets_of(client, body)
    assert (first["id"], first["lon_deg"], first["alt_m"]) == ("7", -180.0, 120.0)
    assert (first["reward"], first["collect_s"]) == (4.0, 20.5)
    assert (second["id"], second["lon_deg"], second["reward"]) == ("b", 180.0, 1.0)


def test_a_geojson_fault_points_into_the_document(service: Service) -> None:
    point = {"type": "Point", "coordinates": [1, 2]}
    features = [
        {"type": "Feature", "id": "a", "geometry": point, "properties": None},
        {"type": "Feature", "geometry": point, "properties": {"reward": "much"}},
        {"type": "Feature", "id": "a", "geometry": point, "properties": None},
    ]
    text = json.dumps({"type": "FeatureCollection", "features": features})
    response = send(service.client, PATH, text, "application/geo+json")
    problem = assert_problem(response, 422, "invalid_request")
    assert [(e["code"], e["pointer"]) for e in problem["errors"]] == [
        ("missing_field", "/features/1/id"),
        ("invalid_value", "/features/1/properties/reward"),
        ("duplicate_target_id", "/features/2/id"),
    ]
    assert stored(service) == (0, 0)


def test_a_catalogue_of_another_type_is_415(client: httpx.Client) -> None:
    response = send(client, PATH, b"x", "application/vnd.ms-excel")
    problem = assert_problem(response, 415, "unsupported_media_type")
    assert "text/csv" in str(problem["detail"])


def test_a_deleted_catalogue_is_gone(client: httpx.Client) -> None:
    response = client.post(PATH, json=catalog(target()))
    where = response.headers["location"]
    assert client.delete(where).status_code == 204
    assert_problem(client.get(where), 404, "not_found")
    assert_problem(client.get(where + "/targets"), 404, "not_found")
    assert client.get(PATH).json()["items"] == []


def test_a_cursor_of_another_list_is_refused(client: httpx.Client) -> None:
    where = client.post(PATH, json=catalog(target())).headers["location"]
    assert_problem(client.get(f"{where}/targets?cursor=YWJj"), 422, "invalid_cursor")


@pytest.mark.parametrize("column", ["name", "city", "City"])
def test_targets_have_names_beside_their_ids(service: Service, column: str) -> None:
    text = f"id,{column},lat,lon\n007,Bern,46.9,7.4\n008,,-0.2,-78.5\n"
    answer = send(service.client, "/v1/target-catalogs", text, "text/csv").json()
    assert answer["ignored_columns"] == []
    targets = service.client.get(answer["links"]["targets"]).json()["items"]
    assert [(one["id"], one["name"]) for one in targets] == [("007", "Bern"), ("008", None)]


def test_a_column_of_cities_is_no_name_where_there_is_one(service: Service) -> None:
    text = "id,name,city,lat,lon\nt,Zytglogge,Bern,46.9,7.4\n"
    answer = send(service.client, "/v1/target-catalogs", text, "text/csv").json()
    assert answer["ignored_columns"] == ["city"]
    (target,) = service.client.get(answer["links"]["targets"]).json()["items"]
    assert target["name"] == "Zytglogge"
