"""The walk-throughs of the API, in the README and on a page of their own, run as printed."""

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
from tests.service.serving import serving, serving_as_installed

ROOT = Path(__file__).resolve().parents[2]
OWN_FILES = {
    "satellites.tle": ["EYE", *tle(90100)],
    "targets.csv": ["id,lat_deg,lon_deg", "bern,46.948,7.447", "quito,-0.22,-78.51"],
    "stations.csv": ["name,lat_deg,lon_deg", "Svalbard,78.23,15.39"],
}


MARK = "<- all of one block"
_OWN_ID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}|[0-9a-f]{64}")
_NUMBER = re.compile(r"-?\d+\.\d+(e-?\d+)?(?![\d.]*[:Z])")
_TIMES = {"search", "total"}


def _blocks(page: str) -> list[tuple[str, str]]:
    """Return the commands of a page block by block, each with the output printed below it."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.findall(r"```sh\n(.*?)```(?:\s*```(?:json|text)\n(.*?)```)?", text, re.S)
    return [(commands, shown) for commands, shown in found if "make demo" not in commands]


def _walk(page: str, url: str) -> str:
    """Return the shell commands of a page, for a service at ``url``."""
    commands = "\n".join(f"{block}\necho '{MARK}'" for block, _ in _blocks(page))
    return commands.replace("http://127.0.0.1:8000", url).replace(
        ".venv/bin/slewline", f"{sys.executable} -m service"
    )


def _lasting(output: str) -> list[str]:
    """Return the lines of an output without what varies between runs: ids, hashes, seconds."""
    lines, timed = [], frozenset[int]()
    for line in _OWN_ID.sub("id", output).strip().splitlines():
        cells = re.split(r"\s{2,}", line.strip())
        if set(cells) >= _TIMES:
            timed = frozenset(i for i, cell in enumerate(cells) if cell in _TIMES)
            width = len(cells)
        kept = [
            c for i, c in enumerate(cells) if not (timed and len(cells) == width and i in timed)
        ]
        # The last digits depend on the machine.
        lines.append("  ".join(_NUMBER.sub(lambda n: f"{float(n[0]):.4g}", cell) for cell in kept))
    return lines


needs_tools = pytest.mark.skipif(
    any(shutil.which(tool) is None for tool in ("bash", "curl", "awk", "python3")),
    reason="the walk needs bash, curl, awk and python3",
)


def _output(page: str, tmp_path: Path) -> str:
    """Return the output of a page's commands on a fresh service; none of them may fail."""
    (tmp_path / "service").symlink_to(ROOT / "service")
    for name, lines in OWN_FILES.items():
        (tmp_path / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    # The README's walk-through begins as a user would.
    begin = serving_as_installed if page == "README.md" else serving
    with begin(tmp_path, "serve", "--workers", "1") as (_, line):
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


def _without_marks(output: str) -> str:
    return output.replace(f"{MARK}\n", "")


@needs_tools
def test_every_command_of_the_walk_works(tmp_path: Path) -> None:
    printed = _output("README.md", tmp_path)
    assert ",EYE,collect,2026-03-01T" in printed
    shown = [(_lasting(told), _lasting(own)) for told, own in _told_and_shown("README.md", printed)]
    assert len(shown) == 5
    for told, own in shown:
        assert told == own


def _told_and_shown(page: str, printed: str) -> list[tuple[str, str]]:
    """Return the output of each block, with the page's output for it."""
    told = printed.split(f"{MARK}\n")
    pairs = zip(told, (shown for _, shown in _blocks(page)), strict=False)
    return [(one, shown) for one, shown in pairs if shown]


@needs_tools
def test_the_day_of_operations_goes_as_its_page_says(tmp_path: Path) -> None:
    page = "docs/operations-day.md"
    shown = [
        (_lasting(told), _lasting(own))
        for told, own in _told_and_shown(page, _output(page, tmp_path))
    ]
    assert len(shown) == 4
    for told, own in shown:
        assert told == own


def test_only_what_differs_from_run_to_run_may_differ_from_the_page() -> None:
    table = "solver  reward  search  total  validity\nrule      76.2   {}  valid\nplan {}\n"
    same = [table.format("3.347  21.81", 64 * "a"), table.format("9.9    10.2", 64 * "b")]
    assert _lasting(same[0]) == _lasting(same[1])
    assert _lasting(same[0]) != _lasting(same[0].replace("76.2", "169.9"))
    start = '{"start": "2019-01-01T00:21:23.888Z", "gap": 0.14893617021276595}'
    assert _lasting(start) == _lasting(start.replace("76595", "76601"))
    assert _lasting(start) != _lasting(start.replace("23.888", "23.889"))
    assert _lasting(start) != _lasting(start.replace("0.148", "0.149"))


@needs_tools
def test_every_command_of_the_page_on_the_api_works(tmp_path: Path) -> None:
    lines = [line.strip() for line in _without_marks(_output("docs/api.md", tmp_path)).splitlines()]
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
    lines = [
        line.strip() for line in _without_marks(_output("docs/exports.md", tmp_path)).splitlines()
    ]
    assert [line.split()[0] for line in (lines[1], lines[4], lines[7])] == [
        "valid",
        "valid",
        "violations",
    ]
    assert lines[2] == lines[5]
    assert lines[9].startswith("line 3: window: Polar-500")
    assert lines[10] == "status 1"
    assert "MEAN_MOTION = 15.24162312" in lines
