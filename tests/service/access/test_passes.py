"""The passes of a plan, compared with its contacts and recorder, as JSON, table and calendar."""

from __future__ import annotations

import csv
import io
import json
from datetime import datetime
from typing import Any

import pytest
import sqlalchemy as sa
from icalendar import Calendar

from planner_core.spreadsheets import guarded
from service.db.rows import ScenarioRow
from tests.service.access.conftest import Desk, Door
from tests.service.exports.conftest import Mission
from tests.service.problems import assert_problem

Document = dict[str, Any]


@pytest.fixture
def lead(door: Door) -> dict[str, str]:
    return door.key("approve")


@pytest.fixture
def plan(desk: Desk, lead: dict[str, str]) -> Document:
    drafted = desk.draft(lead)
    with desk.door.jobs.database.transaction() as session:
        session.execute(sa.update(ScenarioRow).values(content=desk.mission.content))
    return drafted


def listed(desk: Desk, plan: Document, key: dict[str, str], **query: str) -> list[Document]:
    found: list[Document] = []
    address: str | None = f"/v1/plans/{plan['id']}/passes"
    params: dict[str, str] | None = {"limit": "17"} | query
    while address:
        answer = desk.door.client.get(address, params=params, headers=key)
        assert answer.status_code == 200, answer.text
        found += answer.json()["items"]
        address, params = answer.links.get("next", {}).get("url"), None
    return found


def contacts(mission: Mission) -> list[tuple[Document, Document]]:
    return [
        (satellite, action)
        for satellite in mission.document["satellites"]
        for action in satellite["actions"]
        if action["mode"] == "contact"
    ]


def test_every_contact_lies_in_its_pass(
    desk: Desk,
    plan: Document,
    lead: dict[str, str],
) -> None:
    passes = listed(desk, plan, lead)
    assert [one["aos"] for one in passes] == sorted(one["aos"] for one in passes)
    held = {action_id: one for one in passes for action_id in one["action_ids"]}
    wanted = contacts(desk.mission)
    assert wanted
    assert held.keys() == {action["id"] for _, action in wanted}
    for satellite, action in wanted:
        one = held[action["id"]]
        assert (one["satellite_id"], one["station_id"]) == (satellite["id"], action["station_id"])
        assert one["aos"] <= action["start"] < action["end"] <= one["los"]
        assert one["planned"]
        assert one["aos"] <= one["tca"] <= one["los"]
    assert {one["planned"] for one in passes} == {True, False}


def test_volumes_are_what_leaves_the_recorders(
    desk: Desk,
    plan: Document,
    lead: dict[str, str],
) -> None:
    passes = listed(desk, plan, lead)
    question = desk.mission.answered.question
    for told, satellite in zip(
        desk.mission.document["satellites"], question.satellites, strict=True
    ):
        resources = satellite.resources
        capacity_mbit = resources.recorder_capacity_mbit
        assert capacity_mbit is not None
        collects_s = sum(
            seconds(action) for action in told["actions"] if action["mode"] == "collect"
        )
        day_s = question.horizon.duration_s
        recorded = resources.collect_fill_per_s * collects_s + resources.telemetry_per_s * day_s
        kept = told["resources"]["recorder_fraction"][-1] - resources.initial_recorder_fraction
        down_mbit = sum(
            one["volume_mbit"] or 0.0 for one in passes if one["satellite_id"] == told["id"]
        )
        assert down_mbit == pytest.approx((recorded - kept) * capacity_mbit, rel=1e-3, abs=1.0)
        assert down_mbit > 0.0
    assert all((one["volume_mbit"] is None) != one["planned"] for one in passes)


def seconds(action: Document) -> float:
    start, end = (datetime.fromisoformat(action[name]) for name in ("start", "end"))
    return (end - start).total_seconds()


def test_passes_are_narrowed(
    desk: Desk,
    plan: Document,
    lead: dict[str, str],
) -> None:
    passes = listed(desk, plan, lead)
    station, other = passes[0]["station_id"], passes[0]["satellite_id"]
    assert listed(desk, plan, lead, station_id=station) == [
        one for one in passes if one["station_id"] == station
    ]
    assert listed(desk, plan, lead, satellite_id=other, planned="true") == [
        one for one in passes if one["satellite_id"] == other and one["planned"]
    ]
    from_, to = "2019-01-01T06:00:00.000Z", "2019-01-01T14:00:00.000Z"
    shift = listed(desk, plan, lead, **{"from": from_, "to": to})
    assert shift == [one for one in passes if one["los"] > from_ and one["aos"] < to]
    assert 0 < len(shift) < len(passes)


def test_the_table_is_the_list_and_runs_nothing(
    desk: Desk,
    plan: Document,
    lead: dict[str, str],
) -> None:
    passes = listed(desk, plan, lead)
    answer = desk.door.client.get(f"/v1/plans/{plan['id']}/passes.csv", headers=lead)
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    for row, one in zip(rows, passes, strict=True):
        assert [row[name] for name in ("aos", "tca", "los")] == [
            one[name] for name in ("aos", "tca", "los")
        ]
        assert row["satellite_name"] == guarded(one["satellite_name"])
        assert row["planned"] == str(one["planned"]).lower()
        assert row["volume_mbit"] == ("" if one["volume_mbit"] is None else str(one["volume_mbit"]))
    assert any(row["satellite_name"].startswith("'=") for row in rows)


def test_the_calendar_has_an_entry_for_each_pass(
    desk: Desk,
    plan: Document,
    lead: dict[str, str],
) -> None:
    passes = listed(desk, plan, lead)
    address = f"/v1/plans/{plan['id']}/passes.ics"
    answer = desk.door.client.get(address, headers=lead)
    assert answer.headers["content-type"].startswith("text/calendar")
    events: list[Any] = Calendar.from_ical(answer.text).walk("VEVENT")
    assert len({event["UID"] for event in events}) == len(events) == len(passes)
    for event, one in zip(events, passes, strict=True):
        assert event["DTSTART"].dt <= datetime.fromisoformat(one["aos"])
        assert event["DTEND"].dt >= datetime.fromisoformat(one["los"])
        assert ("(not planned)" in event["SUMMARY"]) != one["planned"]
        assert bool(event.walk("VALARM")) == one["planned"]
    planned = desk.door.client.get(address, params={"planned": True}, headers=lead)
    assert planned.text.count("BEGIN:VEVENT") == sum(one["planned"] for one in passes)


def test_two_satellites_in_one_orbit_want_the_station_at_once(
    desk: Desk, plan: Document, lead: dict[str, str]
) -> None:
    question = json.loads(desk.mission.content)
    question["satellites"][1]["omm"] = question["satellites"][0]["omm"]
    content = json.dumps(question, sort_keys=True, separators=(",", ":"))
    with desk.door.jobs.database.transaction() as session:
        session.execute(sa.update(ScenarioRow).values(content=content))
    passes = listed(desk, plan, lead)
    assert {one["satellite_id"] for one in passes} == {
        satellite["id"] for satellite in question["satellites"]
    }
    for one in passes:
        (other,) = one["conflicts"]
        assert other["satellite_id"] != one["satellite_id"]
        assert (other["aos"], other["los"]) == (one["aos"], one["los"])


def test_others_see_no_passes(desk: Desk, plan: Document, lead: dict[str, str]) -> None:
    stranger = desk.door.key("submit", owner="stranger")
    for part in ("passes", "passes.csv"):
        answer = desk.door.client.get(f"/v1/plans/{plan['id']}/{part}", headers=stranger)
        assert_problem(answer, 404, "not_found")
    unknown = desk.door.client.get(f"/v1/plans/{plan['id']}/passes.pdf", headers=lead)
    assert_problem(unknown, 406, "not_acceptable")
