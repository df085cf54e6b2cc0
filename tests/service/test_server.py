"""``slewline serve`` as a process: ready means ready, and a signal ends all of it."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from pathlib import Path

import httpx
import psutil
import pytest

from service.server import listen
from tests.patience import PATIENCE_S, wait_until
from tests.plain_http import NO_TLS
from tests.service.serving import serving_as_installed


# Both signals request the same: `.ci/run` sends the second one too.
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.full_size)]
)
def test_serve_says_once_when_it_is_ready_and_ends_cleanly(
    tmp_path: Path, number: signal.Signals
) -> None:
    with serving_as_installed(tmp_path, "serve", "--workers", "1") as (process, line):
        url = line.split()[-1]
        assert line.startswith("Slewline is ready at http://127.0.0.1:")
        assert httpx.get(f"{url}/health/ready").json()["workers"] == 1
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(number)
        rest, _ = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, rest) == (0, "")
        assert len(children) >= 1
        _, alive = psutil.wait_procs(children, timeout=PATIENCE_S)
        assert alive == []
    # It waits for its workers by calling itself: that is not worth a line each time.
    waits = [line for line in (tmp_path / "serve.log").read_text().splitlines() if "/ready" in line]
    assert [json.loads(line)["status"] for line in waits] == [200, 200]


def test_the_body_of_an_answer_does_not_wait_for_the_acknowledgement_of_its_head() -> None:
    with listen("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        connection, _ = listener.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) == 1


def test_api_alone_runs_no_worker_and_ends_without_its_fork_server(tmp_path: Path) -> None:
    with serving_as_installed(tmp_path, "api") as (process, line):
        url = line.split()[-1]
        assert httpx.get(f"{url}/health/live").status_code == 200
        assert httpx.get(f"{url}/health/ready").status_code == 503
        (fork_server,) = psutil.Process(process.pid).children()
        (heavy,) = fork_server.children()
        assert (fork_server.name(), heavy.name()) == ("slewline-fork", "slewline-heavy")
        # Nothing would start a new heavy process: the service's supervisor must restart everything.
        fork_server.kill()
        assert process.wait(PATIENCE_S) == 1
        _, alive = psutil.wait_procs([heavy], timeout=PATIENCE_S)
        assert alive == []


def test_a_worker_process_serves_the_jobs_of_an_api_process(tmp_path: Path) -> None:
    with serving_as_installed(tmp_path, "api") as (_, line):
        url = line.split()[-1]
        database = f"sqlite:///{tmp_path / 'slewline.db'}"
        worker = subprocess.Popen(
            [sys.executable, "-m", "service", "worker", "--database-url", database],
            stderr=subprocess.DEVNULL,
        )
        try:
            ready = f"{url}/health/ready"
            wait_until(lambda: httpx.get(ready, verify=NO_TLS).status_code == 200)
            worker.terminate()
            assert worker.wait(PATIENCE_S) == 0
        finally:
            worker.kill()
            worker.wait()
