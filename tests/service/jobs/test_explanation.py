"""One target explained in detail, for a job that a real worker has planned."""

from __future__ import annotations

import httpx

from tests.missions import Document
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.mission import HIDDEN, ODD, Mission, small_mission
from tests.service.problems import assert_problem


def test_every_opportunity_is_gone_through_and_the_reason_is_the_one_listed(
    mission: Mission, planned: Document
) -> None:
    targets = mission.targets(planned)
    actions = {a["id"]: a for s in mission.timeline(planned)["satellites"] for a in s["actions"]}
    left = [t for t in targets.values() if t["reason"] and t["reason"]["code"] != "no_access"]
    assert len(left) > 20
    for target in left[::10]:
        found = mission.explain(planned, target["target_id"]).json()
        assert {name: found[name] for name in target} == target
        listed = mission.http.get(
            f"{planned['links']['scenario']}/opportunities",
            params={"target_id": target["target_id"], "limit": 500},
        ).json()["items"]
        tried = found["opportunities"]
        assert [t["opportunity_id"] for t in tried] == [o["id"] for o in listed]
        assert [(t["start"], t["end"]) for t in tried] == [(o["start"], o["end"]) for o in listed]
        for attempt in tried:
            assert attempt["violations"] or attempt["fits_instead"]
            assert set(attempt["displaces"]) <= set(actions)
            if attempt["displaces"] and attempt["fits_instead"]:
                lost = sum(actions[a]["reward"] for a in attempt["displaces"])
                assert attempt["reward_delta"] == 1.0 - lost
        assert found["access_changes"] == []


def test_a_target_without_access_is_told_what_would_give_it_one(
    mission: Mission, planned: Document
) -> None:
    found = mission.explain(planned, HIDDEN).json()
    assert (found["outcome"], found["reason"]["code"]) == ("unscheduled", "no_access")
    assert found["opportunities"] == []
    wider = next(c for c in found["access_changes"] if "targets" in c)
    assert wider["satellite_id"] == "PAPER"
    setting = wider["targets"][HIDDEN]
    assert setting.get("off_nadir_max_deg", 0.0) > 5.0
    # The sensor allows 55 degrees already: only the target's own limit excludes it.
    assert set(wider) == {"satellite_id", "targets"}


def test_times_and_sensor_types_of_targets_go_all_the_way(mission: Mission) -> None:
    """A target is planned within its times; what excludes two others is named, and relaxable."""
    scenario = small_mission(use_resources=False)
    first = mission.plan(scenario)
    actions = mission.timeline(first)["satellites"][0]["actions"]
    names = [action["target_id"] for action in actions]
    own, late, typed = names[10], names[-1], names[20]
    targets = {target["id"]: target for target in scenario["targets"]}
    end = actions[10]["end"]
    targets[own] |= {"release": actions[10]["start"], "due": end}
    targets[late] |= {"due": "2019-01-01T00:00:01Z"}
    targets[typed] |= {"sensor_type": "infrared"}
    job = mission.plan(scenario)
    again = mission.targets(job)
    (taken,) = [
        action for action in mission.timeline(job)["satellites"][0]["actions"]
        if action["target_id"] == own
    ]  # fmt: skip
    assert (taken["start"], taken["end"]) == (actions[10]["start"], end)
    for name, setting, words in (
        (late, "due", "between its release and due times"),
        (typed, "sensor_type", "none with its sensor type"),
    ):
        assert (again[name]["reason"]["code"], again[name]["reason"]["certainty"]) == (
            "no_access", "proven",
        )  # fmt: skip
        assert words in again[name]["reason"]["detail"]
        found = mission.explain(job, name).json()["access_changes"]
        (change,) = [c for c in found if setting in c.get("targets", {}).get(name, {})]
        varied = mission.ended(mission.what_if(job, relax=change, force=[name]))
        assert mission.targets(varied)[name]["outcome"] == "collected"


def test_a_collected_target_with_an_odd_id_has_its_action_and_no_attempts(
    mission: Mission,
) -> None:
    scenario = small_mission()
    scenario["targets"] = scenario["targets"][:1]
    job = mission.plan(scenario)
    answer = mission.explain(job, ODD)
    found = answer.json()
    assert found["target_id"] == ODD
    assert found["outcome"] in ("collected", "downlinked")
    assert (found["reason"], found["opportunities"]) == (None, [])
    known = mission.explain(job, ODD, **{"If-None-Match": answer.headers["etag"]})
    assert (known.status_code, known.text) == (304, "")


def test_etags_tell_targets_and_jobs_apart(mission: Mission, planned: Document) -> None:
    first = mission.explain(planned, HIDDEN)
    other = mission.explain(planned, ODD, **{"If-None-Match": first.headers["etag"]})
    assert other.status_code == 200
    assert other.headers["etag"] != first.headers["etag"]


def test_there_is_no_explanation_of_what_there_is_not(mission: Mission, planned: Document) -> None:
    problem = assert_problem(mission.explain(planned, "no/such"), 404, "not_found")
    assert "no/such" in problem["detail"]
    assert_problem(mission.explain({"id": "none"}, ODD), 404, "not_found")


def test_a_job_without_an_answer_is_not_ready(client: httpx.Client, jobs: Jobs) -> None:
    job_id = jobs.submit("answer")
    answer = client.get(f"/v1/jobs/{job_id}/targets/t0/explanation")
    assert_problem(answer, 409, "not_ready")
    assert answer.headers["retry-after"] == "1"
