"""Two plans side by side."""

from __future__ import annotations

import httpx
import pytest

from tests.missions import Document
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.mission import Mission, small_mission
from tests.service.problems import assert_problem

Key = tuple[str, str, str, str]


@pytest.fixture(scope="module")
def other(mission: Mission) -> Document:
    """Another plan of the same scenario."""
    return mission.plan(small_mission(), "graph")


def diff(mission: Mission, first: Document, second: Document) -> Document:
    found: Document = mission.http.get(f"/v1/jobs/{first['id']}/diff/{second['id']}").json()
    return found


def tasks(mission: Mission, job: Document) -> set[Key]:
    return {
        key(satellite["id"], action)
        for satellite in mission.timeline(job)["satellites"]
        for action in satellite["actions"]
        if action["mode"] != "sunpoint"
    }


def key(satellite_id: str, action: Document) -> Key:
    return (
        satellite_id,
        action["mode"],
        action["target_id"] or action["station_id"],
        action["start"],
    )


def keys(actions: list[Document]) -> set[Key]:
    return {key(action["satellite_id"], action) for action in actions}


def test_the_difference_makes_one_plan_of_the_other(
    mission: Mission, planned: Document, other: Document
) -> None:
    found = diff(mission, planned, other)
    before, after = tasks(mission, planned), tasks(mission, other)
    assert before != after
    gone = keys(found["removed"]) | keys([m["before"] for m in found["moved"]])
    new = keys(found["added"]) | keys([m["after"] for m in found["moved"]])
    assert (gone, new) == (before - after, after - before)
    assert (found["is_empty"], found["questions_differ_in"]) == (False, [])
    totals = [mission.timeline(job)["totals"] for job in (planned, other)]
    for own in totals:
        own["age_mean_s"] = own["age_s"]["mean"]
    for name, total in found["totals"].items():
        if name != "targets":
            assert [total["before"], total["after"]] == [t[name] for t in totals]
        assert total["delta"] == total["after"] - total["before"] != 0


def test_the_way_back_is_the_same_turned_round(
    mission: Mission, planned: Document, other: Document
) -> None:
    there, back = diff(mission, planned, other), diff(mission, other, planned)
    assert there["added"] == back["removed"]
    assert there["removed"] == back["added"]
    assert {n: t["delta"] for n, t in there["totals"].items()} == {
        n: -t["delta"] for n, t in back["totals"].items()
    }


def test_the_same_plan_differs_in_nothing(mission: Mission, planned: Document) -> None:
    again = mission.ended(mission.http.post(f"/v1/jobs/{planned['id']}/rerun"))
    path = f"/v1/jobs/{planned['id']}/diff/{again['id']}"
    answer = mission.http.get(path)
    found = answer.json()
    assert (found["before"], found["after"]) == (planned["id"], again["id"])
    assert found["is_empty"] is True
    assert [found[name] for name in ("added", "removed", "moved")] == [[], [], []]
    assert (found["totals"], found["questions_differ_in"]) == ({}, [])
    known = mission.http.get(path, headers={"If-None-Match": answer.headers["etag"]})
    assert known.status_code == 304


def test_different_questions_are_compared_and_said_to_differ(
    mission: Mission, planned: Document
) -> None:
    scenario = small_mission()
    scenario["horizon"] = scenario["horizon"] | {"end": "2019-01-01T06:00:00Z"}
    scenario["satellites"][0]["name"] = "ANOTHER"
    found = diff(mission, planned, mission.plan(scenario))
    assert found["questions_differ_in"] == ["scenario", "horizon", "satellites"]
    assert found["totals"]["reward"]["delta"] < 0


def test_both_must_be_there_and_ready(client: httpx.Client, jobs: Jobs) -> None:
    first, second = jobs.submit("answer"), jobs.submit("answer")
    assert_problem(client.get(f"/v1/jobs/{first}/diff/{second}"), 409, "not_ready")
    for path in (f"/v1/jobs/{first}/diff/none", f"/v1/jobs/none/diff/{first}"):
        problem = assert_problem(client.get(path), 404, "not_found")
        assert "none" in problem["detail"]
