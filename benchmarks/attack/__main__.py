"""Polls, submissions and deliveries of one owner while another one attacks.

Starts ``slewline serve`` with a worker on an empty database (a SQLite file, or the given
PostgreSQL database). Each attack lasts a while; meanwhile another owner polls, submits and receives
webhooks, each independently. Prints medians and 99th percentiles, and their ratio to those of the
same run without an attack.
"""

from __future__ import annotations

import argparse
import os
import secrets
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final

import httpx
import psutil

from benchmarks.attack.attackers import ATTACKS, attacking

CALM: Final = "none"
OWNERS: Final = ("attacker", "victim")
BEGINNING_S: Final = 5.0
PAUSE_S: Final = 0.25
HORIZON: Final = {"start": "2026-03-01T00:00:00Z", "end": "2026-03-15T00:00:00Z"}
TLE: Final = (
    "1 90001U 26001A   26060.00000000  .00000000  00000+0  10000-4 0  9997",
    "2 90001  97.6000  10.0000 0010000   0.0000   0.0000 15.00000000    02",
)

Times = dict[str, list[float]]


class Receiver:
    """Record when each message arrived."""

    def __init__(self) -> None:
        self.arrived = threading.Event()
        own = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                self.rfile.read(int(self.headers["content-length"]))
                self.send_response(204)
                self.end_headers()
                own.arrived.set()

            def log_message(self, *args: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()


@contextmanager
def served(database_url: str) -> Iterator[tuple[str, psutil.Process, dict[str, dict[str, str]]]]:
    """Run the service; yield its address, its process, and a key of each owner."""
    tokens = {owner: secrets.token_hex(24) for owner in OWNERS}
    settings = {
        "SLEWLINE_REQUIRE_KEYS": "true",
        "SLEWLINE_RATE_LIMIT_PER_S": "50",  # as wherever others can reach it
        "SLEWLINE_WEBHOOK_PRIVATE_ADDRESSES": "true",
        "SLEWLINE_API_KEYS": ",".join(f"{own}:submit:{token}" for own, token in tokens.items()),
    }
    command = [sys.executable, "-m", "service", "serve", "--port", "0", "--workers", "1"]
    process = subprocess.Popen(
        [*command, "--database-url", database_url],
        env=os.environ | settings,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdout is not None
    try:
        url = process.stdout.readline().split()[-1]
        keys = {owner: {"Authorization": f"Bearer {token}"} for owner, token in tokens.items()}
        yield url, psutil.Process(process.pid), keys
    finally:
        process.terminate()
        process.wait()


def post(client: httpx.Client, path: str, body: object) -> str:
    """Post a body that must be accepted; return the id of what was created."""
    answer = client.post(path, json=body)
    answer.raise_for_status()
    return str(answer.json()["id"])


def scenario(client: httpx.Client, satellite: str, num_targets: int, **fields: Any) -> str:
    """Store a scenario with this number of targets."""
    targets = [
        {"id": f"t{i}", "lat_deg": -80 + 160 * i / num_targets, "lon_deg": i % 360 - 180}
        for i in range(num_targets)
    ]
    catalog = post(client, "/v1/target-catalogs", {"name": "T", "targets": targets})
    ids = {"satellite_ids": [satellite], "target_catalog_ids": [catalog]}
    return post(client, "/v1/scenarios", {"horizon": HORIZON, **ids, **fields})


def aims_of(client: httpx.Client) -> dict[str, Any]:
    """Store what the attacks use as targets."""
    satellite = post(client, "/v1/satellites", {"name": "EYE", "tle": TLE})
    light = scenario(client, satellite, 20)
    return {
        "light": light,
        "heavy": scenario(client, satellite, 50_000, collect_spacing_s=0.7),
        "job": post(client, "/v1/jobs", {"scenario_id": light, "solver": "rule"}),
    }


def measure(url: str, key: dict[str, str], aims: dict[str, Any], for_s: float) -> Times:
    """Return the seconds that each kind of the victim's calls took, repeated for a while."""
    receiver = Receiver()
    until_s = time.monotonic() + for_s
    with httpx.Client(base_url=url, headers=key, timeout=300) as client:
        body = {"scenario_id": aims["light"], "solver": "rule"}
        job = post(client, "/v1/jobs", body)
        webhook = post(client, "/v1/webhooks", {"url": receiver.url, "events": ["job.expired"]})

        def deliver() -> None:
            receiver.arrived.clear()
            client.post(f"/v1/webhooks/{webhook}/test").raise_for_status()
            assert receiver.arrived.wait(300)

        works: dict[str, Callable[[], object]] = {
            "health": lambda: client.get("/health/live").raise_for_status(),
            "poll": lambda: client.get(f"/v1/jobs/{job}").raise_for_status(),
            "submit": lambda: client.post("/v1/jobs", json=body).raise_for_status(),
            "delivery": deliver,
        }
        times: Times = {name: [] for name in works}
        threads = [
            threading.Thread(target=_repeat, args=(work, times[name], until_s))
            for name, work in works.items()
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        client.delete(f"/v1/webhooks/{webhook}").raise_for_status()
    return times


def _repeat(work: Callable[[], object], times: list[float], until_s: float) -> None:
    while time.monotonic() < until_s:
        began_s = time.perf_counter()
        work()
        times.append(time.perf_counter() - began_s)
        time.sleep(PAUSE_S)


def p99(times: list[float]) -> float:
    """Return the 99th percentile."""
    return statistics.quantiles(times, n=100, method="inclusive")[98]


def main() -> None:
    """Print a line for each attack and kind of call."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--database-url")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each attack")
    parser.add_argument("--attack", action="append", choices=list(ATTACKS), help="only these")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        database_url = options.database_url or f"sqlite:///{folder}/attack.db"
        with served(database_url) as (url, process, keys):
            with httpx.Client(base_url=url, headers=keys["attacker"], timeout=300) as client:
                aims = aims_of(client)
            print("| attack | call | times | median | p99 | longest | p99 to calm | API holds |")
            print("|---|---|---|---|---|---|---|---|")
            calm: dict[str, float] = {}
            for name in (CALM, *(options.attack or ATTACKS)):
                is_calm = name == CALM
                with nullcontext() if is_calm else attacking(name, url, keys["attacker"], aims):
                    time.sleep(0.0 if is_calm else BEGINNING_S)
                    times = measure(url, keys["victim"], aims, options.seconds)
                    held_mb = process.memory_info().rss / 1e6
                if is_calm:
                    calm = {call: p99(taken) for call, taken in times.items()}
                for call, taken in times.items():
                    print(
                        f"| {name} | {call} | {len(taken)} | {statistics.median(taken):.3f} s "
                        f"| {p99(taken):.3f} s | {max(taken):.3f} s "
                        f"| {p99(taken) / calm[call]:.1f} | {held_mb:.0f} MB |",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
