"""The walks through the API, in the README and its own page, run as they are printed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S
from tests.service.factories import tle
from tests.service.serving import serving

ROOT = Path(__file__).resolve().parents[2]
OWN_FILES = {
    "satellites.tle": ["EYE", *tle(90100)],
    "targets.csv": ["id,lat_deg,lon_deg", "bern,46.948,7.447", "quito,-0.22,-78.51"],
    "stations.csv": ["name,lat_deg,lon_deg", "Svalbard,78.23,15.39"],
}


def _walk(page: str, url: str) -> str:
    """Return the shell commands of a page, for a service at ``url``."""
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.S)
    commands = "\n".join(block for block in blocks if "make demo" not in block)
    return commands.replace("http://127.0.0.1:8000", url).replace(
        ".venv/bin/slewline", f"{sys.executable} -m service"
    )


needs_tools = pytest.mark.skipif(
    any(shutil.which(tool) is None for tool in ("bash", "curl", "awk", "python3")),
    reason="the walk needs bash, curl, awk and python3",
)


def _output(page: str, tmp_path: Path) -> str:
    """Return what the commands of a page print on a fresh service; none of them may fail."""
    (tmp_path / "service").symlink_to(ROOT / "service")
    for name, lines in OWN_FILES.items():
        (tmp_path / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    with serving(tmp_path, "serve", "--workers", "1") as (_, line):
        ran = subprocess.run(
            ["bash", "-eu", "-c", _walk(page, line.split()[-1])],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@needs_tools
def test_every_command_of_the_walk_works(tmp_path: Path) -> None:
    printed = _output("README.md", tmp_path)
    answers = [
        '"kind": "contact"',
        '"bound_proof"',
        '"mode": "collect"',
        '"code": "tle_line_length"',
        ",EYE,collect,2026-03-01T",
    ]
    assert [part for part in answers if part not in printed] == []
    assert re.search(r"^rule .* valid$", printed, re.M)


@needs_tools
def test_every_command_of_the_page_on_the_api_works(tmp_path: Path) -> None:
    lines = [line.strip() for line in _output("docs/api.md", tmp_path).splitlines()]
    assert lines[:4] == ["idempotency-replayed: true", "succeeded", "event: job", "304"]
    first, again = lines[4:6]
    assert len(first) == 64
    assert first == again
    assert lines[6] == "2"
    assert [line.split()[0] for line in lines[7:9]] == ["rule", "forward_search"]
    assert lines[9:11] == ["collected", "quito"]
    assert lines[11] == "412"
    assert 'slewline_jobs{state="succeeded"} 5.0' in lines
    assert lines[-2] == "unknown_solver"


@needs_tools
def test_every_command_of_the_page_on_exports_works(tmp_path: Path) -> None:
    lines = [line.strip() for line in _output("docs/exports.md", tmp_path).splitlines()]
    assert [line.split()[0] for line in (lines[1], lines[4], lines[7])] == [
        "valid",
        "valid",
        "violations",
    ]
    assert lines[2] == lines[5]
    assert lines[9].startswith("line 3: window: Polar-500")
    assert lines[10] == "status 1"
    assert "MEAN_MOTION = 15.24162312" in lines
