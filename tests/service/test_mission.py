"""The whole service as a user meets it: real processes, real data, faults in between."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

from planner_core.solvers.registry import SOLVERS
from tests import independent
from tests.missions import (
    PAPER_ORBIT,
    STATIONS,
    Document,
    drawn_targets,
    landsat_targets,
    paper_mission,
)
from tests.patience import PATIENCE_S, wait_until

# Only one satellite may have a catalogue number.
_NUMBERS = itertools.count(90_001)
FINAL = ("succeeded", "failed", "cancelled", "expired")
LONG = {"depth": 9, "breadth": 5}
"""Parameters that keep forward search busy for many minutes."""


class Service:
    """A running ``slewline serve`` and a client for it."""

    def __init__(self, process: subprocess.Popen[str], url: str):
        self.process = process
        self.http = httpx.Client(base_url=url, timeout=60, trust_env=False)

    def post(self, path: str, body: Document) -> Document:
        answer = self.http.post(path, json=body)
        assert answer.is_success, answer.text
        result: Document = answer.json()
        return result

    def get(self, path: str) -> Any:
        answer = self.http.get(path)
        assert answer.is_success, answer.text
        return answer.json()

    def submit(self, scenario_id: str, solver: str, **more: Any) -> str:
        return str(
            self.post("/v1/jobs", {"scenario_id": scenario_id, "solver": solver, **more})["id"]
        )

    def until(self, job_id: str, *states: str) -> Document:
        """Return the job as soon as it is in one of these states."""
        deadline_s = time.monotonic() + PATIENCE_S
        while True:
            job: Document = self.get(f"/v1/jobs/{job_id}")
            if job["state"] in states:
                return job
            assert job["state"] not in FINAL, job
            assert time.monotonic() < deadline_s, job
            time.sleep(0.05)

    def all_targets(self, job_id: str) -> list[Document]:
        items: list[Document] = []
        cursor = ""
        while True:
            page = self.get(f"/v1/jobs/{job_id}/targets?limit=200{cursor}")
            items += page["items"]
            if page["next"] is None:
                return items
            cursor = f"&cursor={page['next']}"

    def workers(self) -> list[psutil.Process]:
        children = psutil.Process(self.process.pid).children()
        return [c for c in children if "service.jobs" in c.cmdline()]

    def busy_workers(self) -> list[psutil.Process]:
        """Return the workers that run a job's process, a child of their fork server."""
        return [w for w in self.workers() if any(child.children() for child in w.children())]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("service")
    process = subprocess.Popen(
        [sys.executable, "-m", "service", "serve", "--port", "0", "--workers", "2",
         "--database-url", f"sqlite:///{folder / 'slewline.db'}"],
        env=os.environ | {"SLEWLINE_LEASE_S": "3"},
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    running = Service(process, process.stdout.readline().split()[-1])
    yield running
    running.http.close()
    process.terminate()
    assert process.wait(PATIENCE_S) == 0
    process.stdout.close()


def post_mission(service: Service, targets: list[Document], **flags: Any) -> Document:
    """Store the paper's satellite, its stations and targets, and create the scenario."""
    omm = PAPER_ORBIT | {"NORAD_CAT_ID": next(_NUMBERS)}
    satellite = service.post("/v1/satellites", {"name": "PAPER", "omm": omm, "spacecraft": "paper"})
    stations = [service.post("/v1/ground-stations", station)["id"] for station in STATIONS]
    catalog = service.post("/v1/target-catalogs", {"name": "land", "targets": targets})
    mission = paper_mission([])
    return service.post(
        "/v1/scenarios",
        {
            "horizon": mission["horizon"],
            "satellite_ids": [satellite["id"]],
            "target_catalog_ids": [catalog["id"]],
            "ground_station_ids": stations,
            **flags,
        },
    )


@pytest.mark.parametrize("solver", ["rule", "forward_search"])
def test_five_hundred_real_targets_are_planned_and_the_plan_stands_up(
    service: Service, shared_data: Path, solver: str
) -> None:
    scenario = post_mission(service, landsat_targets(shared_data, 500))
    job = service.until(service.submit(scenario["id"], solver), *FINAL)
    assert job["state"] == "succeeded", job
    timeline = service.get(job["links"]["timeline"])
    targets = service.all_targets(job["id"])
    assert len(targets) == 500
    independent.check(service.get(f"/v1/scenarios/{scenario['id']}?expand=true"), timeline, targets)
    assert timeline["totals"]["reward"] > 200


def test_real_catalogues_import_completely_as_tle_and_as_omm(
    service: Service, shared_data: Path
) -> None:
    tle = (shared_data / "elements" / "resource_2022-08-15.tle").read_bytes()
    answer = service.http.post(
        "/v1/satellites/import", content=tle, headers={"Content-Type": "text/plain"}
    ).json()
    assert (answer["accepted"], answer["rejected"], answer["errors"]) == (180, 0, [])
    for suffix, media_type in (
        ("json", "application/json"),
        ("csv", "text/csv"),
        ("xml", "application/xml"),
    ):
        omm = (shared_data / "omm" / f"derived_eo_2022-08-15.{suffix}").read_bytes()
        answer = service.http.post(
            "/v1/satellites/import", content=omm, headers={"Content-Type": media_type}
        ).json()
        assert (answer["accepted"], answer["rejected"], answer["errors"]) == (20, 0, [])


def test_a_job_whose_worker_is_killed_finishes_once_within_a_minute(service: Service) -> None:
    scenario = post_mission(service, drawn_targets(300, seed=1))
    job_id = service.submit(
        scenario["id"], "forward_search", params=LONG, limits={"time_s": 8, "memory_mb": 2048}
    )
    service.until(job_id, "running")
    wait_until(service.busy_workers)
    (worker,) = service.busy_workers()
    worker.send_signal(signal.SIGKILL)
    job = service.until(job_id, *FINAL)
    assert (job["state"], job["attempt"]) == ("succeeded", 2), job
    assert job["termination"] == "time_limit"
    assert service.get(f"/v1/jobs/{job_id}/timeline")["validity"] == "valid"


def test_cancelling_a_running_job_takes_two_seconds_and_keeps_the_plan(service: Service) -> None:
    scenario = post_mission(service, drawn_targets(300, seed=2))
    began_s = time.monotonic()
    service.until(service.submit(scenario["id"], "rule"), *FINAL)
    whole_job_s = time.monotonic() - began_s
    job_id = service.submit(scenario["id"], "forward_search", params={"depth": 8, "breadth": 4})
    wait_until(lambda: (service.get(f"/v1/jobs/{job_id}")["progress"] or {}).get("reward"))
    began_s = time.monotonic()
    assert service.http.post(f"/v1/jobs/{job_id}/cancel").status_code == 202
    job = service.until(job_id, "cancelled")
    # The promise is for an idle machine; on a busy one everything takes longer.
    assert time.monotonic() - began_s < max(2.0, whole_job_s)
    assert job["termination"] == "cancelled"
    timeline = service.get(f"/v1/jobs/{job_id}/timeline")
    assert timeline["validity"] == "valid"
    assert timeline["totals"]["reward"] > 0
    again = service.http.post(f"/v1/jobs/{job_id}/cancel")
    assert again.status_code == 409


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """One scenario, and every solver's timelines: of two jobs, and of a file."""

    scenario: Document
    timelines: dict[str, list[Document]]


@pytest.fixture(scope="module", params=[True, False], ids=["resources", "free"])
def answers(
    request: pytest.FixtureRequest, service: Service, tmp_path_factory: pytest.TempPathFactory
) -> Answers:
    """Plan every job in a process of its own, and the file in another."""
    scenario = post_mission(service, drawn_targets(60, seed=3), use_resources=request.param)
    jobs = [(solver, service.submit(scenario["id"], solver)) for solver in [*SOLVERS, *SOLVERS]]
    folder = tmp_path_factory.mktemp("file")
    file = folder / "scenario.json"
    file.write_text(service.http.get(f"/v1/scenarios/{scenario['id']}?expand=true").text)
    subprocess.run([sys.executable, "-c", SOLVE, str(file), *SOLVERS], check=True)
    timelines: dict[str, list[Document]] = {
        solver: [json.loads((folder / f"{solver}.json").read_text())] for solver in SOLVERS
    }
    for solver, job_id in jobs:
        ended = service.until(job_id, *FINAL)
        timelines[solver].append(service.get(ended["links"]["timeline"]))
    return Answers(scenario=scenario, timelines=timelines)


SOLVE = """
import sys
from service.commands.cli import main
file, *solvers = sys.argv[1:]
for solver in solvers:
    out = file.replace("scenario.json", f"{solver}.json")
    assert main(["solve", file, "--solver", solver, "--out", out]) == 0
"""


@pytest.mark.parametrize("solver", sorted(SOLVERS))
def test_the_same_question_gives_the_same_plan_in_every_process(
    answers: Answers, solver: str
) -> None:
    """Twice over HTTP, and from a file."""
    timelines = answers.timelines[solver]
    assert len(timelines) == 3
    assert timelines[0]["totals"]["collects"] > 0
    assert len({timeline["plan_sha256"] for timeline in timelines}) == 1
    assert {timeline["scenario_sha256"] for timeline in timelines} == {answers.scenario["sha256"]}


def test_a_job_may_bring_its_scenario_along(service: Service) -> None:
    mission = paper_mission(drawn_targets(40, seed=4))
    body = {"scenario": mission, "solver": "rule", "label": "inline"}
    job = service.until(service.post("/v1/jobs", body)["id"], *FINAL)
    assert job["state"] == "succeeded", job
    file = service.get(f"/v1/scenarios/{job['scenario']['id']}?expand=true")
    assert [t["id"] for t in file["targets"]] == [t["id"] for t in mission["targets"]]
    by_id = {"scenario_id": job["scenario"]["id"]} | {"scenario": mission, "solver": "rule"}
    refused = service.http.post("/v1/jobs", json=by_id)
    assert refused.status_code == 422
    mission["satellites"][0]["omm"] = {**PAPER_ORBIT, "ECCENTRICITY": 1.5}
    refused = service.http.post("/v1/jobs", json=body)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/scenario/satellites/0/omm/ECCENTRICITY"
