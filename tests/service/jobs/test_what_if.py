"""The same scenario with a change, planned by a real worker."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from service.commands.cli import main
from tests.missions import Document
from tests.service.jobs.mission import HIDDEN, ODD, Mission, small_mission
from tests.service.problems import assert_problem


def collected(mission: Mission, job: Document) -> set[str]:
    done = ("collected", "downlinked")
    return {own_id for own_id, t in mission.targets(job).items() if t["outcome"] in done}


def actions(mission: Mission, job: Document, mode: str) -> list[Document]:
    return [
        action
        for satellite in mission.timeline(job)["satellites"]
        for action in satellite["actions"]
        if action["mode"] == mode
    ]


def left_out(mission: Mission, job: Document, code: str) -> Document:
    """Return a target with this reason code and a change of settings that would let it in."""
    return next(
        target
        for target in mission.targets(job).values()
        if target["reason"] and target["reason"]["code"] == code and target["reason"]["change"]
    )


def test_forced_and_forbidden_targets_are_in_the_plan_and_out_of_it(
    mission: Mission, planned: Document
) -> None:
    wanted = left_out(mission, planned, "displaced_by")["target_id"]
    unwanted = actions(mission, planned, "collect")[0]["target_id"]
    contact = actions(mission, planned, "contact")[0]
    answer = mission.what_if(
        planned,
        force=[wanted],
        forbid=[unwanted, {"station_id": contact["station_id"], "start": contact["start"]}],
        label="what if",
    )
    job = mission.ended(answer)
    assert job["links"]["what_if_of"] == planned["links"]["self"]
    assert job["change"]["force"] == [wanted]
    assert job["scenario"]["id"] != planned["scenario"]["id"]
    assert [job[name] for name in ("solver", "params", "seed", "limits", "priority")] == [
        planned[name] for name in ("solver", "params", "seed", "limits", "priority")
    ]
    outcomes = mission.targets(job)
    assert outcomes[wanted]["outcome"] in ("collected", "downlinked")
    assert outcomes[unwanted]["outcome"] == "excluded"
    starts = [c["start"] for c in actions(mission, job, "contact")]
    assert contact["start"] not in starts
    assert mission.timeline(job)["validity"] == "valid"
    found = mission.http.get(f"/v1/jobs/{planned['id']}/diff/{job['id']}").json()
    assert found["questions_differ_in"] == ["scenario"]
    assert found["is_empty"] is False


def test_a_stated_change_of_settings_lets_the_target_in(
    mission: Mission, planned: Document
) -> None:
    reasons = [t for t in mission.targets(planned).values() if t["reason"]]
    target = next(t for t in reasons if "slew_rate_deg_s" in (t["reason"]["change"] or {}))
    change = target["reason"]["change"]
    job = mission.ended(mission.what_if(planned, force=[target["target_id"]], relax=change))
    assert mission.timeline(job)["validity"] == "valid"
    assert target["target_id"] in collected(mission, job)
    file = mission.http.get(f"{job['links']['scenario']}?expand=true").json()
    assert file["satellites"][0]["agility"]["slew_rate_deg_s"] == change["slew_rate_deg_s"]


def test_a_stated_change_of_actions_makes_room(mission: Mission, planned: Document) -> None:
    reasons = [t for t in mission.targets(planned).values() if t["reason"]]
    target = next(t for t in reasons if "drop_actions" in (t["reason"]["change"] or {}))
    change = target["reason"]["change"]
    dropped = [a for a in actions(mission, planned, "collect") if a["id"] in change["drop_actions"]]
    job = mission.ended(mission.what_if(planned, force=[target["target_id"]], relax=change))
    assert target["target_id"] in collected(mission, job)
    starts = {(a["target_id"], a["start"]) for a in actions(mission, job, "collect")}
    assert starts.isdisjoint({(a["target_id"], a["start"]) for a in dropped})


def test_a_change_of_access_gives_the_target_opportunities(
    mission: Mission, planned: Document
) -> None:
    changes = mission.explain(planned, HIDDEN).json()["access_changes"]
    assert changes
    for change in changes:
        job = mission.ended(mission.what_if(planned, relax=change))
        listed = mission.http.get(
            f"{job['links']['scenario']}/opportunities", params={"target_id": HIDDEN}
        ).json()["items"]
        assert listed, change
        (reason,) = [mission.targets(job)[HIDDEN]["reason"]]
        assert reason is None or reason["code"] != "no_access"


def test_fractions_of_a_preset_are_frozen_and_can_be_solved_without_the_service(
    mission: Mission, planned: Document, tmp_path: Path
) -> None:
    relax = {"battery_min_fraction": 0.6, "horizon_end": "2019-01-01T10:00:00Z"}
    job = mission.ended(mission.what_if(planned, relax=relax, solver="rule", seed=3))
    assert job["seed"] == 3
    file = mission.http.get(f"{job['links']['scenario']}?expand=true").json()
    assert file["satellites"][0]["resources"]["preset"] == "paper"
    assert file["satellites"][0]["resources"]["battery_min_fraction"] == 0.6
    assert file["horizon"]["end"] == "2019-01-01T10:00:00.000Z"
    (tmp_path / "day.json").write_text(json.dumps(file))
    out = tmp_path / "out.json"
    given = [f"--param={name}={json.dumps(value)}" for name, value in job["params"].items()]
    asked = ["solve", str(tmp_path / "day.json"), "--solver", "rule", "--seed", "3", *given]
    assert main([*asked, "--out", str(out)]) == 0
    alone, timeline = json.loads(out.read_text()), mission.timeline(job)
    assert alone["scenario_sha256"] == timeline["scenario_sha256"] == job["scenario"]["sha256"]
    assert alone["plan_sha256"] == timeline["plan_sha256"]
    assert timeline["totals"]["battery_min_fraction"] >= 0.6


def test_the_quality_of_a_question_stays_when_something_else_changes(mission: Mission) -> None:
    quality = {"off_nadir_deg": [[5, 1], [55, 0.3]]}
    job = mission.plan(small_mission(quality=quality))
    varied = mission.ended(mission.what_if(job, forbid=[ODD]))
    file = mission.http.get(f"{varied['links']['scenario']}?expand=true").json()
    assert file["quality"] == quality | {"sun_elevation_deg": []}
    totals = mission.timeline(varied)["totals"]
    assert 0.3 < totals["quality_mean"] < 1.0
    imaged = totals["targets"]["collected"] + totals["targets"]["downlinked"]
    assert totals["reward"] == pytest.approx(totals["quality_mean"] * imaged, rel=1e-6)
    diff = mission.http.get(f"/v1/jobs/{job['id']}/diff/{varied['id']}").json()
    assert diff["questions_differ_in"] == ["scenario"]


def test_a_change_of_nothing_new_is_the_same_scenario(mission: Mission, planned: Document) -> None:
    change = {"satellite_id": "PAPER", "slew_rate_deg_s": 1.0, "battery_min_fraction": 0.3}
    job = mission.ended(mission.what_if(planned, relax=change))
    assert job["scenario"] == planned["scenario"]


def test_a_repeat_under_the_same_key_makes_one_job(mission: Mission, planned: Document) -> None:
    path, body = f"/v1/jobs/{planned['id']}/what-if", {"forbid": [ODD]}
    headers = {"Idempotency-Key": "what-if-once"}
    first, again = (mission.http.post(path, json=body, headers=headers) for _ in range(2))
    assert again.headers["idempotency-replayed"] == "true"
    assert again.json() == first.json()
    mission.ended(first)


BEFORE, A_YEAR_ON = "2018-01-01T00:00:00Z", "2020-01-01T00:00:00Z"
LATE = {"station_id": "Svalbard", "start": "2019-01-01T23:00:00Z"}


@pytest.mark.parametrize(
    ("change", "code", "pointer"),
    [
        ({}, "invalid_value", ""),
        ({"seed": 4}, "invalid_value", ""),
        ({"force": ["none"]}, "unknown_target", "/force/0"),
        ({"forbid": [ODD, {"target_id": "none"}]}, "unknown_target", "/forbid/1/target_id"),
        ({"force": [HIDDEN]}, "pin_without_opportunity", "/force/0"),
        ({"force": [LATE]}, "pin_without_opportunity", "/force/0"),
        ({"force": [ODD], "forbid": [ODD]}, "pins_conflict", "/force/0"),
        ({"relax": {"slew_rate": 2}}, "unknown_field", "/relax/slew_rate"),
        ({"relax": {"slew_rate_deg_s": 0}}, "value_out_of_range", "/relax/slew_rate_deg_s"),
        ({"relax": {"collect_power_w": 3}}, "unknown_field", "/relax/collect_power_w"),
        (
            {"relax": {"satellites": {"no/such": {"settle_s": 1}}}},
            "unknown_satellite",
            "/relax/satellites/no~1such",
        ),
        (
            {"relax": {"targets": {HIDDEN: {"off_nadir_max_deg": 91}}}},
            "value_out_of_range",
            "/relax/targets/hidden~1one/off_nadir_max_deg",
        ),
        ({"relax": {"horizon_end": BEFORE}}, "horizon_inverted", "/relax/horizon_end"),
        ({"relax": {"horizon_end": A_YEAR_ON}}, "horizon_too_long", "/relax/horizon_end"),
        ({"relax": {"drop_actions": ["a0"]}}, "unknown_action", "/relax/drop_actions/0"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_where_it_stands(
    mission: Mission, planned: Document, change: Document, code: str, pointer: str
) -> None:
    problem = assert_problem(mission.what_if(planned, **change), 422, code)
    (fault,) = problem["errors"]
    assert (fault["pointer"], bool(fault["detail"])) == (pointer, True)


def test_forced_contacts_that_exclude_each_other_name_both(mission: Mission) -> None:
    first = mission.plan(small_mission())
    contact = actions(mission, first, "contact")[0]
    pins: dict[str, Any] = {"skip": [{"opportunity_id": contact["opportunity_id"]}]}
    job = mission.plan(small_mission(pins=pins))
    booked = {"station_id": contact["station_id"], "start": contact["start"]}
    refused = assert_problem(mission.what_if(job, force=[booked]), 422, "pins_conflict")
    assert refused["errors"][0]["pointer"] == "/force/0"


def test_what_is_not_planned_yet_can_be_changed_where_the_plan_does_not_matter(
    mission: Mission,
) -> None:
    body = {"scenario": small_mission(), "solver": "mcts", "limits": {"time_s": 60}}
    running = mission.http.post("/v1/jobs", json=body).json()
    assert_problem(mission.what_if(running, force=[ODD]), 409, "not_ready")
    accepted = mission.what_if(running, forbid=[ODD], solver="rule")
    mission.http.post(f"{running['links']['self']}/cancel")
    assert mission.ended(accepted)["solver"] == "rule"
