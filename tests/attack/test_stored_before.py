"""Values that an earlier release accepted and this one refuses: shown, but not planned with."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
import sqlalchemy as sa
from sqlalchemy.orm.attributes import flag_modified

from service.client import Client
from service.db.rows import GroundStationRow, SatelliteRow, ScenarioRow, TargetRow
from service.wire.satellites import AgilityIn, SatelliteIn
from service.wire.stored import from_store
from tests.service.factories import ground_station, post, satellite, target
from tests.service.jobs.conftest import Jobs
from tests.service.problems import assert_problem

HORIZON = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T02:00:00Z"}
FAR = 1e300
TURNED = "a\u202eb"


@pytest.fixture
def stored(client: httpx.Client, jobs: Jobs) -> dict[str, Any]:
    """Store one thing of each kind and a scenario of them, then put old values into the rows."""
    made = {
        "satellite": post(client, "/v1/satellites", satellite()),
        "station": post(client, "/v1/ground-stations", ground_station()),
        "catalog": post(
            client, "/v1/target-catalogs", {"name": "old", "targets": [target(id="a")]}
        ),
    }
    question = {
        "horizon": HORIZON,
        "satellite_ids": [made["satellite"]["id"]],
        "ground_station_ids": [made["station"]["id"]],
        "target_catalog_ids": [made["catalog"]["id"]],
    }
    made |= {"question": question, "scenario": post(client, "/v1/scenarios", question)}
    with jobs.database.transaction() as session:
        row = session.get_one(SatelliteRow, made["satellite"]["id"])
        row.agility["settle_s"] = FAR
        row.sensor["sensor_type"] = TURNED
        flag_modified(row, "agility")
        flag_modified(row, "sensor")
        station = session.get_one(GroundStationRow, made["station"]["id"])
        station.body["min_contact_s"] = FAR
        flag_modified(station, "body")
        of_catalog = TargetRow.catalog_id == made["catalog"]["id"]
        body = session.scalars(sa.select(TargetRow).where(of_catalog)).one()
        body.body["reward"] = FAR
        flag_modified(body, "body")
        scenario = session.get_one(ScenarioRow, made["scenario"]["id"])
        assert '"settle_s":0.0' in scenario.content
        scenario.content = scenario.content.replace('"settle_s":0.0', f'"settle_s":{FAR}')
    return made


def test_lists_and_things_show_what_is_stored(client: httpx.Client, stored: dict[str, Any]) -> None:
    # The values exceed the declared ranges: no answer is checked against the schema.
    address = client.base_url
    with Client(str(address)) as reading:
        assert next(reading.satellites.list()).agility.settle_s == FAR
    with httpx.Client(base_url=address) as unchecked:
        _look_at_all(unchecked, stored)


def _look_at_all(client: httpx.Client, stored: dict[str, Any]) -> None:
    own_id = stored["satellite"]["id"]
    shown = client.get(f"/v1/satellites/{own_id}").json()
    assert shown == stored["satellite"] | {
        "agility": stored["satellite"]["agility"] | {"settle_s": FAR},
        "sensor": stored["satellite"]["sensor"] | {"sensor_type": TURNED},
    }
    assert client.get("/v1/satellites").json()["items"][0] == shown
    station = client.get("/v1/ground-stations").json()["items"][0]
    assert station == stored["station"] | {"min_contact_s": FAR}
    assert client.get(f"/v1/ground-stations/{station['id']}").json() == station
    catalog = stored["catalog"]["id"]
    targets = client.get(f"/v1/target-catalogs/{catalog}/targets").json()["items"]
    assert [one["reward"] for one in targets] == [FAR]
    own_id = stored["scenario"]["id"]
    assert client.get(f"/v1/scenarios/{own_id}").json()["id"] == own_id


@pytest.mark.parametrize(
    ("left_out", "pointer", "field"),
    [
        ((), "/satellite_ids/0", "/agility/settle_s"),
        (("satellite",), "/target_catalog_ids/0", "/reward"),
        (("satellite", "catalog"), "/ground_station_ids/0", "/min_contact_s"),
    ],
)
def test_a_scenario_of_them_is_refused_by_name(
    client: httpx.Client,
    stored: dict[str, Any],
    left_out: tuple[str, ...],
    pointer: str,
    field: str,
) -> None:
    question = dict(stored["question"])
    if "satellite" in left_out:
        question["satellite_ids"] = [post(client, "/v1/satellites", satellite())["id"]]
    if "catalog" in left_out:
        body = {"name": "new", "targets": [target(id="b")]}
        question["target_catalog_ids"] = [post(client, "/v1/target-catalogs", body)["id"]]
    problem = assert_problem(client.post("/v1/scenarios", json=question), 422, "value_out_of_range")
    assert problem["errors"][0]["pointer"] == pointer
    assert field in problem["detail"]


def test_what_is_out_of_range_can_be_put_right(
    client: httpx.Client, stored: dict[str, Any]
) -> None:
    station = f"/v1/ground-stations/{stored['station']['id']}"
    assert_problem(client.patch(station, json={"name": "B"}), 422, "value_out_of_range")
    answer = client.patch(station, json={"name": "B", "min_contact_s": 60.0})
    assert answer.json()["min_contact_s"] == 60.0
    own = f"/v1/satellites/{stored['satellite']['id']}"
    changes = {"agility": {"settle_s": 5.0}, "sensor": {"sensor_type": None}}
    assert client.patch(own, json=changes).json()["agility"]["settle_s"] == 5.0
    body = {"name": "new", "targets": [target(id="b")]}
    new = post(client, "/v1/target-catalogs", body)["id"]
    question = stored["question"] | {"target_catalog_ids": [new]}
    assert client.post("/v1/scenarios", json=question).status_code == 201


def test_only_ranges_are_forgiven() -> None:
    assert from_store(AgilityIn, {"slew_rate_deg_s": FAR}).slew_rate_deg_s == FAR
    inside = satellite(agility={"slew_rate_deg_s": FAR}, name=TURNED)
    assert from_store(SatelliteIn, inside).agility.slew_rate_deg_s == FAR
    assert from_store(SatelliteIn, inside).name == TURNED
    for values in ({"slew_rate_deg_s": "1"}, {"slew_rate_deg_s": FAR, "unknown": 1}):
        with pytest.raises(ValueError, match="validation error"):
            from_store(AgilityIn, values)
