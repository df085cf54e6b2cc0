"""A client generated from the OpenAPI document plans a mission, using a key."""

from __future__ import annotations

import importlib
import io
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import httpx
import pytest

from tests.missions import PAPER_ORBIT, drawn_targets, paper_mission
from tests.service.factories import tle
from tests.service.serving import serving

PACKAGE = "made_slewline_client"
SECRET = "s3cr3t-enough-for-a-test-of-40-characters"
HALF_A_DAY = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T12:00:00Z"}


@pytest.fixture(scope="module")
def service_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("service")
    keys = f"robot:approve:{SECRET}"
    with serving(folder, "serve", "--workers", "1", require_keys="true", api_keys=keys) as (
        _,
        line,
    ):
        yield line.split()[-1]


@pytest.fixture(scope="module")
def generated(service_url: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the name of a package generated from the service's OpenAPI document."""
    folder = tmp_path_factory.mktemp("generated")
    document = folder / "openapi.json"
    document.write_text(httpx.get(f"{service_url}/openapi.json", trust_env=False, timeout=120).text)
    # It would format the files with a linter of its own choice.
    (folder / "config.yml").write_text(json.dumps({"post_hooks": []}))
    made = subprocess.run(
        [sys.executable, "-m", "openapi_python_client", "generate", "--path", document,
         "--output-path", folder / PACKAGE, "--meta", "none", "--config", folder / "config.yml"],
        check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert made.returncode == 0, made.stdout + made.stderr
    sys.path.insert(0, str(folder))
    yield PACKAGE
    sys.path.remove(str(folder))
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]


def part(package: str, name: str) -> ModuleType:
    return importlib.import_module(f"{package}.{name}")


def test_a_generated_client_plans_a_mission(service_url: str, generated: str) -> None:
    connection = part(generated, "client").AuthenticatedClient(
        base_url=service_url,
        token=SECRET,
        raise_on_unexpected_status=True,
        timeout=httpx.Timeout(120.0),
        httpx_args={"trust_env": False},
    )
    with connection as client:
        plan_a_mission(client, generated)


def plan_a_mission(client: Any, generated: str) -> None:
    models = part(generated, "models")

    def call(operation: str, body: Any = None, **fields: Any) -> Any:
        given = fields if body is None else fields | {"body": body}
        return part(generated, f"api.{operation}").sync(client=client, **given)

    mission = paper_mission(drawn_targets(40), horizon=HALF_A_DAY)
    satellite_ids = [
        call("satellites.create_satellite", models.SatelliteIn.from_dict(satellite)).id
        for satellite in mission["satellites"]
    ]
    station_ids = [
        call("ground_stations.create_ground_station", models.GroundStationIn.from_dict(station)).id
        for station in mission["ground_stations"]
    ]
    targets = models.TargetCatalogIn.from_dict({"name": "draw", "targets": mission["targets"]})
    catalog = call("target_catalogs.create_target_catalog", targets)
    read_and_import(call, generated)
    question = models.ScenarioIn.from_dict(
        {
            "horizon": mission["horizon"],
            "satellite_ids": satellite_ids,
            "ground_station_ids": station_ids,
            "target_catalog_ids": [catalog.id],
        }
    )
    scenario = call("scenarios.create_scenario", question)
    job = call(
        "jobs.create_job",
        models.JobIn.from_dict({"scenario_id": scenario.id, "solver": "rule"}),
        idempotency_key="generated-client",
    )
    while job.state in ("queued", "running"):
        job = call("jobs.get_job", job_id=job.id, wait=20)
    assert job.state == "succeeded"
    timeline = call("timelines.get_timeline", job_id=job.id)
    assert timeline.validity == "valid"
    assert timeline.totals.collects == len(
        [a for s in timeline.satellites for a in s.actions if a.mode == "collect"]
    )
    table = sent(client, generated, "timelines.get_timeline_as", job_id=job.id, suffix="csv")
    assert len(table.splitlines()) > timeline.totals.collects
    assert table.startswith("action_id,satellite_id,")
    outcomes = call("timelines.list_outcomes", job_id=job.id, limit=100)
    assert len(outcomes.items) == len(mission["targets"])
    approve_and_read_passes(client, generated, job.id, timeline.totals.contacts)


def approve_and_read_passes(client: Any, generated: str, job_id: str, num_contacts: int) -> None:
    models = part(generated, "models")

    def call(operation: str, **fields: Any) -> Any:
        return part(generated, f"api.plans.{operation}").sync(client=client, **fields)

    body = models.PlanIn.from_dict({"job_id": job_id, "name": "Half a day"})
    made = call("create_plan", body=body)
    assert made.state == "draft"
    for step in ({"to": "approved"}, {"to": "published", "effective_from": HALF_A_DAY["start"]}):
        body = models.TransitionIn.from_dict(step)
        moved = call("move_plan", plan_id=made.id, body=body)
        assert moved.to_dict()["state"] == step["to"], moved
    passes = call("list_passes", plan_id=made.id, limit=500).items
    planned = [one for one in passes if one.planned]
    assert sum(len(one.action_ids) for one in planned) == num_contacts > 0
    assert all(one.aos <= one.tca <= one.los for one in passes)
    assert all(one.station_name and one.satellite_name for one in passes)


def sent(client: Any, generated: str, operation: str, **fields: Any) -> Any:
    answer = part(generated, f"api.{operation}").sync_detailed(client=client, **fields)
    assert answer.status_code == 200
    return answer.parsed


def read_and_import(call: Callable[..., Any], generated: str) -> None:
    """Send files as bytes, the only form that generated clients support."""

    def file(text: str) -> Any:
        return part(generated, "types").File(payload=io.BytesIO(text.encode()))

    tle_lines, fields = "\n".join(tle(90_101)), {"NORAD_CAT_ID": 90_102, "OBJECT_NAME": "B"}
    omm = PAPER_ORBIT | fields
    csv = ",".join(omm) + "\n" + ",".join(map(str, omm.values())) + "\n"
    for text in (tle_lines, csv, json.dumps([omm | {"NORAD_CAT_ID": 90_103}])):
        elements = call("satellites.import_satellites", file(text))
        assert (elements.accepted, elements.rejected) == (1, 0), text
    stations = "name,lat_deg,lon_deg\nBern,46.9,7.4\n"
    assert call("ground_stations.import_ground_stations", file(stations)).accepted == 1
    targets = "id,lat_deg,lon_deg\nbern,46.9,7.4\n"
    assert call("target_catalogs.create_target_catalog", file(targets)).num_targets == 1
    skies = "target_id,time,clear_probability\nbern,2019-01-01T00:00:00Z,0.5\n"
    assert call("forecasts.create_forecast", file(skies)).id


def test_a_refusal_is_read_as_a_problem(service_url: str, generated: str) -> None:
    keyless = part(generated, "client").Client(
        base_url=service_url, raise_on_unexpected_status=True, httpx_args={"trust_env": False}
    )
    with keyless as client:
        answer = part(generated, "api.jobs.list_jobs").sync_detailed(client=client)
    assert answer.status_code == 401
    assert answer.parsed.code == "authentication_required"
