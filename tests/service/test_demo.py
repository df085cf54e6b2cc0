"""``slewline demo --serve`` as a process: every solver's plan, files, and a clean end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import psutil
import pytest

from planner_core.solvers.registry import SOLVERS
from tests.patience import PATIENCE_S

pytestmark = pytest.mark.full_size


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Run the demonstration on a free port, its temporary files inside ``tmp_path``."""
    with subprocess.Popen(
        [sys.executable, "-m", "service", "demo", "--serve", "--out", str(tmp_path / "out")],
        env=os.environ | {"SLEWLINE_PORT": "0", "TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        yield process
        if process.poll() is None:
            for left in psutil.Process(process.pid).children(recursive=True):
                left.kill()
            process.kill()


def _printed_until(process: subprocess.Popen[str], start: str) -> list[str]:
    assert process.stdout is not None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line)
        if line.startswith(start):
            break
    return lines


def test_demo_plans_the_mission_with_every_solver_keeps_serving_and_ends_cleanly(
    demo: subprocess.Popen[str], tmp_path: Path
) -> None:
    lines = _printed_until(demo, "Still serving at ")
    assert {line.split()[0] for line in lines if line.endswith("valid\n")} == set(SOLVERS)

    scenario = json.loads((tmp_path / "out" / "scenario.json").read_text(encoding="utf-8"))
    assert len(scenario["targets"]) == 1000
    for solver in SOLVERS:
        text = (tmp_path / "out" / f"timeline-{solver}.json").read_text(encoding="utf-8")
        totals = json.loads(text)["totals"]
        assert totals["reward"] > 150
        assert totals["contacts"] > 0

    url = lines[-1].split()[3]
    jobs = httpx.get(f"{url}/v1/jobs").json()["items"]
    assert [job["state"] for job in jobs] == ["succeeded"] * len(SOLVERS)

    started = psutil.Process(demo.pid).children(recursive=True)
    demo.terminate()
    assert demo.wait(PATIENCE_S) == 0
    assert psutil.wait_procs(started, timeout=PATIENCE_S)[1] == []
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
