"""``slewline demo``: the real service plans a real-size mission with each solver over HTTP."""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from service.client import Client, ClientError, Scenario
from service.commands import demo_mission
from service.commands.outcome import FAILED, OK, Failed
from service.commands.serving import settings_of
from service.commands.summary import HEADER, LEGEND, summary_row, table
from service.jobs import compiled
from service.wire.base import Json, dumped
from service.wire.instants import instant_text

SEARCH_TIME_S: Final = 10.0
_READY: Final = "Slewline is ready at "
_LAST_LINES: Final = 20  # of the log, if the service did not start


def demo(options: argparse.Namespace) -> int:
    """Start the service, plan the mission with each solver, print and write the results.

    Returns 0 if every plan is valid, else 1. With ``--serve`` it goes on serving until SIGINT or
    SIGTERM, on the port of the settings; otherwise it uses a free port.
    """
    settings, folder = settings_of(options), options.out
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    _compile()
    folder.mkdir(parents=True, exist_ok=True)
    port = settings.port if options.serve else 0
    with _service(port, settings.workers, folder / "service.log") as url:
        print(f"The service runs at {url} with {settings.workers} workers.", flush=True)
        try:
            with Client(url, key="") as client:
                status = _plan_mission(client, folder)
        except ClientError as error:
            raise Failed(str(error)) from error
        if options.serve:
            print(f"\nStill serving at {url} (the dashboard; calls: {url}/docs).", flush=True)
            print("Press Ctrl-C to stop.", flush=True)
            with suppress(KeyboardInterrupt):
                while True:
                    time.sleep(3600.0)
    return status


def _compile() -> None:
    """Compile the kernels that the demonstration needs, importing them only if necessary."""
    if compiled.is_ready("all") or compiled.is_ready("demonstration"):
        return
    from service.jobs import warm

    warm.make_ready(warm.DEMONSTRATION)


def _plan_mission(client: Client, folder: Path) -> int:
    scenario = create_mission(client)
    _write(folder / "scenario.json", client.scenarios.file(scenario.id))
    counts = scenario.counts
    print(
        f"Mission: {counts.satellites} satellite, {counts.targets} targets, "
        f"{counts.ground_stations} stations, one day from {instant_text(scenario.horizon.start)}, "
        "battery and recorder on.\n",
        flush=True,
    )
    solvers = [solver.name for solver in client.solvers()]
    # The last solvers take longest, so they are queued first: two workers end about together.
    jobs = {
        solver: client.jobs.submit(scenario, solver, time_s=SEARCH_TIME_S)
        for solver in reversed(solvers)
    }
    rows: list[tuple[str, ...]] = [HEADER]
    are_valid = True
    for solver in solvers:
        timeline = dumped(jobs[solver].wait().timeline())
        _write(folder / f"timeline-{solver}.json", timeline)
        rows.append(summary_row(timeline))
        are_valid = are_valid and timeline["validity"] == "valid"
    print(table(rows))
    print(LEGEND)
    print(f"\nTimelines and the scenario file are in {folder.resolve()}", flush=True)
    return OK if are_valid else FAILED


def create_mission(client: Client) -> Scenario:
    """Store the mission's satellite, stations, targets and scenario; return the scenario."""
    satellite = client.satellites.create(**demo_mission.SATELLITE)
    stations = [client.ground_stations.create(**each) for each in demo_mission.GROUND_STATIONS]
    catalog = client.target_catalogs.create(
        "Landsat land scenes", demo_mission.targets_csv(), "csv"
    )
    return client.scenarios.create(
        name="Day of a polar satellite",
        **demo_mission.HORIZON,
        satellite_ids=[satellite.id],
        target_catalog_ids=[catalog.id],
        ground_station_ids=[station.id for station in stations],
        use_resources=True,
    )


@contextmanager
def _service(port: int, workers: int, log: Path) -> Iterator[str]:
    """Run ``slewline serve`` on a temporary database; yield its URL."""
    with tempfile.TemporaryDirectory(prefix="slewline-") as place, log.open("wb") as log_file:
        address = ["--host", "127.0.0.1", "--port", str(port)]
        rest = [
            "--workers",
            str(max(workers, 1)),
            "--database-url",
            f"sqlite:///{place}/slewline.db",
        ]
        process = subprocess.Popen(  # noqa: S603 - our own command
            [sys.executable, "-m", "service", "serve", *address, *rest],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=log_file,
            text=True,
            env=os.environ | {"SLEWLINE_REQUIRE_KEYS": "false"},
            start_new_session=True,  # so that Ctrl-C reaches only this process, which ends it
        )
        try:
            yield _url_when_ready(process, log)
        finally:
            process.terminate()
            process.wait()


def _url_when_ready(process: subprocess.Popen[str], log: Path) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(_READY):
            return line.removeprefix(_READY).split()[0]
    said = log.read_text(encoding="utf-8", errors="replace").splitlines()[-_LAST_LINES:]
    status = f"It ended with status {process.wait()}; see {log}, which ends:"
    raise Failed("\n".join(["The service did not start.", status, *said]))


def _write(path: Path, document: Json) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
