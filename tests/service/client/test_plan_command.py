"""``slewline plan``: send a scenario file to a real service and get its plan."""

from __future__ import annotations

import csv
import io
import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from service.client import Client
from service.commands import demo_mission
from service.commands.cli import main
from service.commands.outcome import FAILED, OK, WRONG_INPUT
from service.scenarios.canonical import canonical, sha256_of
from tests.service.client.trouble import Answer, proxy_before

ENDLESS = ["--solver", "mcts", "--param", "num_simulations=100000", "--time-s", "600"]


@pytest.fixture(autouse=True)
def _at_the_service(served: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SLEWLINE_URL", served)


@pytest.fixture
def content() -> dict[str, Any]:
    rows = csv.DictReader(io.StringIO(demo_mission.targets_csv(60)))
    return {
        "horizon": {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T06:00:00Z"},
        "satellites": [demo_mission.SATELLITE],
        "targets": [
            {"id": r["id"], "lat_deg": float(r["lat_deg"]), "lon_deg": float(r["lon_deg"])}
            for r in rows
        ],
        "ground_stations": list(demo_mission.GROUND_STATIONS),
    }


def _write(folder: Path, content: object) -> str:
    path = folder / "day.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return str(path)


def test_a_file_is_planned_as_without_a_service_and_stored_once(
    folder: Path, content: dict[str, Any], whole: Client, capsys: pytest.CaptureFixture[str]
) -> None:
    file = _write(folder, content)
    out, alone = folder / "tl.json", folder / "alone.json"
    before = len(list(whole.scenarios.list()))
    arguments = ["--solver", "forward_search", "--param", "depth=2", "--seed", "7"]
    for _ in range(2):
        status = main(["plan", file, *arguments, "--label", "cli", "--out", str(out)])
        assert status == OK
    printed = capsys.readouterr()
    assert main(["solve", file, *arguments, "--out", str(alone)]) == OK
    timeline, solved = (json.loads(path.read_text(encoding="utf-8")) for path in (out, alone))
    assert timeline["plan_sha256"] == solved["plan_sha256"]
    assert timeline["scenario_sha256"] == sha256_of(canonical(content))
    assert timeline["plan_sha256"] in printed.out
    assert "succeeded" in printed.err
    assert len(list(whole.scenarios.list())) == before + 1
    jobs = list(whole.jobs.list(label="cli"))
    assert [(job.seed, job.params["depth"]) for job in jobs] == [(7, 2), (7, 2)]
    stored = ["--scenario-id", jobs[0].scenario.id]
    assert main(["plan", *stored, "--solver", "rule", "--priority", "9", "--detach"]) == OK
    job = whole.jobs.get(capsys.readouterr().out.split()[-1])
    assert (job.scenario, job.priority) == (jobs[0].scenario, 9)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--solver", "oracle"], "--solver"),
        (["--solver", "rule", "--param", "wings=2"], "--param wings"),
        (["--solver", "rule", "--time-s", "1e9"], "--time-s"),
        (["--solver", "rule", "--priority", "12"], "--priority"),
        (["--solver", "rule", "--label", ""], "--label"),
        (["--solver", "rule", "--seed", "-1"], "--seed"),
        (["--solver", "rule", "--out", "/nowhere/tl.json"], "/nowhere"),
        (["--solver", "rule", "--out", "tl.docx"], "--out"),
        (["--solver", "rule", "--out", "tl.json", "--detach"], "--out"),
        (["--solver", "rule", "--scenario-id", "x"], "--scenario-id"),
        (["--solver", "rule", "--url", "planner.example"], "URL"),
        (["--solver", "rule", "--key-env", "NO_SUCH_KEY"], "NO_SUCH_KEY"),
    ],
)
def test_a_wrong_option_is_named(
    folder: Path,
    content: dict[str, Any],
    options: list[str],
    named: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["plan", _write(folder, content), *options]) == WRONG_INPUT
    assert named in capsys.readouterr().err


def test_the_wrong_fields_of_the_first_wrong_target_are_named(
    folder: Path, content: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    content["targets"][1]["lat_deg"] = 91.0
    content["targets"][1]["reward"] = "much"
    path = _write(folder, content)
    assert main(["plan", path, "--solver", "rule"]) == WRONG_INPUT
    printed = capsys.readouterr().err
    assert f"{path} /targets/1/lat_deg: " in printed
    assert f"{path} /targets/1/reward: " in printed


@pytest.mark.parametrize("text", ["{", "[]", None])
def test_a_file_that_holds_no_scenario_is_refused_without_the_service(
    folder: Path, text: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "day.json"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    nowhere = ["--url", "http://127.0.0.1:1"]
    assert main(["plan", str(path), "--solver", "rule", *nowhere]) == WRONG_INPUT
    assert str(path) in capsys.readouterr().err


def test_a_service_that_refuses_the_caller_is_a_failure(
    folder: Path, content: dict[str, Any], served: str, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setenv("PLANNER_KEY", "slw_sesame")
    with proxy_before(served) as proxy:
        proxy.plan("POST", "/jobs", Answer(401))
        options = ["--solver", "rule", "--url", proxy.url, "--key-env", "PLANNER_KEY"]
        assert main(["plan", _write(folder, content), *options]) == FAILED
        assert proxy.seen[0].headers["authorization"] == "Bearer slw_sesame"
    printed = capsys.readouterr().err
    assert "401" in printed
    assert "sesame" not in printed


def test_an_interrupt_cancels_the_job_and_saves_its_best_plan(
    folder: Path, content: dict[str, Any], whole: Client
) -> None:
    file, out = _write(folder, content), folder / "tl.json"
    terminal, line = pty.openpty()
    command = [sys.executable, "-m", "service", "plan", file, *ENDLESS, "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=line, text=True)
    os.close(line)
    seen = ""
    while "reward" not in seen:
        seen += os.read(terminal, 4096).decode()
    process.send_signal(signal.SIGINT)
    while process.poll() is None:
        seen += _rest(terminal)
    os.close(terminal)
    assert process.stdout is not None
    printed = process.stdout.read()
    process.stdout.close()
    assert process.returncode == OK, seen
    timeline = json.loads(out.read_text(encoding="utf-8"))
    assert timeline["termination"] == "cancelled"
    assert timeline["validity"] == "valid"
    assert "ended: cancelled" in printed
    assert whole.jobs.get(timeline["job"]).state == "cancelled"
    assert "\r" in seen


def _rest(terminal: int) -> str:
    try:
        return os.read(terminal, 4096).decode()
    except OSError:  # the other end is closed
        return ""
