"""``slewline demo``: the real service, a real-size mission through its HTTP API, every solver."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final

import httpx

from service.commands import demo_mission
from service.commands.summary import HEADER, LEGEND, summary_row, table
from service.jobs import compiled
from service.settings import Settings

Json = dict[str, Any]

SEARCH_TIME_S: Final = 10.0
_ACTIVE: Final = ("queued", "running", "cancelling")
_HOLD_S: Final = 10
_READY: Final = "Slewline is ready at "
_LAST_LINES: Final = 20  # of the log, where the service did not start


class DemoFailed(Exception):
    """The service did not start, refused something, or a job failed."""


def run_demo(settings: Settings, *, folder: Path, keep_serving: bool = False) -> int:
    """Start the service, plan the mission with each solver, print and write what came out.

    Parameters
    ----------
    settings
        Number of workers, and the port where ``keep_serving`` (else a free one is taken).
    folder
        Where the scenario file, the timelines and the service's log are written.
    keep_serving
        Whether to go on serving until SIGINT or SIGTERM.

    Returns
    -------
    The exit status: 0 where every plan is valid, else 1.

    Raises
    ------
    DemoFailed
        Where there are no plans to judge.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    _compile()
    folder.mkdir(parents=True, exist_ok=True)
    port = settings.port if keep_serving else 0
    with _service(port, settings.workers, folder / "service.log") as url:
        print(f"The service runs at {url} with {settings.workers} workers.", flush=True)
        with httpx.Client(base_url=url, trust_env=False, timeout=60.0) as client:
            status = _plan_mission(client, folder)
        if keep_serving:
            print(f"\nStill serving at {url} (the dashboard; calls: {url}/docs).", flush=True)
            print("Ctrl-C ends it.", flush=True)
            _wait_for_interrupt()
    return status


def _compile() -> None:
    """Compile the kernels that the demonstration needs; import them for that alone."""
    if compiled.is_ready("all") or compiled.is_ready("demonstration"):
        return
    from service.jobs import warm

    warm.make_ready(warm.DEMONSTRATION)


def _plan_mission(client: httpx.Client, folder: Path) -> int:
    scenario = create_mission(client)
    _write(folder / "scenario.json", _get(client, f"/v1/scenarios/{scenario['id']}?expand=true"))
    counts = scenario["counts"]
    print(
        f"Mission: {counts['satellites']} satellite, {counts['targets']} targets, "
        f"{counts['ground_stations']} stations, one day from {scenario['horizon']['start']}, "
        "battery and recorder on.\n",
        flush=True,
    )
    solvers = [solver["name"] for solver in _get(client, "/v1/solvers")["items"]]
    # The last take longest, so they begin first: two workers end at about the same time.
    jobs = {solver: submit(client, scenario["id"], solver) for solver in reversed(solvers)}
    rows: list[tuple[str, ...]] = [HEADER]
    are_valid = True
    for solver in solvers:
        timeline = answer(client, jobs[solver]["id"])
        _write(folder / f"timeline-{solver}.json", timeline)
        rows.append(summary_row(timeline))
        are_valid = are_valid and timeline["validity"] == "valid"
    print(table(rows))
    print(LEGEND)
    print(f"\nTimelines and the scenario file are in {folder.resolve()}", flush=True)
    return 0 if are_valid else 1


def create_mission(client: httpx.Client) -> Json:
    """Post the mission's satellite, stations, targets and scenario; return the scenario."""
    satellite = _post(client, "/v1/satellites", json=demo_mission.SATELLITE)
    stations = [
        _post(client, "/v1/ground-stations", json=station)
        for station in demo_mission.GROUND_STATIONS
    ]
    catalog = _post(
        client,
        "/v1/target-catalogs?name=Landsat+land+scenes",
        content=demo_mission.targets_csv(),
        headers={"Content-Type": "text/csv"},
    )
    body = {
        "name": "Day of a polar satellite",
        "horizon": demo_mission.HORIZON,
        "satellite_ids": [satellite["id"]],
        "target_catalog_ids": [catalog["id"]],
        "ground_station_ids": [station["id"] for station in stations],
        "use_resources": True,
    }
    return _post(client, "/v1/scenarios", json=body)


def submit(client: httpx.Client, scenario_id: str, solver: str) -> Json:
    """Post a job with the solver's default parameters; return the job."""
    limits = {"time_s": SEARCH_TIME_S}
    return _post(
        client, "/v1/jobs", json={"scenario_id": scenario_id, "solver": solver, "limits": limits}
    )


def answer(client: httpx.Client, job_id: str) -> Json:
    """Wait for a job's end and return its timeline.

    Raises
    ------
    DemoFailed
        Where the job ends in any other way than ``succeeded``.
    """
    job = _get(client, f"/v1/jobs/{job_id}")
    while job["state"] in _ACTIVE:
        job = _get(client, f"/v1/jobs/{job_id}?wait={_HOLD_S}")
    if job["state"] != "succeeded":
        raise DemoFailed(f"The job with {job['solver']} {job['state']}: {job['error']}")
    return _get(client, job["links"]["timeline"])


@contextmanager
def _service(port: int, workers: int, log: Path) -> Iterator[str]:
    """Run ``slewline serve`` on a temporary database; yield its URL."""
    with tempfile.TemporaryDirectory(prefix="slewline-") as place, log.open("wb") as log_file:
        process = _start(port, workers, f"sqlite:///{place}/slewline.db", log_file)
        try:
            yield _url_when_ready(process, log)
        finally:
            process.terminate()
            process.wait()


def _start(port: int, workers: int, database_url: str, log: IO[bytes]) -> subprocess.Popen[str]:
    options = ["--host", "127.0.0.1", "--port", str(port), "--workers", str(max(workers, 1))]
    return subprocess.Popen(  # noqa: S603 - our own command
        [sys.executable, "-m", "service", "serve", *options, "--database-url", database_url],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        env=os.environ | {"SLEWLINE_REQUIRE_KEYS": "false"},
        start_new_session=True,  # so that Ctrl-C reaches only this process, which ends the other
    )


def _url_when_ready(process: subprocess.Popen[str], log: Path) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(_READY):
            return line.removeprefix(_READY).split()[0]
    said = log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LAST_LINES:]
    status = f"It ended with status {process.wait()}; see {log}, which ends:"
    raise DemoFailed("\n".join(["The service did not start.", status, *said]))


def _wait_for_interrupt() -> None:
    try:
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        pass


def _post(client: httpx.Client, path: str, **body: Any) -> Json:
    return _body(client.post(path, **body))


def _get(client: httpx.Client, path: str) -> Json:
    return _body(client.get(path))


def _body(response: httpx.Response) -> Json:
    if response.is_success:
        body: Json = response.json()
        return body
    request = response.request
    raise DemoFailed(f"{request.method} {request.url}: {response.status_code} {response.text}")


def _write(path: Path, document: Json) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
