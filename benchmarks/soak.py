"""The service under steady work for hours (``python -m benchmarks.soak CSV --hours 2``).

Starts ``slewline serve`` on an empty database and keeps it busy with small jobs, ten a minute by
default: uploads, scenarios, polls, every form of every answer, lists, event streams, deletions.
Once a minute it writes a row: memory and descriptors of each kind of process, size of the database,
number and duration of calls. ``benchmarks.soak_plot`` plots the rows.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import random
import statistics
import tempfile
import threading
import time
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import httpx
import psutil
import sqlalchemy as sa

from benchmarks.large_job import FORMS, process_kind
from benchmarks.service import Json, Served, served
from service.commands import demo_mission

NUM_TARGETS: Final = 60
PERIOD_S: Final = 60.0
SAMPLE_S: Final = 1.0
JOBS_PER_SCENARIO: Final = 5
KINDS: Final = ("api", "worker", "fork server", "solver")
_TIME_LIMIT_S: Final = 2.0
_ENDED_WITHIN_S: Final = 120.0
_REST_S: Final = 1.0

COLUMNS: Final = (
    "minutes", "jobs", "failed", "calls", "refused", "call_p50_ms", "call_p99_ms", "database_mb",
    *(f"{kind.replace(' ', '_')}_{what}" for what in ("mb", "descriptors") for kind in KINDS),
)  # fmt: skip


class Tally:
    """Calls since the last row, and outcomes of the jobs so far."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._times_s: list[float] = []
        self.total: Counter[str] = Counter()

    def call(self, client: httpx.Client, method: str, path: str, **body: Any) -> httpx.Response:
        """Make a call; count it, and whether it was refused."""
        began = time.perf_counter()
        answer = client.request(method, path, **body)
        with self._lock:
            self._times_s.append(time.perf_counter() - began)
            self.total["calls"] += 1
            self.total["refused"] += answer.status_code >= 400
        return answer

    def count(self, what: str) -> None:
        """Count a job."""
        with self._lock:
            self.total[what] += 1

    def taken(self) -> dict[str, float]:
        """Return the sums so far, and how long the calls since the last row took."""
        with self._lock:
            times_s, self._times_s = sorted(self._times_s) or [0.0], []
            sums = {name: self.total[name] for name in ("jobs", "failed", "calls", "refused")}
        return sums | {
            "call_p50_ms": 1e3 * statistics.median(times_s),
            "call_p99_ms": 1e3 * times_s[int(0.99 * (len(times_s) - 1))],
        }


class Gauges:
    """The largest memory and number of descriptors, by kind of process, since the last row.

    Processes of one kind are added up: two workers count together.
    """

    def __init__(self, root: psutil.Process):
        self._root = root
        self._most: defaultdict[str, float] = defaultdict(float)

    def look(self) -> None:
        """Look at all processes once."""
        now: defaultdict[str, float] = defaultdict(float)
        for process in [self._root, *self._root.children(recursive=True)]:
            try:
                kind = "api" if process == self._root else process_kind(process)
                name = kind.replace(" ", "_")
                now[f"{name}_mb"] += process.memory_info().rss / 1e6
                now[f"{name}_descriptors"] += process.num_fds()
            except psutil.Error:
                continue  # it has ended
        for name, value in now.items():
            self._most[name] = max(self._most[name], value)

    def taken(self) -> dict[str, float]:
        """Return the peaks, and start again."""
        most, self._most = self._most, defaultdict(float)
        return dict(most)


def database_mb(url: str) -> float:
    """Return the size of the database on its disk."""
    parsed = sa.make_url(url)
    if parsed.get_backend_name() == "sqlite":
        file = Path(str(parsed.database))
        return sum(path.stat().st_size for path in file.parent.glob(f"{file.name}*")) / 1e6
    engine = sa.create_engine(url)
    with engine.connect() as connection:
        size = connection.execute(sa.text("select pg_database_size(current_database())"))
        return float(size.scalar_one()) / 1e6


class Customer:
    """A client that plans, polls, reads and deletes."""

    def __init__(self, client: httpx.Client, tally: Tally, seed: int = 0):
        self._client = client
        self._tally = tally
        self._random = random.Random(seed)
        self._lock = threading.Lock()
        self._kept = self._post_satellite(), self._post_station()
        answer = self._call("GET", "/v1/solvers").json()
        self._solvers = itertools.cycle([solver["name"] for solver in answer["items"]])
        self._scenario_id = ""
        self._catalog_id = ""

    def _call(self, method: str, path: str, **body: Any) -> httpx.Response:
        return self._tally.call(self._client, method, path, **body)

    def _post_satellite(self) -> str:
        return str(self._call("POST", "/v1/satellites", json=demo_mission.SATELLITE).json()["id"])

    def _post_station(self) -> str:
        station = demo_mission.GROUND_STATIONS[0]
        return str(self._call("POST", "/v1/ground-stations", json=station).json()["id"])

    def new_question(self) -> None:
        """Store a new scenario; delete everything of the one before."""
        old_catalog_id = self._catalog_id
        targets = demo_mission.targets_csv(NUM_TARGETS, seed=self._random.randrange(10**9))
        headers = {"Content-Type": "text/csv"}
        sent = self._call("POST", "/v1/target-catalogs", content=targets, headers=headers)
        self._catalog_id = str(sent.json()["id"])
        body = {
            "horizon": demo_mission.HORIZON,
            "satellite_ids": [self._kept[0]],
            "target_catalog_ids": [self._catalog_id],
            "ground_station_ids": [self._kept[1]],
            "use_resources": True,
        }
        self._scenario_id = str(self._call("POST", "/v1/scenarios", json=body).json()["id"])
        if old_catalog_id:
            self._call("DELETE", f"/v1/target-catalogs/{old_catalog_id}")
            self._call("DELETE", f"/v1/ground-stations/{self._post_station()}")

    def plan(self, number: int) -> None:
        """Order one plan and use it as clients do."""
        with self._lock:
            if number % JOBS_PER_SCENARIO == 0:
                self.new_question()
            scenario_id, solver = self._scenario_id, next(self._solvers)
        body = {
            "scenario_id": scenario_id,
            "solver": solver,
            "limits": {"time_s": _TIME_LIMIT_S},
            "label": f"job {number}",
        }
        headers = {"Idempotency-Key": f"job-{number}"}
        job: Json = self._call("POST", "/v1/jobs", json=body, headers=headers).json()
        state = self._follow(job) if number % 2 else self._listen(job)
        self._tally.count("jobs")
        if state != "succeeded":
            self._tally.count("failed")
            return
        self._read(job["id"], scenario_id, FORMS[number % len(FORMS)])

    def _follow(self, job: Json) -> str:
        etag = ""
        until = time.monotonic() + _ENDED_WITHIN_S
        while job["state"] in ("queued", "running", "cancelling") and time.monotonic() < until:
            time.sleep(_REST_S)
            headers = {"If-None-Match": etag} if etag else {}
            answer = self._call("GET", f"/v1/jobs/{job['id']}", headers=headers)
            if answer.status_code == 200:
                job, etag = answer.json(), answer.headers["etag"]
        return str(job["state"])

    def _listen(self, job: Json) -> str:
        path = f"/v1/jobs/{job['id']}/events"
        with self._client.stream("GET", path, timeout=_ENDED_WITHIN_S) as answer:
            for _ in answer.iter_lines():
                pass
        return str(self._call("GET", f"/v1/jobs/{job['id']}").json()["state"])

    def _read(self, job_id: str, scenario_id: str, form: str) -> None:
        suffix = "" if form == "json" else f".{form}"
        for path in (
            f"/v1/jobs/{job_id}/timeline{suffix}",
            "/v1/jobs?limit=50",
            "/v1/scenarios?limit=50",
            f"/v1/scenarios/{scenario_id}/opportunities?limit=200",
            f"/v1/scenarios/{scenario_id}?expand=true",
            "/metrics",
        ):
            self._call("GET", path)


def soak(service: Served, table: Path, hours: float, per_minute: float) -> None:
    """Keep the service busy; write a row a minute."""
    tally, gauges = Tally(), Gauges(service.process)
    customer = Customer(service.client, tally)
    began = time.monotonic()
    with (
        table.open("w", newline="", encoding="utf-8") as file,
        ThreadPoolExecutor(max_workers=8) as pool,
    ):
        rows = csv.DictWriter(file, COLUMNS, restval=0)
        rows.writeheader()
        next_job, next_row = 0, 1
        while (passed_s := time.monotonic() - began) < hours * 3600.0:
            gauges.look()
            if passed_s >= 60.0 / per_minute * next_job:
                pool.submit(customer.plan, next_job).add_done_callback(_raise)
                next_job += 1
            if passed_s >= PERIOD_S * next_row:
                found = tally.taken() | gauges.taken()
                found |= {
                    "minutes": passed_s / 60.0,
                    "database_mb": database_mb(service.database_url),
                }
                rows.writerow(
                    {name: f"{value:.6g}" for name, value in found.items() if name in COLUMNS}
                )
                file.flush()
                next_row += 1
            time.sleep(SAMPLE_S)


def _raise(done: Any) -> None:
    if done.exception() is not None:
        print(f"a customer gave up: {done.exception()!r}", flush=True)


def main() -> None:
    """Run the soak test on one database for some hours."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path, help="the CSV file to write")
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--per-minute", type=float, default=10.0, help="jobs")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--database-url", help="an empty database; a SQLite file by default")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        url = chosen.database_url or f"sqlite:///{folder}/slewline.db"
        with served(url, chosen.workers) as service:
            soak(service, chosen.table, chosen.hours, chosen.per_minute)


if __name__ == "__main__":
    main()
