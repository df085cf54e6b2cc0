"""Plans and their states: who may make which transition, what is in force, what was reported."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import sqlalchemy as sa

from service.db.rows import WebhookDeliveryRow
from tests.service.access.conftest import Desk
from tests.service.exports.conftest import Mission
from tests.service.problems import assert_problem

Document = dict[str, Any]
NOON = "2019-01-01T12:00:00.000Z"
_LATER = ("approved", "published", "superseded", "withdrawn")


def tasks(mission: Mission) -> list[Document]:
    return [
        {"satellite_id": satellite["id"], **action}
        for satellite in mission.document["satellites"]
        for action in satellite["actions"]
        if action["mode"] not in ("sunpoint", "hold")
    ]


def test_a_plan_is_its_jobs_actions(desk: Desk) -> None:
    key = desk.door.key("approve")
    plan = desk.draft(key)
    document = desk.mission.document
    assert (plan["state"], plan["allowed"]) == ("draft", ["approved", "withdrawn"])
    assert plan["plan_sha256"] == document["plan_sha256"]
    names = {each["satellite_id"]: each["satellite_name"] for each in plan["satellites"]}
    assert names == {each["id"]: each["name"] for each in document["satellites"]}
    wanted = tasks(desk.mission)
    listed: list[Document] = []
    address: str | None = f"/v1/plans/{plan['id']}/actions?limit=7"
    while address:
        answer = desk.door.client.get(address, headers=key)
        listed += answer.json()["items"]
        address = answer.links.get("next", {}).get("url")
    fields = ("id", "satellite_id", "mode", "start", "end", "target_id", "station_id")
    assert [[each[name] for name in fields] for each in listed] == [
        [each[name] for name in fields] for each in wanted
    ]
    assert {each["outcome"] for each in listed} == {None}
    timeline = desk.get(plan, key, "/timeline.json")
    assert timeline["plan_sha256"] == plan["plan_sha256"]
    table = desk.door.client.get(f"/v1/plans/{plan['id']}/timeline.csv", headers=key)
    assert len(table.text.splitlines()) > len(wanted)


def test_only_who_may_approve_does(desk: Desk) -> None:
    submitter, lead = desk.door.key("submit"), desk.door.key("approve")
    plan = desk.draft(submitter)
    assert_problem(desk.move(plan, "approved", submitter), 403, "insufficient_scope")
    assert_problem(desk.move(plan, "published", submitter), 409, "invalid_transition")
    assert desk.move(plan, "approved", lead, reason="Looks good.").json()["state"] == "approved"
    moved = desk.move(plan, "published", submitter, effective_from=NOON)
    assert moved.json()["state"] == "published"
    assert {s["in_force_from"] for s in moved.json()["satellites"]} == {NOON}
    told = desk.get(plan, lead, "/history")["items"]
    assert [(each["from_state"], each["to_state"], each["key_name"]) for each in told] == [
        (None, "draft", "ops-submit"),
        ("draft", "approved", "ops-approve"),
        ("approved", "published", "ops-submit"),
    ]
    assert told[1]["reason"] == "Looks good."
    assert told[2]["effective_from"] == NOON
    assert_problem(desk.move(plan, "published", lead), 409, "invalid_transition")


def test_a_plan_of_another_owner_is_not_there(desk: Desk) -> None:
    own, stranger = desk.door.key("approve"), desk.door.key("approve", "science")
    plan = desk.draft(own)
    assert_problem(desk.move(plan, "approved", stranger), 404, "not_found")
    for part in ("", "/history", "/actions", "/executions", "/timeline.json"):
        answer = desk.door.client.get(f"/v1/plans/{plan['id']}{part}", headers=stranger)
        assert_problem(answer, 404, "not_found")
    assert desk.door.client.get("/v1/plans", headers=stranger).json()["items"] == []
    body = {"job_id": plan["job_id"]}
    answer = desk.door.client.post("/v1/plans", json=body, headers=stranger)
    assert_problem(answer, 422, "unknown_job", "/job_id")


def test_a_job_without_an_answer_gives_no_plan(desk: Desk) -> None:
    key = desk.door.key("submit")
    body = {"job_id": desk.door.submit(key)}
    assert_problem(desk.door.client.post("/v1/plans", json=body, headers=key), 409, "not_ready")


def test_publishing_supersedes_from_its_instant_on(desk: Desk) -> None:
    key = desk.door.key("approve")
    morning, noon, evening = (f"2019-01-01T{hour}:00:00.000Z" for hour in ("06", "12", "18"))
    first = desk.published(key, morning)
    second = desk.published(key, noon)
    assert desk.get(first, key)["state"] == "superseded"
    assert {s["in_force_until"] for s in desk.get(first, key)["satellites"]} == {noon}
    assert desk.in_force(key, morning) == [first["id"]]
    assert desk.in_force(key, "2019-01-01T11:59:59.999Z") == [first["id"]]
    assert desk.in_force(key, noon) == desk.in_force(key, evening) == [second["id"]]
    satellite_id = first["satellites"][0]["satellite_id"]
    assert desk.in_force(key, evening, satellite_id=satellite_id) == [second["id"]]
    assert desk.in_force(key, evening, satellite_id="another") == []
    assert desk.in_force(key, "2019-01-05T00:00:00.000Z") == []
    told = desk.get(first, key, "/history")["items"][-1]
    assert (told["to_state"], told["effective_from"]) == ("superseded", noon)
    assert second["id"] in told["reason"]


def test_a_withdrawn_plan_is_in_force_no_more(desk: Desk) -> None:
    key = desk.door.key("approve")
    plan = desk.published(key, NOON)
    moved = desk.move(plan, "withdrawn", key, reason="The payload is off.").json()
    assert (moved["state"], moved["allowed"]) == ("withdrawn", [])
    assert desk.in_force(key, NOON) == []


def test_a_plan_published_meanwhile_is_not_overwritten(desk: Desk) -> None:
    key = desk.door.key("approve")
    late = desk.draft(key)
    assert desk.move(late, "approved", key).status_code == 200
    meanwhile = desk.published(key, NOON)
    refused = desk.move(late, "published", key, effective_from=NOON)
    problem = assert_problem(refused, 409, "plan_overtaken")
    assert meanwhile["id"] in problem["detail"]
    assert desk.in_force(key, NOON) == [meanwhile["id"]]


def test_of_two_publishers_at_once_one_is_refused(desk: Desk) -> None:
    key = desk.door.key("approve")
    for _ in range(3):
        plans = [desk.draft(key) for _ in range(2)]
        for plan in plans:
            assert desk.move(plan, "approved", key).status_code == 200
        with ThreadPoolExecutor(2) as threads:
            answers = list(threads.map(
                lambda plan: desk.move(plan, "published", key, effective_from=NOON), plans
            ))  # fmt: skip
        assert sorted(answer.status_code for answer in answers) == [200, 409]
        winner = next(a.json()["id"] for a in answers if a.status_code == 200)
        assert desk.in_force(key, NOON) == [winner]


def test_if_match_keeps_a_change_from_being_overwritten(desk: Desk) -> None:
    key = desk.door.key("approve")
    plan = desk.draft(key)
    read = desk.door.client.get(f"/v1/plans/{plan['id']}", headers=key)
    seen = key | {"If-Match": read.headers["etag"]}
    approved = desk.move(plan, "approved", seen)
    assert approved.status_code == 200
    assert approved.headers["etag"] != read.headers["etag"]
    assert_problem(desk.move(plan, "withdrawn", seen), 412, "precondition_failed")


def test_each_violation_wants_a_waiver(desk: Desk) -> None:
    key = desk.door.key("approve")
    document = desk.mission.document
    at = document["horizon"]["start"]
    broken = [
        {"code": code, "satellite_id": "sat/1#a", "at": at, "needed": 2.0, "available": 1.0,
         "actions": ["a1"], "detail": f"The {code} is too short."}
        for code in ("slew", "slew", "battery", "duplicate")
    ]  # fmt: skip
    head = json.loads(desk.mission.chunks[0].text + "]}")
    head |= {"violations": broken, "validity": "violations"}
    text = json.dumps(head)[: -len("]}")]
    chunks = (replace(desk.mission.chunks[0], text=text), *desk.mission.chunks[1:])
    plan = desk.draft(key, desk.answered_job(key, chunks))
    # A target imaged twice is no violation.
    assert [each["code"] for each in plan["violations"]] == ["slew", "slew", "battery"]
    refused = desk.move(plan, "approved", key)
    assert len(assert_problem(refused, 422, "waiver_missing", "/waivers")["errors"]) == 3
    waivers = [{"violation": "slew", "reason": "Wheels have more."}]
    refused = desk.move(plan, "approved", key, waivers=waivers)
    assert len(assert_problem(refused, 422, "waiver_missing", "/waivers")["errors"]) == 1
    unknown = [*waivers, {"violation": "/violations/3", "reason": "?"}]
    refused = desk.move(plan, "approved", key, waivers=unknown)
    assert_problem(refused, 422, "invalid_request", "/waivers/1/violation")
    waivers.append({"violation": "/violations/2", "reason": "It is new."})
    assert desk.move(plan, "approved", key, waivers=waivers).status_code == 200
    assert desk.get(plan, key, "/history")["items"][-1]["waivers"] == waivers


def test_what_a_step_has_no_use_for_is_refused(desk: Desk) -> None:
    key = desk.door.key("approve")
    plan = desk.draft(key)
    refused = desk.move(plan, "approved", key, effective_from=NOON)
    assert_problem(refused, 422, "invalid_value", "/effective_from")
    assert desk.move(plan, "approved", key).status_code == 200
    over = desk.move(plan, "published", key, effective_from="2019-02-01T00:00:00Z")
    assert_problem(over, 422, "value_out_of_range", "/effective_from")
    assert desk.get(plan, key)["state"] == "approved"


def test_executions_are_added_and_the_last_counts(desk: Desk) -> None:
    key = desk.door.key("approve")
    plan = desk.draft(key)
    address = f"/v1/plans/{plan['id']}/executions"
    first, second = (each["id"] for each in tasks(desk.mission)[:2])
    done = [{"action_id": first, "outcome": "executed", "at": NOON, "mbit": 120.5}]
    early = desk.door.client.post(address, json=done, headers=key)
    assert_problem(early, 409, "invalid_transition")
    assert desk.move(plan, "approved", key).status_code == 200
    assert desk.move(plan, "published", key, effective_from=NOON).status_code == 200
    unknown = [*done, {"action_id": "a0", "outcome": "failed"}]
    refused = desk.door.client.post(address, json=unknown, headers=key)
    assert_problem(refused, 422, "unknown_action", "/1/action_id")
    assert desk.door.client.post(address, json=done, headers=key).status_code == 201
    again = [
        {"action_id": first, "outcome": "partial", "detail": "Half of it is clouded."},
        {"action_id": second, "outcome": "failed"},
    ]
    twice = key | {"Idempotency-Key": "once"}
    answers = [desk.door.client.post(address, json=again, headers=twice) for _ in range(2)]
    assert answers[0].json() == answers[1].json()
    told = desk.get(plan, key, "/executions")["items"]
    assert [(each["action_id"], each["outcome"]) for each in told] == [
        (second, "failed"), (first, "partial"), (first, "executed"),
    ]  # fmt: skip
    outcomes = {each["id"]: each["outcome"] for each in desk.get(plan, key, "/actions")["items"]}
    assert (outcomes[first], outcomes[second]) == ("partial", "failed")


def test_webhooks_and_the_audit_tell_of_transitions(desk: Desk) -> None:
    key, boss = desk.door.key("approve"), desk.door.key("admin", "boss")
    hook = {"url": "https://ops.example/plans", "events": ["plan.published", "plan.superseded"]}
    assert desk.door.client.post("/v1/webhooks", json=hook, headers=key).status_code == 201
    first, second = desk.published(key, NOON), desk.published(key, NOON)
    done = [{"action_id": tasks(desk.mission)[0]["id"], "outcome": "executed"}]
    address = f"/v1/plans/{second['id']}/executions"
    assert desk.door.client.post(address, json=done, headers=key).status_code == 201
    with desk.door.jobs.database.reading() as session:
        wanted = sa.select(WebhookDeliveryRow).order_by(WebhookDeliveryRow.id)
        told = [json.loads(row.payload) for row in session.scalars(wanted)]
    assert [(each["type"], each["data"]["plan_id"]) for each in told] == [
        ("plan.published", first["id"]),
        ("plan.superseded", first["id"]),
        ("plan.published", second["id"]),
    ]
    query = {"object_id": second["id"]}
    audit = desk.door.client.get("/v1/audit-events", params=query, headers=boss).json()["items"]
    assert [each["action"] for each in audit][::-1] == [
        "create", "approved", "published", "report",
    ]  # fmt: skip


def test_a_plan_that_is_not_in_force_is_deleted_for_good(desk: Desk) -> None:
    key = desk.door.key("approve")
    job_id = desk.answered_job(key)
    plan = desk.draft(key, job_id)
    own, job = f"/v1/plans/{plan['id']}", f"/v1/jobs/{job_id}"
    client = desk.door.client
    assert_problem(client.delete(job, headers=key), 409, "in_use")
    stranger = desk.door.key("approve", "others")
    assert_problem(client.delete(own, headers=stranger), 404, "not_found")
    assert desk.move(plan, "approved", key).status_code == 200
    assert_problem(client.delete(own, headers=key), 409, "invalid_transition")
    assert desk.move(plan, "withdrawn", key).status_code == 200
    assert client.delete(own, headers=key).status_code == 204
    assert_problem(client.get(own, headers=key), 404, "not_found")
    assert client.delete(job, headers=key).status_code == 204


def test_each_transition_is_told_and_the_audit_says_whose_it_was(desk: Desk) -> None:
    """Two controllers of one owner: one plans, one approves; two plans cover all five states."""
    planner, lead = desk.door.key("submit"), desk.door.key("approve")
    boss = desk.door.key("admin", "boss")
    events = [f"plan.{state}" for state in ("draft", *_LATER)]
    hook = {"url": "https://ops.example/plans", "events": events}
    assert desk.door.client.post("/v1/webhooks", json=hook, headers=planner).status_code == 201
    first = desk.draft(planner)
    desk.move(first, "approved", lead)
    desk.move(first, "published", planner, effective_from=NOON)
    second = desk.draft(planner)
    desk.move(second, "approved", lead)
    desk.move(second, "published", lead, effective_from=NOON)
    desk.move(second, "withdrawn", lead)
    with desk.door.jobs.database.reading() as session:
        wanted = sa.select(WebhookDeliveryRow).order_by(WebhookDeliveryRow.id)
        told = [json.loads(row.payload) for row in session.scalars(wanted)]
    assert [each["type"] for each in told if each["data"]["plan_id"] == first["id"]] == [
        "plan.draft", "plan.approved", "plan.published", "plan.superseded",
    ]  # fmt: skip
    assert [each["type"] for each in told if each["data"]["plan_id"] == second["id"]] == [
        "plan.draft", "plan.approved", "plan.published", "plan.withdrawn",
    ]  # fmt: skip
    query = {"object_id": second["id"]}
    audit = desk.door.client.get("/v1/audit-events", params=query, headers=boss).json()["items"]
    assert [(each["action"], each["key_name"]) for each in audit][::-1] == [
        ("create", "ops-submit"), ("approved", "ops-approve"), ("published", "ops-approve"),
        ("withdrawn", "ops-approve"),
    ]  # fmt: skip


def test_telemetry_is_added_to_what_is_published_and_recorded(desk: Desk) -> None:
    key, boss = desk.door.key("approve"), desk.door.key("admin", "boss")
    draft = desk.draft(key)
    own_id = draft["satellites"][0]["satellite_id"]
    state = {"satellite_id": own_id, "at": NOON, "battery_fraction": 0.8}
    early = desk.door.client.post(f"/v1/plans/{draft['id']}/states", json=[state], headers=key)
    assert_problem(early, 409, "invalid_transition")
    plan = desk.published(key, NOON)
    address = f"/v1/plans/{plan['id']}/states"
    assert_problem(desk.door.client.post(address, json=[], headers=key), 422, "value_out_of_range")
    twice = key | {"Idempotency-Key": "states"}
    answers = [desk.door.client.post(address, json=[state], headers=twice) for _ in range(2)]
    assert answers[0].json() == answers[1].json()
    newer = state | {"battery_fraction": 0.7}
    assert desk.door.client.post(address, json=[newer], headers=key).status_code == 201
    told = desk.get(plan, key, "/states")["items"]
    assert [each["battery_fraction"] for each in told] == [0.7, 0.8]
    query = {"object_id": plan["id"]}
    audit = desk.door.client.get("/v1/audit-events", params=query, headers=boss).json()["items"]
    assert [each["action"] for each in audit].count("report") == 2
