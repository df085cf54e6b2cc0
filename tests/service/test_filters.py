"""Lists filtered by a part of a name, a satellite, a ground station."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import httpx
import pytest
import sqlalchemy as sa
from alembic import command

from service.db.ids import new_id
from service.db.migrate import config_on
from service.db.rows import JobRow, ScenarioPartRow
from service.db.session import Database
from tests.service.conftest import Service
from tests.service.factories import EPOCH, ground_station, post, satellite, target, tle

NAMES = ("Eye-1", "eye_2", "100% far")
HORIZON = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T02:00:00Z"}


@pytest.mark.parametrize("path", ["satellites", "ground-stations", "target-catalogs", "scenarios"])
def test_lists_are_narrowed_by_a_part_of_a_name(client: httpx.Client, path: str) -> None:
    first = post(client, "/v1/satellites", satellite(name="none", tle=tle(90009)))["id"]
    for number, name in enumerate(NAMES):
        match path:
            case "satellites":
                body = satellite(name=name, tle=tle(90010 + number))
            case "ground-stations":
                body = ground_station(name=name)
            case "target-catalogs":
                body = {"name": name, "targets": [target(id="a")]}
            case _:
                catalog = {"name": name, "targets": [target(id=name)]}
                made = post(client, "/v1/target-catalogs", catalog)["id"]
                body = {
                    "name": name,
                    "horizon": HORIZON,
                    "satellite_ids": [first],
                    "target_catalog_ids": [made],
                }
        post(client, f"/v1/{path}", body)

    def named(text: str) -> list[str]:
        items = client.get(f"/v1/{path}", params={"name": text}).json()["items"]
        return [item["name"] for item in items]

    assert named("EYE") == ["eye_2", "Eye-1"]
    assert named("%") == ["100% far"]
    assert named("_") == ["eye_2"]
    assert named("nothing like it") == []


@dataclass(frozen=True, slots=True, kw_only=True)
class Stored:
    """Scenarios of two satellites and two stations, with a job each."""

    client: httpx.Client
    database: Database
    eyes: list[str]
    stations: list[str]
    scenarios: dict[str, str]
    jobs: dict[str, str]


_PARTS: Final = {"first": slice(0, 1), "second": slice(1, 2), "both": slice(0, 2)}


@pytest.fixture
def stored(service: Service) -> Stored:
    client = service.client
    eyes = [post(client, "/v1/satellites", satellite(name=f"eye {i}"))["id"] for i in range(2)]
    stations = [
        post(client, "/v1/ground-stations", ground_station(name=f"S{i}"))["id"] for i in range(2)
    ]
    catalog = post(client, "/v1/target-catalogs", {"name": "one", "targets": [target()]})["id"]
    scenarios, jobs = {}, {}
    for name, own in _PARTS.items():
        body = {
            "name": name,
            "horizon": HORIZON,
            "satellite_ids": eyes[own],
            "ground_station_ids": stations[own],
            "target_catalog_ids": [catalog],
        }
        scenarios[post(client, "/v1/scenarios", body)["id"]] = name
    with service.database.transaction() as session:
        for scenario_id, name in scenarios.items():
            job_id = new_id()
            jobs[job_id] = name
            session.execute(
                sa.insert(JobRow).values(
                    id=job_id, scenario_id=scenario_id, tenant="nobody", state="cancelled",
                    solver="rule", seed=0, params={}, priority=5,
                    created_at=EPOCH, dispatched_at=EPOCH,
                    limits={"time_s": 1.0, "memory_mb": 64},
                )
            )  # fmt: skip
    return Stored(
        client=client, database=service.database, eyes=eyes, stations=stations,
        scenarios=scenarios, jobs=jobs,
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["scenarios", "jobs"])
def test_lists_are_narrowed_by_satellite_and_station(stored: Stored, kind: str) -> None:
    names = stored.scenarios if kind == "scenarios" else stored.jobs

    def found(**params: str) -> set[str]:
        items = stored.client.get(f"/v1/{kind}", params=params).json()["items"]
        return {names[each["id"]] for each in items}

    assert found() == set(_PARTS)
    assert found(satellite_id=stored.eyes[0]) == {"first", "both"}
    assert found(station_id=stored.stations[1]) == {"second", "both"}
    assert found(satellite_id=stored.eyes[0], station_id=stored.stations[1]) == {"both"}
    # A satellite is not a station, whatever its id.
    assert found(station_id=stored.eyes[0]) == set()
    assert found(satellite_id="nobody") == set()


def test_a_deleted_scenario_leaves_nothing_of_its_parts(stored: Stored) -> None:
    for path in [
        *(f"jobs/{i}" for i in stored.jobs),
        *(f"scenarios/{i}" for i in stored.scenarios),
    ]:
        assert stored.client.delete(f"/v1/{path}").status_code == 204
    with stored.database.reading() as session:
        assert session.scalars(sa.select(ScenarioPartRow)).all() == []


def test_older_scenarios_are_found_by_their_parts_too(stored: Stored) -> None:
    wanted = sa.select(ScenarioPartRow.scenario_id, ScenarioPartRow.part_id, ScenarioPartRow.kind)
    with stored.database.reading() as session:
        before = {tuple(row) for row in session.execute(wanted)}
    assert len(before) == 8
    for change, revision in ((command.downgrade, "0020"), (command.upgrade, "head")):
        with stored.database.engine.begin() as connection:
            change(config_on(connection), revision)
    with stored.database.reading() as session:
        assert {tuple(row) for row in session.execute(wanted)} == before
