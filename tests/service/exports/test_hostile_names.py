"""Names made to break files: a third-party parser reads every form, with names unharmed."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator

import czml3
import pytest
from ical.calendar_stream import IcsCalendarStream
from shapely.geometry import shape

from planner_core.spreadsheets import unguarded
from service.answers.answered import Answered
from service.exports import calendar, czml, geojson, table
from service.scenarios.canonical import canonical
from tests.service.answers import answered_of
from tests.service.exports.conftest import FINISHED_AT, Mission, mission_file
from tests.service.test_plan_job import run

HOSTILE = (
    'a"b\\"c,d;e:f', "\\n\\N\\;\\,", "END:VEVENT", "=cmd|' /C calc'!A0", "'=1+1", "</script><b>",
    "]]>&lt;&amp;", '{"$ref":"#"}', "a" * 200, "😀" * 100, "\u05d0\u05d1 \u0627\u0644",
    "%0d%0aX: y",
    "BEGIN:VALARM\\nTRIGGER:-PT1S", "' OR 1=1 --", "../../etc/passwd", "\ufeffbom",
    "A\u00a0B\u3000C",
)  # fmt: skip


@pytest.fixture(scope="module")
def hostile() -> tuple[Mission, Answered]:
    """A mission in which everything with a name or an id of its own has a hostile one."""
    file = mission_file()
    stations, targets = file["ground_stations"], file["targets"]
    for number, name in enumerate(HOSTILE):
        targets[number]["id"] = name
    for number, part in enumerate([*file["satellites"], *stations]):
        part |= {"name": HOSTILE[number], "id": HOSTILE[-1 - number]}
    mission = Mission(content=canonical(file), chunks=run(file, "rule").chunks)
    return mission, answered_of(mission.timeline, mission.targets, mission.content, FINISHED_AT)


def text_of(chunks: Iterator[str]) -> str:
    return "".join(chunks)


def test_calendars(hostile: tuple[Mission, Answered]) -> None:
    mission, answered = hostile
    text = text_of(calendar.write(answered))
    events = IcsCalendarStream.calendar_from_ics(text).events
    contacts = [a for _, a in answered.each_action() if a["mode"] == "contact"]
    assert len(events) == len(contacts) > 0
    assert all(len(line.encode()) <= 75 for line in text.split("\r\n"))
    names = {station.name for station in mission.scenario.ground_stations}
    assert any(name in str(event.summary) for event in events for name in names)


def test_tables(hostile: tuple[Mission, Answered]) -> None:
    _, answered = hostile
    rows = list(csv.DictReader(io.StringIO(text_of(table.write(answered)), newline="")))
    for row, (satellite, action) in zip(rows, answered.each_action(), strict=True):
        assert unguarded(row["satellite_name"]) == satellite["name"]
        assert unguarded(row["target_id"]) == (action["target_id"] or "")
        assert not any(cell[:1] in ("=", "+", "@") for cell in row.values())


def test_maps(hostile: tuple[Mission, Answered]) -> None:
    mission, answered = hostile
    text = text_of(geojson.write(answered))
    document = json.loads(text)
    for feature in document["features"]:
        assert shape(feature["geometry"]).is_valid
    told = json.dumps(document, ensure_ascii=False)
    for target in mission.scenario.targets:
        assert json.dumps(target.id, ensure_ascii=False) in told


def test_globes(hostile: tuple[Mission, Answered]) -> None:
    mission, answered = hostile
    packets = json.loads(text_of(czml.write(answered)))
    czml3.Document.model_validate({"packets": packets})
    ids = [packet["id"] for packet in packets]
    assert len(ids) == len(set(ids))
    names = {packet.get("name") for packet in packets}
    assert {satellite.name for satellite in mission.scenario.satellites} <= names
