"""The cost of the running service (``python -m benchmarks.service [--database-url URL]``).

Starts ``slewline serve`` as a process of its own on an empty database (a SQLite file, or the given
PostgreSQL database) and measures it from outside. Prints times, and ratios of times taken in the
same run, which mean more on a machine that is also doing other things.
"""

from __future__ import annotations

import argparse
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from typing import Any

import httpx
import psutil
import sqlalchemy as sa

from benchmarks import pollers
from service.client import Client
from service.commands import demo_mission
from service.commands.demo import create_mission
from service.db.ids import new_id
from service.db.rows import JobChunkRow, JobResultRow, JobRow
from service.db.session import Database
from service.wire.base import dumped, parse_instant
from service.wire.instants import instant_text

RUNS = 9
POLLS = 600
NUM_DASHBOARDS = 200
NUM_RUNNING = 50
NUM_STORED = (100, 10_000)
NUM_TARGETS = 20_000
SECTIONS = ("plans", "polls", "uploads", "dashboards", "lists")

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Served:
    """The service, a client of it, and its process."""

    client: httpx.Client
    process: psutil.Process
    database_url: str

    def cpu_s(self) -> float:
        """Return the CPU time of the API's process; the workers are separate processes."""
        times = self.process.cpu_times()
        return float(times.user + times.system)


@contextmanager
def served(database_url: str, workers: int) -> Iterator[Served]:
    command = [sys.executable, "-m", "service", "serve", "--port", "0"]
    command += ["--workers", str(workers), "--database-url", database_url]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    try:
        url = process.stdout.readline().split()[-1]
        with httpx.Client(base_url=url, timeout=120, trust_env=False) as client:
            yield Served(client, psutil.Process(process.pid), database_url)
    finally:
        process.terminate()
        process.wait()


def post(client: httpx.Client, path: str, body: Json) -> Json:
    answer = client.post(path, json=body)
    answer.raise_for_status()
    found: Json = answer.json()
    return found


def submit(client: httpx.Client, scenario_id: str, solver: str, **params: object) -> str:
    body = {"scenario_id": scenario_id, "solver": solver, "params": params}
    return str(post(client, "/v1/jobs", body)["id"])


def wait(client: httpx.Client, job_id: str) -> Json:
    """Return a job that has succeeded, and its timeline."""
    job: Json = client.get(f"/v1/jobs/{job_id}").json()
    while job["state"] in ("queued", "running"):
        job = client.get(f"/v1/jobs/{job_id}?wait=10").json()
    assert job["state"] == "succeeded", job
    return job


def median_s(work: Callable[[], object], runs: int = RUNS) -> float:
    times = []
    for _ in range(runs):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def plan(client: httpx.Client, scenario_id: str) -> None:
    """Plan the mission, from the job's submission to the last byte of its timeline."""
    job = wait(client, submit(client, scenario_id, "forward_search"))
    client.get(job["links"]["timeline"]).raise_for_status()


def asked(mission: Json, **changes: object) -> Json:
    """Return the body of the mission's scenario, with some changes."""
    names = ("satellite_ids", "target_catalog_ids", "ground_station_ids", "use_resources")
    return {name: mission[name] for name in names} | {"horizon": demo_mission.HORIZON} | changes


def submit_to_timeline(service: Served, mission: Json) -> None:
    cold = []
    for shift in range(1, RUNS + 1):
        horizon = {
            name: instant_text(parse_instant(instant) + timedelta(minutes=shift))
            for name, instant in demo_mission.HORIZON.items()
        }
        scenario_id = post(service.client, "/v1/scenarios", asked(mission, horizon=horizon))["id"]
        cold.append(median_s(partial(plan, service.client, scenario_id), 1))
    plan(service.client, mission["id"])
    stored_s = median_s(lambda: plan(service.client, mission["id"]))
    print(f"submit to timeline, 1,000 targets, forward search: p50 {statistics.median(cold):.3f} s "
          f"for a new scenario (aim 1), {stored_s:.3f} s for a stored one (aim 0.4)")  # fmt: skip


def polls(service: Served, mission: Json) -> None:
    """Compare answers that are rendered, cached answers to repeated requests, and 304."""
    job_id = submit(service.client, mission["id"], "forward_search")
    wait(service.client, job_id)
    for name, path in (("job", f"/v1/jobs/{job_id}"), ("timeline", f"/v1/jobs/{job_id}/timeline")):
        etag = service.client.get(path).headers["etag"]
        ways = [Poll(path, {}, 200), Poll(path, {"If-None-Match": etag}, 304)]
        if name == "job":
            ways.append(Poll(f"{path}?wait=0", {}, 200))  # which is never cached
        # In turn, so that all are measured under the same load of the machine.
        times = [[cpu_s_of(service, way) for way in ways] for _ in range(RUNS)]
        full_s, same_s, *written_s = map(statistics.median, zip(*times, strict=True))
        kept = ""
        if written_s:
            full_s, kept = written_s[0], f", kept {full_s * 1e3:.2f} ms"
        told = f"{full_s * 1e3:.2f} ms of the server's CPU time{kept}, 304 {same_s * 1e3:.2f} ms"
        print(f"poll of a {name}: {told}, {full_s / same_s:.1f} times cheaper (aim 3 for a job)")


@dataclass(frozen=True, slots=True)
class Poll:
    """A call, and the expected status."""

    path: str
    headers: dict[str, str]
    status: int


def cpu_s_of(service: Served, poll: Poll) -> float:
    """Return the server's CPU time for one poll, from many in a row."""
    began_s = service.cpu_s()
    for _ in range(POLLS):
        assert service.client.get(poll.path, headers=poll.headers).status_code == poll.status
    return (service.cpu_s() - began_s) / POLLS


def dashboards(service: Served, mission: Json, simulations: int) -> None:
    """Compare a batch of jobs that no client polls with one that many poll."""
    wait(service.client, submit(service.client, mission["id"], "mcts"))  # the first one is slower
    times: dict[bool, list[float]] = {False: [], True: []}
    num_polls = 0
    for is_watched in (False, True, True, False):
        began = time.perf_counter()
        ids = [
            submit(service.client, mission["id"], "mcts", num_simulations=simulations)
            for _ in range(NUM_RUNNING)
        ]
        if is_watched:
            base_url = str(service.client.base_url)
            with pollers.polling(base_url, ids, NUM_DASHBOARDS) as polled:
                wait(service.client, ids[-1])
                num_polls += polled()
        else:
            wait(service.client, ids[-1])
        times[is_watched].append(time.perf_counter() - began)
    alone_s, watched_s = sum(times[False]), sum(times[True])
    print(f"{NUM_RUNNING} jobs: {alone_s / 2:.1f} s alone, {watched_s / 2:.1f} s beside "
          f"{NUM_DASHBOARDS} dashboards ({num_polls / watched_s:.0f} polls a second), "
          f"{100 * (watched_s / alone_s - 1):+.0f} % (aim at most +10)")  # fmt: skip


def many_jobs(service: Served, mission: Json) -> None:
    """Compare lists and polls with few and with many jobs stored."""
    # Its answer is small: ten thousand large ones would measure the disk.
    few_targets = service.client.post(
        "/v1/target-catalogs",
        content=demo_mission.targets_csv(20),
        headers={"Content-Type": "text/csv"},
    ).json()
    question = asked(mission, target_catalog_ids=[few_targets["id"]])
    scenario_id = post(service.client, "/v1/scenarios", question)["id"]
    pattern = submit(service.client, scenario_id, "rule")
    wait(service.client, pattern)
    database = Database(service.database_url)
    found: dict[int, list[float]] = {}
    stored = 0
    for num_jobs in NUM_STORED:
        copy_job(database, pattern, num_jobs - stored)
        stored = num_jobs
        calls = (
            "/v1/jobs",
            "/v1/jobs?state=succeeded",
            f"/v1/jobs?scenario_id={scenario_id}",
            "/v1/jobs?label=stored",
            f"/v1/jobs/{pattern}",
        )
        found[num_jobs] = [median_s(partial(service.client.get, call), 60) for call in calls]
    database.close()
    few, many = (found[num_jobs] for num_jobs in NUM_STORED)
    for name, few_s, many_s in zip(
        ("list", "list by state", "list by scenario", "list by label", "poll"), few, many,
        strict=True,
    ):  # fmt: skip
        print(f"{name} with {NUM_STORED[1]:,} jobs stored: {many_s * 1e3:.1f} ms, "
              f"{many_s / few_s:.2f} times that with {NUM_STORED[0]}")  # fmt: skip


def copy_job(database: Database, job_id: str, copies: int) -> None:
    with database.transaction() as session:
        ids = [new_id() for _ in range(copies)]
        for kind, key in ((JobRow, "id"), (JobResultRow, "job_id"), (JobChunkRow, "job_id")):
            table = kind.__table__
            found = session.execute(sa.select(table).where(table.c[key] == job_id)).mappings().all()
            changes = {"label": "stored"} if kind is JobRow else {}
            rows = [{**row, **changes, key: copy} for copy in ids for row in found]
            session.execute(sa.insert(kind), rows)


def uploads(service: Served) -> None:
    places = random.Random(0)
    targets = [
        {"id": f"t{n}", "lat_deg": places.uniform(-80, 80), "lon_deg": places.uniform(-180, 180)}
        for n in range(NUM_TARGETS)
    ]
    rows = "".join(f"{t['id']},{t['lat_deg']},{t['lon_deg']}\n" for t in targets)
    features = [
        {
            "type": "Feature",
            "id": t["id"],
            "geometry": {"type": "Point", "coordinates": [t["lon_deg"], t["lat_deg"]]},
            "properties": {},
        }
        for t in targets
    ]
    send = service.client.post
    path = "/v1/target-catalogs"
    for name, kind, document in (
        ("CSV", "text/csv", f"id,lat_deg,lon_deg\n{rows}"),
        ("GeoJSON", "application/geo+json", {"type": "FeatureCollection", "features": features}),
        ("JSON", "application/json", {"name": "Many", "targets": targets}),
    ):
        began = time.perf_counter()
        if isinstance(document, str):
            answer = send(path, content=document, headers={"Content-Type": kind})
        else:
            answer = send(path, json=document, headers={"Content-Type": kind})
        answer.raise_for_status()
        print(f"upload of {NUM_TARGETS:,} targets as {name}: "
              f"{time.perf_counter() - began:.2f} s (aim 3)")  # fmt: skip


def main() -> None:
    """Measure all or one section, on one database."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--database-url", help="an empty database; a SQLite file by default")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--simulations", type=int, default=500, help="of each watched job")
    parser.add_argument("--only", choices=SECTIONS, help="one section, instead of all")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        database_url = chosen.database_url or f"sqlite:///{folder}/slewline.db"
        print(f"{sa.make_url(database_url).get_backend_name()}, {os.cpu_count()} cores, "
              f"{chosen.workers} workers, load {os.getloadavg()[0]:.1f}")  # fmt: skip
        with served(database_url, chosen.workers) as service:
            with Client(str(service.client.base_url), key="") as client:
                mission = dumped(create_mission(client))
            sections: dict[str, Callable[[], None]] = {
                "plans": lambda: submit_to_timeline(service, mission),
                "polls": lambda: polls(service, mission),
                "uploads": lambda: uploads(service),
                "dashboards": lambda: dashboards(service, mission, chosen.simulations),
                "lists": lambda: many_jobs(service, mission),
            }
            for name in SECTIONS if chosen.only is None else (chosen.only,):
                sections[name]()


if __name__ == "__main__":
    main()
