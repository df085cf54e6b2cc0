"""A fleet through the API: a plan, its proof, exports and pages that hold all of it."""

from __future__ import annotations

import csv
import io
import json

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.certified.proofs.documents import from_json, is_proven
from service.scenarios.translate import scenario_from_content
from tests.missions import PAPER_ORBIT, Document, drawn_targets, paper_mission
from tests.service.jobs.mission import HALF_A_DAY, Mission

NUM_SATELLITES = 6


def fleet_mission() -> Document:
    """Return half a day of satellites in evenly spread planes, over the same targets."""
    satellites = [
        {
            "name": f"S{i}",
            "omm": PAPER_ORBIT
            | {
                "OBJECT_NAME": f"S{i}",
                "NORAD_CAT_ID": i + 1,
                "RA_OF_ASC_NODE": 360.0 * i / NUM_SATELLITES,
            },
            "agility": {"settle_s": 15.0},
        }
        for i in range(NUM_SATELLITES)
    ]
    return paper_mission(
        drawn_targets(400), satellites=satellites, use_resources=False, horizon=HALF_A_DAY
    )


def test_a_fleet_is_planned_proven_and_exported(mission: Mission) -> None:
    job = mission.plan(fleet_mission(), "certified", params={"gap": 0.02}, limits={"time_s": 60})
    timeline = mission.timeline(job)
    totals = timeline["totals"]
    assert timeline["validity"] == "valid"
    assert len(timeline["satellites"]) == NUM_SATELLITES
    assert totals["reward"] <= totals["bound"]
    assert totals["gap"] <= 0.02
    assert job["progress"]["reward"] == totals["reward"]

    content = mission.http.get(job["links"]["scenario"], params={"expand": True}).json()
    scenario = scenario_from_content(content)
    problem = build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())
    proof = mission.http.get(f"/v1/jobs/{job['id']}/proof")
    assert is_proven(problem, from_json(json.dumps(proof.json())))

    table = mission.http.get(f"{job['links']['timeline']}.csv").text
    rows = [row for row in csv.DictReader(io.StringIO(table)) if row["mode"] == "collect"]
    targets = mission.targets(job)
    collected = [name for name, told in targets.items() if told["outcome"] == "collected"]
    assert sorted(row["target_id"] for row in rows) == sorted(collected)
    assert len(rows) == totals["collects"] == totals["reward"] == len(collected)
