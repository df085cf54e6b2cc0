"""The forms of a timeline over HTTP: by suffix, by ``Accept``, and repeated."""

from __future__ import annotations

import csv
import io

import httpx
import pytest

from service.answers.answered import Answered
from service.api.accept import preferred
from service.exports.forms import FORMS, Form
from tests.service.exports.conftest import Mission
from tests.service.problems import assert_problem


def test_the_document_comes_as_it_is_stored(
    client: httpx.Client, job_path: str, mission: Mission
) -> None:
    path = f"{job_path}/timeline"
    for accept in ("application/json", "application/*", "*/*", "text/html, */*;q=0.8"):
        answer = client.get(path, headers={"Accept": accept})
        assert answer.headers["content-type"] == "application/json"
        assert answer.text == mission.timeline
    known = {"If-None-Match": answer.headers["etag"]}
    assert client.get(path, headers=known).status_code == 304
    assert client.get(path + ".json", headers={"Accept": "text/csv"}).text == mission.timeline


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.suffix)
def test_each_form_comes_by_its_suffix(
    client: httpx.Client, job_path: str, answered: Answered, form: Form
) -> None:
    path = f"{job_path}/timeline.{form.suffix}"
    answer = client.get(path, headers={"Accept": "image/png"})
    assert answer.status_code == 200
    assert answer.headers["content-type"].partition(";")[0] == form.media_type
    assert answer.text == "".join(form.write(answered))
    job_id = job_path.rpartition("/")[2]
    name = f'inline; filename="timeline-{job_id}.{form.suffix}"'
    assert answer.headers["content-disposition"] == name
    assert answer.headers["vary"] == "Accept"
    again = client.get(path, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize("form", [f for f in FORMS if f.has_own_type], ids=lambda f: f.suffix)
def test_each_form_comes_by_its_media_type(client: httpx.Client, job_path: str, form: Form) -> None:
    accept = {"Accept": f"{form.media_type}, application/json;q=0.5"}
    by_type = client.get(f"{job_path}/timeline", headers=accept)
    by_suffix = client.get(f"{job_path}/timeline.{form.suffix}")
    assert by_type.text == by_suffix.text
    assert by_type.headers["etag"] == by_suffix.headers["etag"]


def test_every_form_has_an_etag_of_its_own(client: httpx.Client, job_path: str) -> None:
    suffixes = ["json", *(form.suffix for form in FORMS)]
    etags = {client.get(f"{job_path}/timeline.{s}").headers["etag"] for s in suffixes}
    assert len(etags) == len(suffixes)


def test_what_is_not_offered_is_told_what_is(client: httpx.Client, job_path: str) -> None:
    wrong = client.get(f"{job_path}/timeline", headers={"Accept": "image/png"})
    assert "application/geo+json" in assert_problem(wrong, 406, "not_acceptable")["detail"]
    wrong = client.get(f"{job_path}/timeline.docx")
    detail = assert_problem(wrong, 406, "not_acceptable")["detail"]
    for form in FORMS:
        assert f".{form.suffix}" in detail


def test_a_job_of_nobody_has_no_timeline(client: httpx.Client) -> None:
    for path in ("timeline", "timeline.geojson"):
        assert_problem(client.get(f"/v1/jobs/none/{path}"), 404, "not_found")


@pytest.mark.parametrize(
    ("accept", "chosen"),
    [
        (None, "a/json"),
        ("*/*", "a/json"),
        ("t/csv", "t/csv"),
        ("t/csv;q=0", None),
        ("t/csv;q=0, */*", "a/json"),
        ("*/*, t/csv", "t/csv"),
        ("a/*;q=0.3, t/*;q=0.4", "t/csv"),
        ("T/CSV ; q=0.7, a/json;q=0.9", "a/json"),
        ("t/csv;q=high", None),
        ("", "a/json"),
        ("image/png, text/html", None),
    ],
)
def test_the_best_liked_form_is_chosen(accept: str | None, chosen: str | None) -> None:
    assert preferred(accept, ["a/json", "t/csv"]) == chosen


def test_every_form_names_stations_and_satellites(
    client: httpx.Client, job_path: str, mission: Mission
) -> None:
    stations = {station.id: station.name for station in mission.scenario.ground_stations}
    contacts = [
        action
        for satellite in client.get(f"{job_path}/timeline.json").json()["satellites"]
        for action in satellite["actions"]
        if action["mode"] == "contact"
    ]
    assert contacts
    assert all(action["station_name"] == stations[action["station_id"]] for action in contacts)
    rows = list(csv.DictReader(io.StringIO(client.get(f"{job_path}/timeline.csv").text)))
    assert all(row["station_name"] == stations.get(row["station_id"], "") for row in rows)
    for one in client.get(f"{job_path}/timeline.geojson").json()["features"]:
        told = one["properties"]
        assert ("station_name" in told) == ("station_id" in told)
        if "satellite_id" in told:
            assert (told["satellite_name"] is None) == (told["satellite_id"] is None)
    packets = client.get(f"{job_path}/timeline.czml").json()
    seen = [one["properties"] for one in packets if "satellite_id" in one.get("properties", {})]
    assert seen
    assert all(one["satellite_name"] for one in seen)


def test_every_form_names_targets(client: httpx.Client, job_path: str) -> None:
    named, name = "-1+1", "=North, 'of it'"
    satellites = client.get(f"{job_path}/timeline.json").json()["satellites"]
    taken = [one for own in satellites for one in own["actions"] if one["mode"] == "collect"]
    assert {one["target_name"] for one in taken if one["target_id"] == named} == {name}
    assert {one["target_name"] for one in taken if one["target_id"] != named} == {None}
    rows = list(csv.DictReader(io.StringIO(client.get(f"{job_path}/timeline.csv").text)))
    # No cell is a formula.
    assert {r["target_name"] for r in rows if r["target_id"] == f"'{named}"} == {f"'{name}"}
    told = client.get(f"{job_path}/targets", params={"target_id": named}).json()["items"]
    assert [one["target_name"] for one in told] == [name]
    features = client.get(f"{job_path}/timeline.geojson").json()["features"]
    places = [one["properties"] for one in features if one["properties"]["kind"] == "target"]
    assert [one["target_name"] for one in places if one["target_id"] == named] == [name]
    packets = client.get(f"{job_path}/timeline.czml").json()
    assert [one["name"] for one in packets if one["id"] == f"target/{named}"] == [name]
    groups = client.get(f"{job_path}/timeline.openmct.json").json()
    assert name in {one["name"] for group in groups.values() for one in group}
