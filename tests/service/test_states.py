"""States of satellites over files and HTTP: part of the scenario, and the start of plans."""

from __future__ import annotations

import hashlib
import json

import pytest

from planner_core.errors import InvalidScenario
from service.scenarios.canonical import canonical
from service.scenarios.translate import scenario_from_content
from tests.missions import drawn_targets, paper_mission
from tests.service.conftest import Service
from tests.service.factories import post
from tests.service.problems import assert_problem
from tests.service.test_plan_job import run
from tests.service.test_scenarios import PATH, question


def test_states_are_part_of_the_question_and_none_changes_no_hash() -> None:
    plain = paper_mission(drawn_targets(20))
    assert canonical(plain | {"states": []}) == canonical(plain)
    at = plain["horizon"]["start"]
    state = {"satellite_id": "PAPER", "at": at, "battery_fraction": 0.5}
    text = canonical(plain | {"states": [state]})
    assert text != canonical(plain)
    (stored,) = json.loads(text)["states"]
    assert set(stored) == {"satellite_id", "at", "battery_fraction"}
    assert canonical(json.loads(text)) == text
    (known,) = scenario_from_content(json.loads(text)).states
    assert (known.battery_fraction, known.recorder_fraction) == (0.5, None)


def test_a_job_begins_where_the_satellite_is() -> None:
    plain = paper_mission(drawn_targets(60))
    state = {
        "satellite_id": "PAPER", "at": plain["horizon"]["start"],
        "battery_fraction": 0.35, "recorder_fraction": 0.7,
    }  # fmt: skip
    full, low = (
        json.loads(run(file, "rule").timeline) for file in (plain, plain | {"states": [state]})
    )
    curve = low["satellites"][0]["resources"]
    assert curve["battery_fraction"][0] == pytest.approx(0.35)
    assert curve["recorder_fraction"][0] == pytest.approx(0.7)
    assert low["violations"] == []
    assert low["totals"]["reward"] <= full["totals"]["reward"]


def test_a_state_of_an_unknown_satellite_is_refused() -> None:
    plain = paper_mission(drawn_targets(5))
    state = {"satellite_id": "none", "at": plain["horizon"]["start"]}
    with pytest.raises(InvalidScenario) as caught:
        scenario_from_content(plain | {"states": [state]})
    fault = caught.value.fault
    assert (fault.code, fault.pointer) == ("unknown_satellite", "/states/0/satellite_id")


def test_states_are_stored_with_their_scenario(service: Service) -> None:
    body = question(service.client)
    state = {
        "satellite_id": body["satellite_ids"][0], "at": body["horizon"]["start"],
        "battery_fraction": 0.6, "recorder_fraction": None,
    }  # fmt: skip
    plain = post(service.client, PATH, body)
    scenario = post(service.client, PATH, body | {"states": [state]})
    assert plain["states"] == []
    assert scenario["sha256"] != plain["sha256"]
    told = {"at": "2026-03-01T00:00:00.000Z", "attitude": None, "on_board": None}
    assert scenario["states"] == [state | told]
    assert service.client.get(f"{PATH}/{scenario['id']}").json()["states"] == scenario["states"]
    file = service.client.get(f"{PATH}/{scenario['id']}?expand=true").json()
    assert hashlib.sha256(canonical(file).encode()).hexdigest() == scenario["sha256"]
    late = body | {"states": [state | {"at": body["horizon"]["end"]}]}
    assert_problem(service.client.post(PATH, json=late), 422, "value_out_of_range", "/states/0/at")
    beyond = body | {"states": [state | {"battery_fraction": 1.5}]}
    answer = service.client.post(PATH, json=beyond)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == "/states/0/battery_fraction"


@pytest.mark.parametrize(
    "attitude",
    ["sun", {"station_id": "sv"}, {"target_id": "t1"}, {"line_of_sight": [0.0, 0.6, 0.8]}],
)
def test_attitudes_come_back_as_they_are_sent(attitude: str | dict[str, object]) -> None:
    plain = paper_mission(drawn_targets(5))
    if isinstance(attitude, dict) and "station_id" in attitude:
        attitude = {"station_id": plain["ground_stations"][0]["name"]}
    if isinstance(attitude, dict) and "target_id" in attitude:
        attitude = {"target_id": plain["targets"][1]["id"]}
    state = {"satellite_id": "PAPER", "at": plain["horizon"]["start"], "attitude": attitude}
    text = canonical(plain | {"states": [state]})
    (stored,) = json.loads(text)["states"]
    assert stored["attitude"] == ({"sun": True} if attitude == "sun" else attitude)
    assert canonical(json.loads(text)) == text
    (known,) = scenario_from_content(json.loads(text)).states
    assert known.attitude is not None
    assert known.attitude.at_sun == (attitude == "sun")


@pytest.mark.parametrize(
    ("attitude", "pointer"),
    [
        ("moon", ""),
        ({}, ""),
        ({"sun": False}, "/sun"),
        ({"station_id": "a", "target_id": "b"}, ""),
        ({"line_of_sight": [1.0, 0.0]}, "/line_of_sight"),
        ({"line_of_sight": [1.0, 1.0, 0.0]}, "/line_of_sight"),
        ({"target_id": "none"}, "/target_id"),
    ],
)
def test_attitudes_that_cannot_be_are_refused(
    attitude: str | dict[str, object], pointer: str
) -> None:
    plain = paper_mission(drawn_targets(5))
    state = {"satellite_id": "PAPER", "at": plain["horizon"]["start"], "attitude": attitude}
    with pytest.raises(InvalidScenario) as caught:
        scenario_from_content(plain | {"states": [state]})
    assert (caught.value.fault.pointer or "").startswith("/states/0/attitude")
    assert (caught.value.fault.pointer or "").endswith(pointer)


def test_a_job_turns_from_where_the_satellite_looks() -> None:
    plain = paper_mission(drawn_targets(60))
    for satellite in plain["satellites"]:
        satellite["agility"] = {"slew_rate_deg_s": 0.2}
    state = {
        "satellite_id": "PAPER", "at": plain["horizon"]["start"],
        "attitude": {"line_of_sight": [0.0, 1.0, 0.0]},
    }  # fmt: skip
    free, turned = (
        json.loads(run(file, "rule").timeline) for file in (plain, plain | {"states": [state]})
    )
    assert turned["validity"] == "valid"
    tasks = [[a for a in line["satellites"][0]["actions"] if a["target_id"]]
             for line in (free, turned)]  # fmt: skip
    assert tasks[0][0]["slew"] is None
    slew = tasks[1][0]["slew"]
    assert 0.0 < slew["needed_s"] <= slew["available_s"]
    assert slew["needed_s"] == pytest.approx(slew["angle_deg"] / 0.2, rel=1e-6)


def test_what_is_on_board_is_told_with_the_plan() -> None:
    plain = paper_mission(drawn_targets(60))
    begin = plain["horizon"]["start"]
    names = [target["id"] for target in plain["targets"]]
    state = {
        "satellite_id": "PAPER", "at": begin, "recorder_fraction": 0.2,
        "on_board": [
            {"target_id": names[0], "collected_at": begin, "recorder_fraction": 0.01, "worth": 5.0},
            {"target_id": names[1], "collected_at": begin, "recorder_fraction": 0.01},
        ],
    }  # fmt: skip
    file = plain | {"states": [state], "objective": "delivered"}
    text = canonical(file)
    assert canonical(json.loads(text)) == text
    answer = run(file, "certified")
    timeline = json.loads(answer.timeline)
    (line,) = timeline["satellites"]
    first, second = line["on_board"]
    assert (first["target_id"], first["worth"], first["reward"]) == (names[0], 5.0, 5.0)
    assert first["delivered_at"] < second["delivered_at"]
    assert first["mbit"] is None
    assert timeline["totals"]["reward"] == pytest.approx(line["totals"]["reward"])
    assert timeline["totals"]["reward"] <= timeline["totals"]["bound"]
    earned = sum(a["reward"] for a in line["actions"]) + first["reward"] + second["reward"]
    assert timeline["totals"]["reward"] == pytest.approx(earned)
