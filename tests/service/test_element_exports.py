"""Orbits exported over HTTP, and imported again."""

from __future__ import annotations

import httpx
import pytest

from tests.service.factories import post, satellite, send, tle
from tests.service.problems import assert_problem

FORMS = {
    "json": "application/json",
    "csv": "text/csv",
    "xml": "application/xml",
    "kvn": "text/plain",
}
OMM = {
    "NORAD_CAT_ID": 123_456_789,
    "EPOCH": "2026-03-01T12:00:00",
    "MEAN_MOTION": 15.2,
    "ECCENTRICITY": 0.001,
    "INCLINATION": 97.6,
    "RA_OF_ASC_NODE": 10,
    "ARG_OF_PERICENTER": 20,
    "MEAN_ANOMALY": 30,
    "BSTAR": 0.0001,
}


@pytest.fixture
def satellite_ids(client: httpx.Client) -> list[str]:
    bodies = [satellite(tle=tle(90001)), {"name": "Nine digits", "omm": OMM}]
    return [post(client, "/v1/satellites", body)["id"] for body in bodies]


@pytest.mark.parametrize(("suffix", "media_type"), FORMS.items())
def test_our_own_file_is_taken_back_and_changes_nothing(
    client: httpx.Client, satellite_ids: list[str], suffix: str, media_type: str
) -> None:
    answer = client.get(f"/v1/satellites/omm.{suffix}")
    assert answer.headers["content-type"].partition(";")[0] == media_type
    assert "satellites.omm." + suffix in answer.headers["content-disposition"]
    back = send(client, "/v1/satellites/import", answer.content, media_type).json()
    assert [item["id"] for item in back["items"]] == satellite_ids
    assert {item["status"] for item in back["items"]} == {"unchanged"}
    assert back["errors"] == []


@pytest.mark.parametrize("suffix", FORMS)
def test_one_satellite_is_a_file_with_the_elements_in_force(
    client: httpx.Client, satellite_ids: list[str], suffix: str
) -> None:
    path = f"/v1/satellites/{satellite_ids[1]}"
    before = client.get(f"{path}/omm.{suffix}")
    assert "2026-03-01T12:00:00" in before.text
    known = {"If-None-Match": before.headers["etag"]}
    assert client.get(f"{path}/omm.{suffix}", headers=known).status_code == 304
    newer = client.put(f"{path}/elements", json={"omm": OMM | {"EPOCH": "2026-03-02T12:00:00"}})
    assert newer.status_code == 200
    after = client.get(f"{path}/omm.{suffix}", headers=known)
    assert after.status_code == 200
    assert "2026-03-02T12:00:00" in after.text
    assert "2026-03-01T12:00:00" not in after.text


def test_a_tle_gets_the_name_of_its_satellite(
    client: httpx.Client, satellite_ids: list[str]
) -> None:
    (message,) = client.get(f"/v1/satellites/{satellite_ids[0]}/omm.json").json()
    assert (message["OBJECT_NAME"], message["NORAD_CAT_ID"]) == ("EYE-1", 90001)


def test_deleted_satellites_are_in_no_file(client: httpx.Client, satellite_ids: list[str]) -> None:
    client.delete(f"/v1/satellites/{satellite_ids[0]}")
    (left,) = client.get("/v1/satellites/omm.json").json()
    assert left["NORAD_CAT_ID"] == 123_456_789
    gone = client.get(f"/v1/satellites/{satellite_ids[0]}/omm.json")
    assert_problem(gone, 404, "not_found")


def test_other_forms_are_refused_with_those_there_are(
    client: httpx.Client, satellite_ids: list[str]
) -> None:
    for path in ("/v1/satellites", f"/v1/satellites/{satellite_ids[0]}"):
        refused = client.get(f"{path}/omm.tle")
        assert ".json, .csv, .xml, .kvn" in assert_problem(refused, 406, "not_acceptable")["detail"]
