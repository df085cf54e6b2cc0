"""A battery or recorder that is beyond its limit before anything is planned."""

from __future__ import annotations

import json
from typing import Any

import pytest

from service.answers.chunks import timeline_text
from tests.missions import Document, drawn_targets, paper_mission
from tests.service.test_plan_job import run


def planned(solver: str = "rule", **resources: Any) -> Document:
    """Return the timeline of a mission that begins with these resources."""
    file = paper_mission(drawn_targets(20))
    file["satellites"][0]["resources"] = {"preset": "paper"} | resources
    timeline: Document = json.loads(timeline_text(run(file, solver).chunks))
    return timeline


@pytest.mark.parametrize(
    ("code", "resources"),
    [
        ("battery", {"initial_battery_fraction": 0.1, "battery_min_fraction": 0.3}),
        ("battery", {"initial_battery_fraction": 0.0, "battery_min_fraction": 1.0}),
        ("recorder", {"initial_recorder_fraction": 0.9, "recorder_max_fraction": 0.75}),
    ],
)
def test_a_limit_broken_at_the_start_is_told_as_inherited(
    code: str, resources: dict[str, Any]
) -> None:
    timeline = planned(**resources)
    first = next(v for v in timeline["violations"] if v["code"] == code)
    assert timeline["validity"] != "valid"
    assert first["at"] == timeline["horizon"]["start"]
    assert first["inherited"] == (not first["actions"])
    has_own = any(v["code"] != "duplicate" and not v["inherited"] for v in timeline["violations"])
    assert timeline["validity"] == ("violations" if has_own else "inherited")


def test_an_empty_battery_is_no_fault_of_a_plan_that_waits() -> None:
    timeline = planned(initial_battery_fraction=0.1, battery_min_fraction=0.3)
    assert timeline["validity"] == "inherited"
    assert [v["inherited"] for v in timeline["violations"]] == [True]


def test_contacts_empty_a_recorder_that_is_too_full() -> None:
    timeline = planned("certified", initial_recorder_fraction=0.9, recorder_max_fraction=0.75)
    tasks = [a for a in timeline["satellites"][0]["actions"] if a["mode"] in ("collect", "contact")]
    assert timeline["validity"] == "inherited"
    assert tasks[0]["mode"] == "contact"
    assert 0.0 < timeline["totals"]["reward"] <= timeline["totals"]["bound"]


def test_a_mission_within_its_limits_inherits_nothing() -> None:
    timeline = planned()
    assert (timeline["validity"], timeline["violations"]) == ("valid", [])
