"""Outages over files and HTTP: copied by scenarios, honoured by jobs, gone when deleted."""

from __future__ import annotations

import json

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.errors import InvalidScenario
from planner_core.problem import CONTACT
from service.scenarios.canonical import canonical
from service.scenarios.translate import scenario_from_content
from service.wire.instants import instant_text
from tests.missions import drawn_targets, paper_mission
from tests.service.conftest import Service
from tests.service.factories import post
from tests.service.problems import assert_problem
from tests.service.test_plan_job import run
from tests.service.test_scenarios import PATH, question

SPAN = {"start": "2019-01-01T03:00:00Z", "end": "2019-01-01T05:00:00Z"}


def test_outages_are_part_of_the_question_and_none_changes_no_hash() -> None:
    plain = paper_mission(drawn_targets(20))
    assert canonical(plain | {"outages": []}) == canonical(plain)
    file = plain | {"outages": [{"satellite_id": "PAPER", **SPAN, "reason": "safe mode"}]}
    text = canonical(file)
    assert text != canonical(plain)
    assert canonical(json.loads(text)) == text
    (outage,) = scenario_from_content(json.loads(text)).outages
    assert (outage.satellite_id, outage.reason) == ("PAPER", "safe mode")


@pytest.mark.parametrize(
    ("outage", "code", "pointer"),
    [
        (SPAN, "value_out_of_range", "/outages/0"),
        ({"satellite_id": "PAPER", "station_id": "x", **SPAN}, "value_out_of_range", "/outages/0"),
        ({"satellite_id": "none", **SPAN}, "unknown_satellite", "/outages/0/satellite_id"),
        ({"station_id": "none", **SPAN}, "unknown_ground_station", "/outages/0/station_id"),
        (
            {"satellite_id": "PAPER", "start": SPAN["end"], "end": SPAN["start"]},
            "value_out_of_range",
            "/outages/0/end",
        ),
    ],
)
def test_impossible_outages_are_refused(outage: dict[str, str], code: str, pointer: str) -> None:
    with pytest.raises(InvalidScenario) as caught:
        scenario_from_content(paper_mission(drawn_targets(5)) | {"outages": [outage]})
    assert (caught.value.fault.code, caught.value.fault.pointer) == (code, pointer)


def test_a_job_plans_around_an_outage() -> None:
    file = paper_mission(drawn_targets(60)) | {"outages": [{"satellite_id": "PAPER", **SPAN}]}
    timeline = json.loads(run(file, "forward_search").timeline)
    assert "outage" not in {v["code"] for v in timeline["violations"]}
    tasks = [
        action
        for satellite in timeline["satellites"]
        for action in satellite["actions"]
        if action["mode"] in ("collect", "contact")
    ]
    assert len(tasks) > 10
    assert all(a["end"] <= "2019-01-01T03:00:00.000Z" or a["start"] >= SPAN["end"] for a in tasks)


def test_a_skip_over_a_span_skips_all_it_touches() -> None:
    file = paper_mission(drawn_targets(5))
    budget = Budget()
    computed = compute_opportunities(scenario_from_content(file), budget)

    def contacts(**pins: object) -> list[tuple[str, str]]:
        scenario = scenario_from_content(file | ({"pins": pins} if pins else {}))
        table = build_problem(scenario, computed, budget).opportunities
        rows = np.flatnonzero((table.kind == CONTACT) & (table.site == 0))
        return [
            (instant_text(scenario.horizon.instant(table.start_s[row])),
             instant_text(scenario.horizon.instant(table.end_s[row])))
            for row in rows
        ]  # fmt: skip

    whole = contacts()
    assert len(whole) > 2
    station_id = file["ground_stations"][0].get("id") or file["ground_stations"][0]["name"]
    span = {"station_id": station_id, "start": whole[0][0], "end": whole[1][1]}
    assert contacts(skip=[span]) == whole[2:]
    # The span of one contact, in whole seconds, matches that contact only.
    own = span | {"start": whole[1][0][:19] + "Z", "end": whole[1][1][:19] + "Z"}
    assert contacts(skip=[own]) == [whole[0], *whole[2:]]
    with pytest.raises(InvalidScenario) as caught:
        contacts(skip=[span | {"start": file["horizon"]["start"], "end": file["horizon"]["start"]}])
    assert caught.value.fault.code == "pin_without_opportunity"


def test_stored_outages_go_with_scenarios_of_their_span(service: Service) -> None:
    body = question(service.client)
    satellite_id = body["satellite_ids"][0]
    span = body["horizon"]
    own = post(
        service.client, "/v1/outages", {"satellite_id": satellite_id, **span, "reason": "safe"}
    )
    assert own["satellite_name"]
    before = {"start": "2001-01-01T00:00:00Z", "end": "2001-01-02T00:00:00Z"}
    post(service.client, "/v1/outages", {"satellite_id": satellite_id, **before})
    scenario = post(service.client, PATH, body)
    assert [(o["id"], o["reason"]) for o in scenario["outages"]] == [(own["id"], "safe")]
    file = service.client.get(f"{PATH}/{scenario['id']}?expand=true").json()
    assert [o["id"] for o in file["outages"]] == [own["id"]]

    listed = service.client.get("/v1/outages", params={"from": span["start"]}).json()["items"]
    assert [o["id"] for o in listed] == [own["id"]]
    assert service.client.delete(f"/v1/outages/{own['id']}").status_code == 204
    assert_problem(service.client.get(f"/v1/outages/{own['id']}"), 404, "not_found")
    assert post(service.client, PATH, body)["outages"] == []
    assert service.client.get(f"{PATH}/{scenario['id']}").json()["outages"] == scenario["outages"]


def test_an_outage_of_nothing_is_refused(service: Service) -> None:
    answer = service.client.post("/v1/outages", json={"station_id": "none", **SPAN})
    assert_problem(answer, 422, "unknown_ground_station")
