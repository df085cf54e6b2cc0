"""Resources that the client stores and reads back, on the real service."""

from __future__ import annotations

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest

from service.client import Client, ServiceError
from tests.service.factories import EPOCH, tle

CSV = "id,lat_deg,lon_deg,reward,colour\nbern,46.9,7.4,1,red\nquito,-0.2,-78.5,2,blue\n"
GEOJSON = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"id": "bern", "name": "Bern"},
            "geometry": {"type": "Point", "coordinates": [7.4, 46.9]},
        }
    ],
}


def test_the_client_loads_no_part_of_the_server() -> None:
    script = "import sys, service.client; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = set(ran.stdout.split())
    assert "service.client.jobs" in loaded
    assert loaded.isdisjoint({"fastapi", "sqlalchemy", "numpy", "numba", "dbos", "service.api"})


def test_a_satellite_is_stored_read_changed_and_deleted(stored: Client) -> None:
    made = stored.satellites.create(
        "EYE-1", tle=tle(), agility={"slew_rate_deg_s": 2.0}, resources="paper_code"
    )
    read = stored.satellites.get(made.id)
    assert read == made
    assert (read.tle, read.epoch, read.agility["slew_rate_deg_s"]) == (tuple(tle()), EPOCH, 2.0)
    newer = stored.satellites.put_elements(made.id, tle=tle(mean_anomaly_deg=9.0))
    assert newer.tle != made.tle
    with pytest.raises(ServiceError) as refused:
        stored.satellites.delete(made.id, if_match=made.etag)
    assert refused.value.code == "precondition_failed"
    stored.satellites.delete(made.id, if_match=newer.etag)
    assert list(stored.satellites.list()) == []


def test_elements_are_imported_from_text_bytes_and_files(stored: Client, tmp_path: Path) -> None:
    lines = "\n".join(tle(90001) + tle(90002)) + "\n"
    file = tmp_path / "today.tle"
    file.write_text(lines, encoding="utf-8")
    first = stored.satellites.import_elements(lines, "tle")
    again = stored.satellites.import_elements(file)
    assert [item.status for item in first.items] == ["created", "created"]
    assert [item.status for item in again.items] == ["unchanged", "unchanged"]
    mixed = (lines + "1 nonsense\n2 nonsense\n").encode()
    assert stored.satellites.import_elements(mixed, "tle").rejected > 0
    with pytest.raises(ServiceError) as refused:
        stored.satellites.import_elements(mixed, "tle", reject_all=True)
    assert refused.value.errors[0].row == 5
    assert [s.norad_cat_id for s in stored.satellites.list(norad_cat_id=90002)] == [90002]


@pytest.mark.parametrize(("form", "source"), [(None, "text"), ("docx", "text")])
def test_a_text_without_a_known_form_is_not_sent(
    stored: Client, form: str | None, source: str
) -> None:
    with pytest.raises(ValueError, match="form"):
        stored.satellites.import_elements(source, form)


def test_stations_come_one_by_one_and_in_files(stored: Client) -> None:
    one = stored.ground_stations.create("North", 78.2, 15.4, min_elevation_deg=7.0)
    stations = "name,lat_deg,lon_deg\nSouth,-72.0,2.5\n"
    found = stored.ground_stations.import_stations(stations, "csv")
    assert stored.ground_stations.get(one.id).min_elevation_deg == 7.0
    assert [s.name for s in stored.ground_stations.list()] == ["South", "North"]
    stored.ground_stations.delete(found.items[0].id)
    assert [s.name for s in stored.ground_stations.list()] == ["North"]


def test_catalogues_come_in_every_form(stored: Client, tmp_path: Path) -> None:
    file = tmp_path / "cities.geojson"
    file.write_text(json.dumps(GEOJSON), encoding="utf-8")
    from_csv = stored.target_catalogs.create("Cities", CSV, "csv")
    from_file = stored.target_catalogs.create("Cities", file)
    targets = [{"id": f"t{n}", "lat_deg": 0.0, "lon_deg": n / 10.0} for n in range(1200)]
    listed = stored.target_catalogs.create("Grid", targets)
    assert (from_csv.num_targets, from_csv.ignored_columns) == (2, ("colour",))
    assert [t.id for t in stored.target_catalogs.targets(from_file.id)] == ["bern"]
    assert [t.id for t in stored.target_catalogs.targets(listed.id)] == [t["id"] for t in targets]
    assert [t.reward for t in stored.target_catalogs.targets(from_csv.id)] == [1.0, 2.0]


def test_every_bad_row_is_named(stored: Client) -> None:
    with pytest.raises(ServiceError) as refused:
        stored.target_catalogs.create("Cities", CSV + "x,91,0,1,red\ny,0,999,1,red\n", "csv")
    assert [fault.row for fault in refused.value.errors] == [4, 5]
    assert refused.value.request_id


def test_a_list_of_several_pages_is_read_to_its_end(stored: Client) -> None:
    names = [f"S{number}" for number in range(120)]
    rows = "".join(f"{name},10,{number}\n" for number, name in enumerate(names))
    stored.ground_stations.import_stations("name,lat_deg,lon_deg\n" + rows, "csv")
    assert sorted(s.name for s in stored.ground_stations.list()) == sorted(names)


def test_a_mission_is_planned_and_read_back(whole: Client, folder: Path) -> None:
    eye = whole.satellites.create("EYE-1", tle=tle())
    north = whole.ground_stations.create("North", 78.2, 15.4)
    cities = whole.target_catalogs.create("Cities", CSV, "csv")
    question = {
        "start": EPOCH,
        "end": datetime(2026, 3, 2, tzinfo=UTC),
        "satellite_ids": [eye.id],
        "target_catalog_ids": [cities.id],
        "ground_station_ids": [north.id],
    }
    scenario = whole.scenarios.create(**question, name="Day")  # type: ignore[arg-type]
    assert whole.scenarios.create(**question).id == scenario.id  # type: ignore[arg-type]
    assert scenario.counts.targets == 2
    contacts = list(whole.scenarios.opportunities(scenario.id, kind="contact"))
    assert contacts
    assert {one.kind for one in contacts} == {"contact"}
    job = whole.jobs.submit(scenario, "rule", label="day", priority=9).wait(timeout_s=60.0)
    timeline = job.timeline()
    outcomes = [target.outcome for target in job.targets()]
    assert timeline.scenario_sha256 == scenario.sha256
    assert len(outcomes) == 2
    assert sum(timeline.totals.targets.values()) == 2
    actions = [action for line in timeline.satellites for action in line.actions]
    assert len([a for a in actions if a.mode == "collect"]) == timeline.totals.collects
    saved = json.loads(job.download(folder / "day.json").read_text(encoding="utf-8"))
    assert saved["plan_sha256"] == timeline.plan_sha256
    with pytest.raises(ServiceError) as refused:
        job.download(folder / "day.docx")
    assert refused.value.code == "not_acceptable"
    assert [path.name for path in folder.iterdir()] == ["day.json"]
    plan = json.loads(job.download(folder / "day.openmct.json").read_text(encoding="utf-8"))
    assert sum(map(len, plan.values())) == len(actions)
    table = job.download(folder / "day.csv").read_text(encoding="utf-8")
    assert len(table.splitlines()) == 1 + len(actions)
    file = whole.scenarios.file(scenario.id)
    inline = whole.jobs.submit(file, "rule")
    assert inline.scenario.id == scenario.id
    assert inline.wait(60.0).timeline().plan_sha256 == timeline.plan_sha256


def test_solvers_and_their_params_are_told(whole: Client) -> None:
    solvers = {solver.name: solver for solver in whole.solvers()}
    assert whole.solver("mcts") == solvers["mcts"]
    assert "depth" in solvers["forward_search"].params_schema["properties"]
    assert whole.version().name == "slewline"
    assert whole.ready().workers == 1


def test_a_service_without_workers_is_told_at_once(stored: Client) -> None:
    with pytest.raises(ServiceError) as refused:
        stored.ready()
    assert (refused.value.status, refused.value.code) == (503, "not_live")


def test_a_comparison_of_a_scenario_that_is_not_there_is_refused(whole: Client) -> None:
    with pytest.raises(ServiceError) as refused:
        whole.comparisons.submit("nowhere", [{"solver": "rule"}])
    assert refused.value.errors[0].pointer == "/scenario_id"
