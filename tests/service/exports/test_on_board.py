"""Every form of a plan that begins with images on board: its contacts downlink them."""

from __future__ import annotations

import csv
import io
import json
from datetime import datetime

import pytest

from service.answers.passes import PassFilter, passes_of_plan
from service.exports.forms import FORMS
from service.scenarios.canonical import canonical
from service.scenarios.stored_question import StoredQuestion
from service.wire.timelines import TimelineOut
from tests.missions import Document
from tests.service.exports.conftest import Mission, mission_file
from tests.service.test_plan_job import run

SATELLITE = "sat/1#a"
MBIT = 60.0


@pytest.fixture(scope="module")
def followed() -> Mission:
    """A plan whose first satellite has two earlier images on board."""
    file = mission_file()
    begin = file["horizon"]["start"]
    first, second = (target["id"] for target in file["targets"][:2])
    state = {
        "satellite_id": SATELLITE, "at": begin, "recorder_fraction": 0.3,
        "on_board": [
            {"target_id": target_id, "collected_at": "2018-12-31T22:00:00Z", "mbit": MBIT}
            for target_id in (first, second)
        ],
    }  # fmt: skip
    file |= {"states": [state], "objective": "delivered"}
    return Mission(content=canonical(file), chunks=run(file, "rule").chunks)


@pytest.fixture(scope="module")
def old(followed: Mission) -> dict[str, Document]:
    """The earlier images, by target, as in the timeline; both are downlinked."""
    line = next(each for each in followed.document["satellites"] if each["id"] == SATELLITE)
    told = {image["target_id"]: image for image in line["on_board"]}
    assert len(told) == 2
    assert all(image["delivered_at"] is not None for image in told.values())
    return told


def written(mission: Mission, suffix: str) -> str:
    (form,) = (form for form in FORMS if form.suffix == suffix)
    return "".join(form.write(mission.answered))


def contacts_of(mission: Mission) -> list[Document]:
    return [
        action
        for satellite in mission.document["satellites"]
        for action in satellite["actions"]
        if action["mode"] == "contact"
    ]


def test_a_table_has_the_actions_of_the_plan_alone(
    followed: Mission, old: dict[str, Document]
) -> None:
    rows = list(csv.DictReader(io.StringIO(written(followed, "csv"))))
    assert {row["mode"] for row in rows} >= {"collect", "contact"}
    assert not {row["target_id"] for row in rows} & old.keys()
    assert sum(row["mode"] == "contact" for row in rows) == len(contacts_of(followed))


def test_a_map_shows_their_targets_as_downlinked(
    followed: Mission, old: dict[str, Document]
) -> None:
    features = json.loads(written(followed, "geojson"))["features"]
    targets = {f["properties"]["target_id"]: f["properties"] for f in features
               if f["properties"]["kind"] == "target"}  # fmt: skip
    for target_id in old:
        shown = targets[target_id]
        assert shown["outcome"] == "downlinked"
        assert shown["satellite_id"] == SATELLITE
        assert shown["reason"] is None
        assert shown["delivered_at"] == old[target_id]["delivered_at"]
        # No action of this plan took them.
        assert (shown["action_id"], shown["start"], shown["quality"]) == (None, None, None)


def test_a_map_says_when_each_image_is_on_the_ground(followed: Mission) -> None:
    told = {
        action["target_id"]: (action["delivered_at"], action["worth"])
        for satellite in followed.document["satellites"]
        for action in satellite["actions"]
        if action["mode"] == "collect" and action["reward"]
    }
    features = json.loads(written(followed, "geojson"))["features"]
    shown = {
        f["properties"]["target_id"]: (f["properties"]["delivered_at"], f["properties"]["worth"])
        for f in features
        if f["properties"]["kind"] == "target"
    }
    assert any(down is not None for down, _ in told.values())
    assert told.items() <= shown.items()


def test_moving_maps_calendars_and_open_mct_have_the_contacts(followed: Mission) -> None:
    number = len(contacts_of(followed))
    assert number > 0
    assert written(followed, "ics").count("BEGIN:VEVENT") == number
    packets = json.loads(written(followed, "czml"))
    assert packets[0]["id"] == "document"
    assert len({packet["id"] for packet in packets}) == len(packets)
    told = json.loads(written(followed, "openmct.json"))
    assert sum(len(group) for group in told.values()) >= number


def test_what_passes_bring_down_holds_them(followed: Mission, old: dict[str, Document]) -> None:
    timeline = TimelineOut.model_validate(followed.document)
    passes = passes_of_plan(StoredQuestion(followed.content), timeline, PassFilter())
    for image in old.values():
        down_at = datetime.fromisoformat(image["delivered_at"])
        (own,) = (
            one
            for one in passes
            if one.satellite_id == SATELLITE and one.planned and one.aos <= down_at <= one.los
        )
        assert own.volume_mbit is not None
        assert own.volume_mbit > 0.0
    planned = sum(one.volume_mbit or 0.0 for one in passes if one.satellite_id == SATELLITE)
    assert planned >= len(old) * MBIT
