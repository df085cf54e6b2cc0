"""Pins over files and HTTP: accepted, hashed, refused with a pointer."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from service.scenarios.canonical import canonical, sha256_of
from service.scenarios.translate import scenario_from_content
from service.wire.pins import OF_ACTIONS
from service.wire.plans import PlanActionOut
from service.wire.timelines import ActionOut
from tests.missions import Document, drawn_targets, paper_mission
from tests.service.conftest import Service
from tests.service.factories import post, satellite
from tests.service.problems import assert_problem
from tests.service.test_plan_job import run
from tests.service.test_scenarios import PATH, question

START = "2019-01-01T03:00:00Z"
END = "2019-01-01T04:00:00Z"
BLOCK = {"satellite_id": "PAPER", "start": START, "end": END}


def mission(**pins: Any) -> Document:
    return paper_mission(drawn_targets(60), **({"pins": pins} if pins else {}))


def test_a_scenario_without_pins_keeps_its_hash() -> None:
    plain = paper_mission(drawn_targets(20))
    # As before pins existed.
    known = "a71fdbf590481341cc28bfbd86fbd64fa895abd501d371ae88ec13216d2d9b10"
    assert sha256_of(canonical(plain)) == known
    nothing: list[dict[str, Any]] = [{}, {"keep": []}, {"forbid": [], "block": []}]
    for empty in nothing:
        assert sha256_of(canonical(plain | {"pins": empty})) == known


def test_pins_are_part_of_the_question_and_survive_it() -> None:
    file = mission(block=[BLOCK], forbid=[drawn_targets(60)[0]["id"]])
    text = canonical(file)
    assert text != canonical(mission())
    assert canonical(json.loads(text)) == text
    assert scenario_from_content(json.loads(text)) == scenario_from_content(file)


def test_a_pinned_job_answers_with_what_is_pinned() -> None:
    first = json.loads(run(mission(), "rule").timeline)
    (satellite,) = first["satellites"]
    collects = [a for a in satellite["actions"] if a["mode"] == "collect"]
    contact = next(a for a in satellite["actions"] if a["mode"] == "contact")
    kept, forbidden = collects[1], collects[0]["target_id"]
    answer = run(
        mission(
            keep=[
                {"station_id": contact["station_id"], "start": contact["start"]},
                {"opportunity_id": kept["opportunity_id"]},
            ],
            block=[BLOCK | {"modes": ["collect"]}],
            forbid=[forbidden],
        ),
        "forward_search",
    )
    timeline, targets = json.loads(answer.timeline), json.loads(answer.targets)
    assert timeline["validity"] == "valid"
    (satellite,) = timeline["satellites"]
    ids = {a["opportunity_id"] for a in satellite["actions"]}
    assert {contact["opportunity_id"], kept["opportunity_id"]} <= ids
    for action in satellite["actions"]:
        if action["mode"] == "collect":
            assert action["end"] <= "2019-01-01T03:00:00.000Z" or action["start"] >= END
    outcomes = {t["target_id"]: t for t in targets}
    assert outcomes[forbidden]["outcome"] == "excluded"
    assert outcomes[forbidden]["reason"]["code"] == "excluded"
    assert timeline["totals"]["targets"]["excluded"] >= 1
    assert sum(timeline["totals"]["targets"].values()) == 60


def test_reasons_tell_the_change_and_what_it_earns() -> None:
    targets = json.loads(run(paper_mission(drawn_targets(400)), "rule").targets)
    reasons = [t["reason"] for t in targets if t["reason"] is not None]
    dropping = [r for r in reasons if r["change"] and "drop_actions" in r["change"]]
    setting = [r for r in reasons if r["change"] and "slew_rate_deg_s" in r["change"]]
    assert setting
    for reason in dropping:
        assert reason["change"]["drop_actions"] == reason["blocking_actions"]
        assert isinstance(reason["reward_delta"], float)
    for reason in setting:
        assert reason["change"]["slew_rate_deg_s"] > 1.0
        assert reason["change"]["satellite_id"] == "PAPER"


@pytest.mark.parametrize(
    ("pins", "code", "pointer"),
    [
        ({"keep": [{}]}, "value_out_of_range", "/pins/keep/0"),
        ({"keep": [{"target_id": "none"}]}, "unknown_target", "/pins/keep/0/target_id"),
        ({"skip": [{"station_id": "none"}]}, "unknown_ground_station", "/pins/skip/0/station_id"),
        (
            {"block": [BLOCK | {"satellite_id": "none"}]},
            "unknown_satellite",
            "/pins/block/0/satellite_id",
        ),
        ({"block": [BLOCK | {"end": START}]}, "value_out_of_range", "/pins/block/0/end"),
        ({"block": [BLOCK | {"modes": ["nap"]}]}, "unknown_value", "/pins/block/0/modes/0"),
        ({"forbid": ["none"]}, "unknown_target", "/pins/forbid/0"),
        ({"forbidden": []}, "unknown_field", "/pins/forbidden"),
    ],
)
def test_pins_that_name_nothing_are_refused_where_they_stand(
    service: Service, pins: dict[str, Any], code: str, pointer: str
) -> None:
    asked = question(service.client, pins=pins)
    if pins.get("block") and pins["block"][0]["satellite_id"] == "PAPER":
        pins["block"][0]["satellite_id"] = asked["satellite_ids"][0]
    problem = assert_problem(service.client.post(PATH, json=asked), 422, code)
    assert problem["errors"][0]["pointer"] == pointer


def test_a_scenario_shows_its_pins(service: Service) -> None:
    asked = question(service.client)
    plain = post(service.client, PATH, asked)
    pins = {"forbid": ["0/0"], "keep": [{"target_id": "20/0", "start": "2026-03-01T01:00:00Z"}]}
    pinned = post(service.client, PATH, asked | {"pins": pins})
    assert pinned["sha256"] != plain["sha256"]
    assert pinned["pins"]["forbid"] == ["0/0"]
    assert pinned["pins"]["keep"][0]["start"] == "2026-03-01T01:00:00.000Z"
    assert plain["pins"] == {"keep": [], "skip": [], "block": [], "forbid": []}
    file = service.client.get(f"{PATH}/{pinned['id']}", params={"expand": True}).json()
    assert sha256_of(canonical(file)) == pinned["sha256"]


@pytest.mark.parametrize("kind", ["keep", "skip"])
def test_actions_of_a_timeline_are_pins_as_they_are(kind: str) -> None:
    first = json.loads(run(mission(), "rule").timeline)
    (satellite,) = first["satellites"]
    wanted = [a for a in satellite["actions"] if a["mode"] in ("collect", "contact")]
    assert {a["mode"] for a in wanted} == {"collect", "contact"}
    timeline = json.loads(run(mission(**{kind: wanted}), "rule").timeline)
    assert timeline["validity"] == "valid"
    (satellite,) = timeline["satellites"]
    planned = {a["opportunity_id"] for a in satellite["actions"]}
    named = {a["opportunity_id"] for a in wanted}
    assert named <= planned if kind == "keep" else not named & planned


def test_pins_know_all_that_actions_tell() -> None:
    told = ActionOut.model_fields.keys() | PlanActionOut.model_fields.keys() | {"satellite_name"}
    assert told == OF_ACTIONS


def test_idle_time_is_no_pin(service: Service) -> None:
    asked = question(service.client)
    idle = {"mode": "sunpoint", "start": "2026-03-01T01:00:00Z", "end": "2026-03-01T01:10:00Z"}
    answer = service.client.post(PATH, json=asked | {"pins": {"keep": [idle]}})
    problem = assert_problem(answer, 422, problem_code(answer))
    assert problem["errors"][0]["pointer"] == "/pins/keep/0"
    assert "collects and contacts" in problem["errors"][0]["detail"]


def test_what_is_no_part_of_an_action_is_refused_beside_its_mode(service: Service) -> None:
    asked = question(service.client)
    pin = {"mode": "collect", "target_id": "20/0", "colour": "red"}
    answer = service.client.post(PATH, json=asked | {"pins": {"keep": [pin]}})
    problem = assert_problem(answer, 422, problem_code(answer))
    assert problem["errors"][0]["pointer"] == "/pins/keep/0/colour"


def test_names_stand_for_ids_where_one_has_the_name(service: Service) -> None:
    client = service.client
    asked = question(client)
    (satellite_id,), (station_id,) = asked["satellite_ids"], asked["ground_station_ids"]
    span = {"start": "2026-03-01T01:00:00Z", "end": "2026-03-01T01:10:00Z"}
    satellite_name = client.get(f"/v1/satellites/{satellite_id}").json()["name"]
    station_name = client.get(f"/v1/ground-stations/{station_id}").json()["name"]
    named = {
        "keep": [{"station_id": station_name, "satellite_id": satellite_name} | span],
        "block": [{"satellite_id": satellite_name} | span],
    }
    by_id = {
        "keep": [{"station_id": station_id, "satellite_id": satellite_id} | span],
        "block": [{"satellite_id": satellite_id} | span],
    }
    one = post(client, PATH, asked | {"pins": named})
    assert one["pins"]["keep"][0]["station_id"] == station_id
    again = client.post(PATH, json=asked | {"pins": by_id})
    assert again.json()["id"] == one["id"]
    # A name and its id are the same pin.
    twice = asked | {"pins": {"block": named["block"] + by_id["block"]}}
    problem = assert_problem(client.post(PATH, json=twice), 422, "duplicate_pin")
    assert problem["errors"][0]["pointer"] == "/pins/block/1"
    rival = post(client, "/v1/satellites", satellite(name=satellite_name))["id"]
    both = asked | {"satellite_ids": [satellite_id, rival], "pins": named}
    problem = assert_problem(client.post(PATH, json=both), 422, "ambiguous_name")
    assert problem["errors"][0]["pointer"] == "/pins/keep/0/satellite_id"


def problem_code(answer: httpx.Response) -> str:
    return str(answer.json()["code"])
