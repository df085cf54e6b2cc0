"""The plan file of Open MCT against a schema written from the documentation of its plan plugin."""

from __future__ import annotations

import json
from datetime import UTC, datetime

import pytest
from jsonschema import Draft202012Validator

from service.answers.answered import Answered
from service.exports import openmct
from tests.missions import Document
from tests.service.exports.conftest import Mission

INSTANT_MS: Document = {"type": "integer", "minimum": 0}
PLAN: Document = {
    "type": "object",
    "additionalProperties": {
        "type": "array",
        "minItems": 1,
        "items": {
            "type": "object",
            "required": ["name", "start", "end", "type", "color", "textColor"],
            "additionalProperties": False,
            "properties": {
                "id": {"type": "string"},
                "name": {"type": "string", "minLength": 1},
                "start": INSTANT_MS,
                "end": INSTANT_MS,
                "type": {"type": "string"},
                "color": {"type": "string", "pattern": "^#[0-9a-f]{6}$"},
                "textColor": {"type": "string", "pattern": "^#[0-9a-f]{6}$"},
            },
        },
    },
}


def plan_of(answered: Answered) -> Document:
    plan: Document = json.loads("".join(openmct.write(answered)))
    Draft202012Validator(PLAN).validate(plan)
    return plan


@pytest.fixture
def plan(answered: Answered) -> Document:
    return plan_of(answered)


def test_every_action_is_an_activity_at_its_time(plan: Document, answered: Answered) -> None:
    activities = {a["id"]: a for group in plan.values() for a in group}
    actions = list(answered.each_action())
    assert len(activities) == len(actions)
    for satellite, action in actions:
        shown = activities[f"{satellite['id']}/{action['id']}"]
        for name in ("start", "end"):
            at = datetime.fromtimestamp(shown[name] / 1000.0, UTC)
            assert at == datetime.fromisoformat(action[name])
        name = action["target_name"] or action["target_id"] or action["station_name"] or "sun"
        assert shown["name"] == name


def test_groups_are_satellites_and_modes(plan: Document) -> None:
    satellites = ("=EYE, 1", 'EYE "2"')
    modes = ("collects", "contacts", "sun-pointing")
    assert set(plan) == {f"{satellite}: {mode}" for satellite in satellites for mode in modes}
    for name, group in plan.items():
        assert {activity["type"] for activity in group} == {name}


def test_satellites_of_one_name_are_told_apart(mission: Mission) -> None:
    satellites = [satellite | {"name": "EYE"} for satellite in mission.document["satellites"]]
    plan = plan_of(mission.with_timeline(satellites=satellites))
    assert "EYE (sat/1#a): collects" in plan
    assert len(plan) == 6


def test_an_empty_plan_has_no_groups(mission: Mission) -> None:
    assert plan_of(mission.with_timeline(satellites=[])) == {}
