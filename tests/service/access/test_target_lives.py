"""The progress of targets over plans that are published, replaced and reported on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest
import sqlalchemy as sa

from service.db.rows import ScenarioRow
from tests.service.access.conftest import Desk
from tests.service.problems import assert_problem

Document = dict[str, Any]
START = "2019-01-01T00:00:00.000Z"


@dataclass(frozen=True, slots=True, kw_only=True)
class Shift:
    """A desk with a catalogue of the mission's targets, and a key with all rights."""

    desk: Desk
    key: dict[str, str]
    catalog_id: str

    def lives(self, **query: str) -> dict[str, Document]:
        """Return the targets of the catalogue by id, from all pages."""
        found: list[Document] = []
        address: str | None = "/v1/targets"
        params: dict[str, str] | None = {"limit": "13", "catalog_id": self.catalog_id} | query
        while address:
            answer = self.desk.door.client.get(address, params=params, headers=self.key)
            assert answer.status_code == 200, answer.text
            found += answer.json()["items"]
            address, params = answer.links.get("next", {}).get("url"), None
        return {each["target"]["id"]: each for each in found}

    def states(self) -> dict[str, str]:
        """Return the state of each target."""
        return {own_id: life["state"] for own_id, life in self.lives().items()}

    def report(self, plan: Document, outcome: str, *action_ids: str) -> None:
        """Report an outcome of some actions."""
        body = [{"action_id": own_id, "outcome": outcome} for own_id in action_ids]
        address = f"/v1/plans/{plan['id']}/executions"
        answer = self.desk.door.client.post(address, json=body, headers=self.key)
        assert answer.status_code == 201, answer.text

    def collects(self) -> list[tuple[Document, Document]]:
        """Return satellite and action of each image that is downlinked."""
        return [
            (satellite, action)
            for satellite in self.desk.mission.document["satellites"]
            for action in satellite["actions"]
            if action["mode"] == "collect" and action["delivered_at"]
        ]


@pytest.fixture
def shift(desk: Desk) -> Shift:
    key = desk.door.key("approve")
    ids = [told["target_id"] for told in desk.mission.told]
    targets = [{"id": own_id, "lat_deg": 1.0, "lon_deg": 2.0} for own_id in ids]
    targets.append({"id": "late", "lat_deg": 1.0, "lon_deg": 2.0, "due": START})
    body = {"name": "all", "targets": targets}
    answer = desk.door.client.post("/v1/target-catalogs", json=body, headers=key)
    assert answer.status_code == 201, answer.text
    catalog_id = answer.json()["id"]
    with desk.door.jobs.database.transaction() as session:
        summary = {"target_catalog_ids": [catalog_id]}
        session.execute(sa.update(ScenarioRow).values(summary=summary))
    return Shift(desk=desk, key=key, catalog_id=catalog_id)


def test_targets_of_no_plan_are_open_until_they_are_due(shift: Shift) -> None:
    states = shift.states()
    assert states.pop("late") == "expired"
    assert set(states.values()) == {"open"}
    shift.desk.draft(shift.key)
    assert set(shift.states().values()) == {"open", "expired"}


def test_a_target_is_planned_collected_delivered(shift: Shift) -> None:
    plan = shift.desk.published(shift.key, START)
    satellite, action = shift.collects()[0]
    own_id = action["target_id"]
    life = shift.lives()[own_id]
    assert (life["state"], life["collect"]["action_id"]) == ("planned", action["id"])
    assert life["collect"]["satellite_name"] == satellite["name"]
    shift.report(plan, "executed", action["id"])
    life = shift.lives()[own_id]
    assert (life["state"], life["collect"]["outcome"]) == ("collected", "executed")
    brings_down = [
        each["id"]
        for each in satellite["actions"]
        if each["mode"] == "contact" and each["start"] <= action["delivered_at"] <= each["end"]
    ]
    shift.report(plan, "failed", *brings_down)
    assert shift.states()[own_id] == "collected"
    shift.report(plan, "executed", *brings_down)
    assert shift.states()[own_id] == "delivered"
    others = [each for _, each in shift.collects() if each["target_id"] != own_id]
    assert {shift.states()[each["target_id"]] for each in others} == {"planned"}


def test_what_failed_is_open_again(shift: Shift) -> None:
    plan = shift.desk.published(shift.key, START)
    _, action = shift.collects()[0]
    shift.report(plan, "executed", action["id"])
    shift.report(plan, "failed", action["id"])
    life = shift.lives()[action["target_id"]]
    assert (life["state"], life["collect"]) == ("open", None)


def test_a_withdrawn_plan_plans_nothing_but_keeps_what_was_taken(shift: Shift) -> None:
    plan = shift.desk.published(shift.key, START)
    (_, first), (_, second) = shift.collects()[:2]
    shift.report(plan, "executed", first["id"])
    assert shift.desk.move(plan, "withdrawn", shift.key).status_code == 200
    states = shift.states()
    assert (states[first["target_id"]], states[second["target_id"]]) == ("collected", "open")


def test_a_deleted_catalogue_is_cancelled_but_for_what_was_taken(shift: Shift) -> None:
    plan = shift.desk.published(shift.key, START)
    _, action = shift.collects()[0]
    shift.report(plan, "executed", action["id"])
    address = f"/v1/target-catalogs/{shift.catalog_id}"
    assert shift.desk.door.client.delete(address, headers=shift.key).status_code == 204
    states = shift.states()
    assert states.pop(action["target_id"]) == "collected"
    assert set(states.values()) == {"cancelled"}


def test_lists_are_narrowed_by_state_and_owner(shift: Shift) -> None:
    shift.desk.published(shift.key, START)
    states = shift.states()
    assert set(shift.lives(state="planned")) == {
        own_id for own_id, state in states.items() if state == "planned"
    }
    assert 0 < len(shift.lives(state="planned")) < len(states)
    stranger = Shift(
        desk=shift.desk,
        key=shift.desk.door.key("read", owner="stranger"),
        catalog_id=shift.catalog_id,
    )
    assert set(stranger.states().values()) == {"open", "expired"}
    client = shift.desk.door.client
    unknown = client.get("/v1/targets", params={"catalog_id": "none"}, headers=shift.key)
    assert unknown.json()["items"] == []
    cursor = client.get("/v1/targets", params={"cursor": "bm9uZQ"}, headers=shift.key)
    assert_problem(cursor, 422, "invalid_cursor")
