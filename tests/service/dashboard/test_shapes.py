"""The shapes that the pages' scripts rely on are the service's."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from planner_core.budget import Budget
from service.jobs.plan_job import run_plan_job
from service.jobs.plan_request import PlanRequest
from service.scenarios.canonical import canonical
from tests.missions import drawn_targets, paper_mission
from tests.service.conftest import contract

TYPES = Path(__file__).resolve().parents[3] / "service" / "dashboard" / "static" / "types.js"
# Documents that the OpenAPI document leaves open: compared with a real plan.
OF_TIMELINE = {
    "Timeline", "Totals", "TimelineSatellite", "ResourceCurves", "Action", "Slew", "Violation",
}  # fmt: skip
OF_TARGETS = {"Reason"}
NOT_OURS = {"Schema"}


def typedefs() -> dict[str, set[str]]:
    """Return the properties of each type that the scripts declare."""
    found: dict[str, set[str]] = {}
    for block in re.findall(r"/\*\*.*?\*/", TYPES.read_text(encoding="utf-8"), re.S):
        name = re.search(r"@typedef \{object\} (\w+)", block)
        if name:
            found[name[1]] = set(re.findall(r"@property \{.*\} \[?(\w+)", block))
    return found


def test_every_shape_of_the_scripts_is_one_of_the_service() -> None:
    schemas = contract().document["components"]["schemas"]
    declared = typedefs()
    from_openapi = set(declared) - OF_TIMELINE - OF_TARGETS - NOT_OURS
    assert len(from_openapi) > 10
    for name in from_openapi:
        assert name in schemas
        assert declared[name] - set(schemas[name]["properties"]) == set(), name


@pytest.fixture(scope="module")
def documents() -> tuple[dict[str, Any], list[dict[str, Any]]]:
    request = PlanRequest(
        job_id="j",
        scenario_sha256="0",
        content=canonical(paper_mission(drawn_targets(400))),
        solver="graph",
        params={"feasibility": "penalty"},  # whatever that does to battery and recorder
        seed=0,
        limits={"time_s": 60, "memory_mb": 2048},
    )
    answer = run_plan_job(request, Budget())
    return json.loads(answer.timeline), json.loads(answer.targets)


def test_every_shape_of_a_timeline_is_that_of_a_real_one(
    documents: tuple[dict[str, Any], list[dict[str, Any]]],
) -> None:
    timeline, targets = documents
    satellite = timeline["satellites"][0]
    real = {
        "Timeline": timeline,
        "Totals": timeline["totals"],
        "TimelineSatellite": satellite,
        "ResourceCurves": satellite["resources"],
        "Action": satellite["actions"][0],
        "Slew": next(a["slew"] for a in satellite["actions"] if a["slew"]),
        "Violation": timeline["violations"][0],
        "Reason": next(t["reason"] for t in targets if t["reason"]),
    }
    assert set(real) == OF_TIMELINE | OF_TARGETS
    declared = typedefs()
    for name, document in real.items():
        assert declared[name] - set(document) == set(), name


def test_eclipses_lie_in_the_horizon_and_are_about_a_third_of_a_low_orbit(
    documents: tuple[dict[str, Any], list[dict[str, Any]]],
) -> None:
    timeline, _ = documents
    eclipses = timeline["satellites"][0]["eclipses"]
    ends = [instant for eclipse in eclipses for instant in (eclipse["start"], eclipse["end"])]
    assert ends == sorted(ends)
    assert ends[0] >= timeline["horizon"]["start"]
    assert ends[-1] <= timeline["horizon"]["end"]
    assert 14 <= len(eclipses) <= 17
