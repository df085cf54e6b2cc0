"""Plans flown in Basilisk, which is independent of the planner: see docs/flight.md."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from service.commands import demo_mission
from service.scenarios.canonical import canonical

_PYTHON = os.environ.get("SLEWLINE_TEST_FLIGHT_PYTHON")
pytestmark = pytest.mark.skipif(
    not _PYTHON, reason="SLEWLINE_TEST_FLIGHT_PYTHON names no interpreter with Basilisk"
)

_REQUIRED = "0.995"
_END = "2019-01-01T02:00:00Z"  # with two contacts


def _scenario(**changes: Any) -> dict[str, Any]:
    """Return the first hours of the demonstration's mission as a scenario file."""
    rows = csv.DictReader(io.StringIO(demo_mission.targets_csv()))
    targets = [
        {"id": row["id"], "lat_deg": float(row["lat_deg"]), "lon_deg": float(row["lon_deg"])}
        for row in rows
    ]
    content = {
        "name": "flown",
        "horizon": {**demo_mission.HORIZON, "end": _END},
        "satellites": [{"id": "polar", **demo_mission.SATELLITE}],
        "ground_stations": [
            {"id": station["name"].lower(), **station} for station in demo_mission.GROUND_STATIONS
        ],
        "targets": targets,
        "use_resources": True,
        "release": 2,
        **changes,
    }
    # As the service would return it: with the complete spacecraft.
    expanded: dict[str, Any] = json.loads(canonical(content))
    return expanded


def _flown(folder: Path, scenario: dict[str, Any], solver: str) -> subprocess.CompletedProcess[str]:
    """Plan a mission and fly it."""
    file, timeline = folder / "scenario.json", folder / "timeline.json"
    file.write_text(json.dumps(scenario), encoding="utf-8")
    planned = subprocess.run(
        [sys.executable, "-m", "service", "solve", str(file), "--solver", solver,
         "--time-s", "20", "--out", str(timeline)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert planned.returncode == 0, planned.stderr
    assert _PYTHON is not None
    return subprocess.run(
        [_PYTHON, "-m", "benchmarks.flight", str(file), str(timeline), "--require", _REQUIRED],
        capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("solver", ["rule", "certified"])
def test_the_demonstration_is_flown_as_planned(tmp_path: Path, solver: str) -> None:
    done = _flown(tmp_path, _scenario(), solver)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "100.00% of" in done.stdout
    assert "contacts on station" in done.stdout


def test_a_dense_plan_is_flown_as_planned(tmp_path: Path) -> None:
    scenario = _scenario(use_resources=False, collect_spacing_s=15.0)
    done = _flown(tmp_path, scenario, "certified")
    assert done.returncode == 0, done.stdout + done.stderr


def test_turns_counted_from_rest_to_rest_are_not_flyable(tmp_path: Path) -> None:
    weak = {"slew_rate_deg_s": 1.0, "acceleration_deg_s2": 0.05, "settle_s": 0.0,
            "slew_model": "rest"}  # fmt: skip
    satellite = {**demo_mission.SATELLITE, "id": "polar", "agility": weak}
    scenario = _scenario(use_resources=False, collect_spacing_s=15.0, satellites=[satellite])
    done = _flown(tmp_path, scenario, "certified")
    assert done.returncode == 1
    assert "Not flyable" in done.stderr
