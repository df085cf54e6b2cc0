"""A huge job seen from outside (``python -m benchmarks.large_job SPACECRAFT CITIES``).

Starts ``slewline serve`` as a process of its own, sends it a fleet over cities, follows the job
and reads its answer in pages and in every form. Prints how long each call took, the size of its
answer, and the service's peak memory meanwhile (resident, in MB). The files are those of
``benchmarks.fleet_missions``. ``--keep`` keeps serving, for a look at the pages.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import httpx
import psutil

from benchmarks.fleet_missions import Files, fleet_scenario
from benchmarks.service import Json, Served, post, served
from planner_core.domain import Satellite, Scenario, mean_elements
from planner_core.orbits.omm import omm_from_elements
from service.wire.instants import instant_text

PAGE: Final = 500
FORMS: Final = ("json", "csv", "geojson", "czml", "ics", "openmct.json")
_SAMPLE_S: Final = 0.02


class Held:
    """Peak memory of each kind of process since the last call of ``taken``, in MB."""

    def __init__(self, root: psutil.Process):
        self._root = root
        self._most: defaultdict[str, float] = defaultdict(float)
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Held:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        self._thread.join()

    def taken(self) -> dict[str, float]:
        """Return the peaks, and start again."""
        self._sample()
        most, self._most = self._most, defaultdict(float)
        return dict(most)

    def _watch(self) -> None:
        while not self._is_over.wait(_SAMPLE_S):
            self._sample()

    def _sample(self) -> None:
        for process in [self._root, *self._root.children(recursive=True)]:
            try:
                kind = "api" if process == self._root else process_kind(process)
                self._most[kind] = max(self._most[kind], process.memory_info().rss / 1e6)
            except psutil.Error:
                continue  # it has ended


def process_kind(process: psutil.Process) -> str:
    command = " ".join(process.cmdline())
    if "forkserver" not in command:
        return "worker" if "service.jobs" in command else "other"
    # Solver processes are forks of the fork server, which has the same command.
    parent = process.parent()
    is_fork = parent is not None and "forkserver" in " ".join(parent.cmdline())
    return "solver" if is_fork else "fork server"


def satellite_of(satellite: Satellite) -> Json:
    """Return the body that is posted for a satellite."""
    agility = satellite.agility
    return {
        "name": satellite.name,
        "omm": omm_from_elements(mean_elements(satellite.orbit)),
        "agility": {"slew_rate_deg_s": agility.slew_rate_deg_s, "settle_s": agility.settle_s},
    }


def store(client: httpx.Client, scenario: Scenario) -> Json:
    """Store a fleet and its targets; return the scenario."""
    satellites = [post(client, "/v1/satellites", satellite_of(s)) for s in scenario.satellites]
    rows = "".join(f"{t.id},{t.lat_deg!r},{t.lon_deg!r}\n" for t in scenario.targets)
    catalog = client.post(
        "/v1/target-catalogs?name=Cities",
        content=f"id,lat_deg,lon_deg\n{rows}",
        headers={"Content-Type": "text/csv"},
    )
    catalog.raise_for_status()
    horizon = scenario.horizon
    body = {
        "name": f"{len(satellites)} satellites, {len(scenario.targets)} cities",
        "horizon": {"start": instant_text(horizon.start), "end": instant_text(horizon.end)},
        "satellite_ids": [one["id"] for one in satellites],
        "target_catalog_ids": [catalog.json()["id"]],
        "use_resources": False,
    }
    return post(client, "/v1/scenarios", body)


def followed(client: httpx.Client, job: Json) -> tuple[Json, int]:
    """Return a job that has ended, and how many changes it reported on the way."""
    num_changes = 0
    version = ""
    while job["state"] in ("queued", "running", "cancelling"):
        headers = {"If-None-Match": version} if version else {}
        answer = client.get(f"/v1/jobs/{job['id']}?wait=10", headers=headers)
        if answer.status_code == 200:
            job, version = answer.json(), answer.headers["etag"]
            num_changes += 1
    assert job["state"] in ("succeeded", "cancelled"), job
    return job, num_changes


def pages(client: httpx.Client, path: str, wanted: Json) -> Iterator[tuple[float, int]]:
    """Yield seconds and bytes of each page of a list."""
    cursor = None
    while True:
        query = wanted | {"limit": PAGE} | ({"cursor": cursor} if cursor else {})
        began = time.perf_counter()
        answer = client.get(path, params=query)
        yield time.perf_counter() - began, len(answer.content)
        cursor = answer.json()["next"]
        if cursor is None:
            return


@contextmanager
def told(held: Held, what: str) -> Iterator[dict[str, Any]]:
    """Print how long a step took and its peak memory."""
    notes: dict[str, Any] = {}
    held.taken()
    began = time.perf_counter()
    yield notes
    passed_s = time.perf_counter() - began
    memory = ", ".join(f"{kind} {mb:.0f}" for kind, mb in sorted(held.taken().items()))
    said = "; ".join(f"{name} {value}" for name, value in notes.items())
    print(f"{what}: {passed_s:.2f} s; {said or '-'}; MB: {memory}", flush=True)


def read_answer(service: Served, held: Held, job: Json) -> None:
    """Read an answer in pages and in every form."""
    client, path = service.client, f"/v1/jobs/{job['id']}"
    for wanted in ({}, {"outcome": "unscheduled"}):
        with told(held, f"targets {wanted}, {PAGE} a page") as notes:
            found = list(pages(client, f"{path}/targets", wanted))
            times = sorted(seconds for seconds, _ in found)
            notes |= {
                "pages": len(found),
                "median_ms": f"{1e3 * times[len(times) // 2]:.1f}",
                "worst_ms": f"{1e3 * times[-1]:.1f}",
                "kB": sum(size for _, size in found) // 1000,
            }
    for form in FORMS:
        with told(held, f"timeline.{form}") as notes:
            began = time.perf_counter()
            size = 0
            with client.stream("GET", f"{path}/timeline.{form}") as answer:
                answer.raise_for_status()
                for piece in answer.iter_bytes():
                    if size == 0:
                        notes["first_byte_ms"] = f"{1e3 * (time.perf_counter() - began):.0f}"
                    size += len(piece)
            notes["kB"] = size // 1000
    for call in (path, "/v1/jobs", f"/v1/jobs?scenario_id={job['scenario']['id']}"):
        times = []
        for _ in range(20):
            began = time.perf_counter()
            client.get(call).raise_for_status()
            times.append(time.perf_counter() - began)
        print(f"GET {call}: median {1e3 * sorted(times)[10]:.1f} ms", flush=True)


def main() -> None:
    """Send the job and read it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spacecraft", type=Path)
    parser.add_argument("cities", type=Path)
    parser.add_argument("--satellites", type=int, default=24)
    parser.add_argument("--targets", type=int, default=10_000)
    parser.add_argument("--solver", default="certified")
    parser.add_argument("--time-s", type=float, default=60.0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--database-url", help="an empty database; a SQLite file by default")
    parser.add_argument("--keep", action="store_true", help="keep serving")
    chosen = parser.parse_args()
    scenario = fleet_scenario(
        Files(spacecraft=chosen.spacecraft, cities=chosen.cities), chosen.satellites, chosen.targets
    )
    with tempfile.TemporaryDirectory() as folder:
        url = chosen.database_url or f"sqlite:///{folder}/slewline.db"
        with served(url, chosen.workers) as service, Held(service.process) as held:
            with told(held, "upload"):
                stored = store(service.client, scenario)
            with told(held, "job") as notes:
                limits = {"time_s": chosen.time_s}
                body = {"scenario_id": stored["id"], "solver": chosen.solver, "limits": limits}
                job, changes = followed(service.client, post(service.client, "/v1/jobs", body))
                progress = job["progress"]
                notes |= {"changes": changes, "reward": progress["reward"]}
                notes |= {"bound": progress["bound"], "ended": job["termination"]}
            read_answer(service, held, job)
            if chosen.keep:
                print(service.client.base_url.join(f"/jobs/{job['id']}"), flush=True)
                threading.Event().wait()


if __name__ == "__main__":
    main()
