"""A database without room, or locked by another process, during every kind of write (SQLite)."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager

import httpx
import pytest
import sqlalchemy as sa

from tests.missions import PAPER_ORBIT, drawn_targets, paper_mission
from tests.service.conftest import new_app, serve
from tests.service.factories import ground_station, post, satellite, target, tle
from tests.service.jobs.conftest import Jobs
from tests.service.jobs.test_api import finish
from tests.service.jobs.unwritable import sqlite_pragma
from tests.service.problems import assert_problem

SPAN = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-01T02:00:00Z"}
Breaks = Callable[[sa.Engine], AbstractContextManager[None]]


@contextmanager
def locked(engine: sa.Engine) -> Iterator[None]:
    """Hold the writers' lock, and let others wait for it a moment instead of 30 s."""
    with sqlite_pragma(engine, "busy_timeout = 50", "busy_timeout = 30000"):
        other = sqlite3.connect(str(engine.url.database))
        try:
            other.execute("BEGIN IMMEDIATE")
            yield
        finally:
            other.rollback()
            other.close()


@contextmanager
def full(engine: sa.Engine) -> Iterator[None]:
    """Stop the file from growing, and leave no free page in it."""
    engine.dispose()
    with closing(sqlite3.connect(str(engine.url.database))) as connection:
        connection.execute("VACUUM")
    with sqlite_pragma(engine, "max_page_count = 1", "max_page_count = 1073741823"):
        yield


def writes(client: httpx.Client, jobs: Jobs) -> dict[str, httpx.Request]:
    """Return a call of each kind that writes, ready to be sent."""
    inline = {"scenario": paper_mission(drawn_targets(300)), "solver": "rule"}
    compared = {"scenario_id": jobs.scenario_id, "runs": [{"solver": "rule"}] * 32}
    newer = {"omm": PAPER_ORBIT | {"NORAD_CAT_ID": 90001}}
    question = {"scenario_id": jobs.scenario_id, "solver": "rule"}
    many = {"name": "many", "targets": [target(id="x" * 150 + str(n)) for n in range(500)]}
    stations = [post(client, "/v1/ground-stations", ground_station(name=f"S{n}")) for n in (0, 1)]
    made = post(client, "/v1/satellites", satellite(tle=tle()))
    job = post(client, "/v1/jobs", question)
    answered = [post(client, "/v1/jobs", question)["id"] for _ in range(2)]
    for job_id in answered:
        finish(jobs, job_id)
    plan = post(client, "/v1/plans", {"job_id": answered[0]})["links"]["self"]
    drafted = post(client, "/v1/plans", {"job_id": answered[0]})["links"]["self"]
    catalog = post(client, "/v1/target-catalogs", {"name": "few", "targets": [target(id="a")]})
    other = post(client, "/v1/satellites", satellite(name="B"))
    ids = {"satellite_ids": [other["id"]], "target_catalog_ids": [catalog["id"]]}
    scenario = {"horizon": SPAN, **ids}
    stored = {"horizon": SPAN | {"end": "2026-03-01T03:00:00Z"}, **ids}
    out = {"station_id": stations[1]["id"], **SPAN, "reason": "r" * 200}
    own = {
        name: f"/v1/{name}/{post(client, f'/v1/{name}', body)['id']}"
        for name, body in (
            ("outages", out), ("spacecraft", {"name": "Bus"}), ("scenarios", stored),
        )
    }  # fmt: skip
    skies = "target_id,time,clear_probability\n" + "".join(
        f"t{n},2026-03-01T00:00:00Z,0.5\n" for n in range(5000)
    )
    where = f"/v1/satellites/{made['id']}"
    named = {"name": "N" * 200}
    csv, kind = "name,lat_deg,lon_deg\nA,1,1\n", {"Content-Type": "text/csv"}
    build = client.build_request
    return {
        "satellite": build("POST", "/v1/satellites", json={"name": "B", "omm": PAPER_ORBIT}),
        "elements": build("PUT", f"{where}/elements", json=newer),
        "satellite's end": build("DELETE", where),
        "station": build("POST", "/v1/ground-stations", json=ground_station(name="T" * 200)),
        "station's end": build("DELETE", f"/v1/ground-stations/{stations[0]['id']}"),
        "import": build("POST", "/v1/ground-stations/import", content=csv, headers=kind),
        "catalogue": build("POST", "/v1/target-catalogs", json=many),
        "job": build("POST", "/v1/jobs", json=question),
        "inline job": build("POST", "/v1/jobs", json=inline),
        "keyed job": build("POST", "/v1/jobs", json=question, headers={"Idempotency-Key": "k"}),
        "rerun": build("POST", f"/v1/jobs/{job['id']}/rerun"),
        "cancel": build("POST", f"/v1/jobs/{job['id']}/cancel"),
        "comparison": build("POST", "/v1/comparisons", json=compared),
        "webhook": build("POST", "/v1/webhooks", json={"url": "https://ops.example/" + "a" * 1900}),
        "station's change": build("PATCH", f"/v1/ground-stations/{stations[1]['id']}", json=named),
        "scenario": build("POST", "/v1/scenarios", json=scenario),
        "scenario's end": build("DELETE", own["scenarios"]),
        "outage": build("POST", "/v1/outages", json=out),
        "outage's end": build("DELETE", own["outages"]),
        "spacecraft": build("POST", "/v1/spacecraft", json={"name": "B" * 200}),
        "spacecraft's change": build("PATCH", own["spacecraft"], json=named),
        "spacecraft's end": build("DELETE", own["spacecraft"]),
        "forecast": build("POST", "/v1/forecasts?name=Skies", content=skies, headers=kind),
        "plan": build("POST", "/v1/plans", json={"job_id": answered[0]}),
        "plan's move": build("POST", f"{plan}/transitions", json={"to": "withdrawn"}),
        "plan's end": build("DELETE", drafted),
        "job's end": build("DELETE", f"/v1/jobs/{answered[1]}"),
    }  # fmt: skip


@pytest.mark.parametrize("broken", [locked, full])
def test_every_write_is_done_wholly_or_503(jobs: Jobs, broken: Breaks) -> None:
    app = new_app(jobs.settings, jobs.queue)
    engine = app.state.database.engine
    with serve(app) as address, httpx.Client(base_url=address, timeout=120) as client:
        calls = writes(client, jobs)
        refused = []
        with broken(engine):
            for name, call in calls.items():
                answer = client.send(call)
                if answer.status_code == 503:
                    assert_problem(answer, 503, "database_unavailable")
                    refused.append(name)
                else:
                    # A write that needs no new page still fits.
                    assert broken is full, (name, answer.text)
                    assert answer.is_success, (name, answer.text)
            assert client.get("/v1/jobs").status_code == 200
        assert "catalogue" in refused
        for name in refused:
            assert client.send(calls[name]).is_success, name
        with engine.connect() as connection:
            assert connection.exec_driver_sql("PRAGMA integrity_check").scalar() == "ok"
    app.state.database.close()
