"""A process that ``prepared`` starts is like any other."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import psutil
import pytest

import planner_core
from tests.patience import PATIENCE_S
from tests.service import prepared
from tests.service.prepared import Prepared
from tests.service.serving import serving

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing is forked")


@pytest.fixture(autouse=True)
def _environment_of_the_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remove variables that other tests left in this process: with them it would fork nothing."""
    _, environment = prepared._server()
    for name in os.environ.keys() - environment.keys():
        monkeypatch.delenv(name)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)


def test_it_has_streams_and_a_status_of_its_own(tmp_path: Path) -> None:
    process = prepared.start(["service", "--version"], os.environ)
    assert isinstance(process, Prepared)
    assert process.stdout is not None
    with process.stdout as output:
        assert output.read() == f"{planner_core.__version__}\n"
    assert process.wait() == process.poll() == process.returncode == 0
    with (tmp_path / "said").open("wb") as said:
        refused = prepared.start(
            ["service", "fly"], os.environ, stdout=said.fileno(), stderr=said.fileno()
        )
    assert refused.wait() == 2
    assert "invalid choice: 'fly'" in (tmp_path / "said").read_text()


def test_it_is_waited_for_and_killed(tmp_path: Path) -> None:
    words = ["service", "api", "--port", "0", "--database-url", f"sqlite:///{tmp_path / 'own.db'}"]
    with (tmp_path / "log").open("wb") as log:
        process = prepared.start(words, os.environ, stderr=log.fileno())
    assert process.stdout is not None
    with process.stdout as output:
        assert output.readline().startswith("Slewline is ready at ")
        assert process.poll() is None
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.0)
        (fork_server,) = psutil.Process(process.pid).children()
        process.kill()
        assert process.wait() == -signal.SIGKILL
        process.terminate()  # nobody is left to be told
        psutil.wait_procs([fork_server])


def test_its_workers_and_what_jobs_are_forked_from_are_forks_too(tmp_path: Path) -> None:
    with serving(tmp_path, "serve", "--workers", "2") as (process, line):
        assert line.startswith("Slewline is ready at ")
        children = psutil.Process(process.pid).children()
        workers = [child for child in children if child.name() != "slewline-fork"]
        assert len(workers) == 2
        for worker in workers:
            fork_servers = [each for each in worker.children() if "-c" not in each.cmdline()]
            assert len(fork_servers) == 1  # apart from the resource tracker
            for each in (worker, *fork_servers):
                assert prepared.__name__ in each.cmdline()
        started = psutil.Process(process.pid).children(recursive=True)
        process.terminate()
        assert process.stdout is not None
        assert (process.stdout.read(), process.wait()) == ("", 0)
        assert psutil.wait_procs(started, timeout=PATIENCE_S)[1] == []


def test_words_that_make_no_sense_are_for_the_program_alone(tmp_path: Path) -> None:
    for options in (["--workers", "many"], ["--workers"]):
        with (tmp_path / "said").open("wb") as said:
            words = ["service", "serve", *options]
            refused = prepared.start(words, os.environ, stdout=said.fileno(), stderr=said.fileno())
        assert isinstance(refused, Prepared)
        assert refused.wait() == 2
        assert "--workers" in (tmp_path / "said").read_text()


def test_what_it_has_in_reserve_ends_with_it() -> None:
    process = prepared.start(["service.jobs", "--help"], os.environ)
    assert process.stdout is not None
    with process.stdout as output:
        assert "--supervisor" in output.read()  # and no other process has its other end
    assert process.wait() == 0


def test_all_who_wait_for_it_are_told() -> None:
    process = prepared.start(["service", "--version"], os.environ)
    assert process.stdout is not None
    with process.stdout, ThreadPoolExecutor(4) as pool:
        assert [each.result() for each in [pool.submit(process.wait) for _ in range(4)]] == [0] * 4


def test_it_outlives_the_thread_that_began_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(prepared._NAME, raising=False)
    monkeypatch.setattr(prepared, "_server", cache(prepared._server.__wrapped__))

    def status() -> int:
        process = prepared.start(["service", "--version"], os.environ, stdout=1)
        assert isinstance(process, Prepared)
        return process.wait()

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(status).result() == 0
    assert status() == 0


def test_settings_of_libraries_want_a_start_from_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    own = prepared.start(["service", "--version"], os.environ | {"SLEWLINE_PORT": "0"}, stdout=1)
    assert isinstance(own, Prepared)
    assert own.wait() == 0
    monkeypatch.setenv("OTEL_SERVICE_NAME", "other")
    process = prepared.start(["service", "--version"], os.environ)
    assert not isinstance(process, Prepared)
    output, _ = process.communicate()
    assert output == f"{planner_core.__version__}\n"
