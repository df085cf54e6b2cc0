"""``slewline solve``: a scenario file in, a judged timeline out, no service."""

from __future__ import annotations

import csv
import io
import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.commands import demo_mission
from service.commands.cli import main
from service.commands.outcome import OK, WRONG_INPUT
from service.scenarios.canonical import canonical, sha256_of


@pytest.fixture(autouse=True)
def handlers_are_restored() -> Iterator[None]:
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)


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


def _write(tmp_path: Path, content: object) -> str:
    path = tmp_path / "day.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("solver", ["rule", "forward_search"])
def test_solve_writes_a_valid_timeline_of_exactly_this_file(
    tmp_path: Path, content: dict[str, Any], solver: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "timeline.json"
    status = main(["solve", _write(tmp_path, content), "--solver", solver, "--out", str(out)])
    timeline = json.loads(out.read_text(encoding="utf-8"))
    assert status == OK
    assert timeline["validity"] == "valid"
    assert timeline["totals"]["reward"] > 0
    assert timeline["scenario_sha256"] == sha256_of(canonical(content))
    assert timeline["plan_sha256"] in capsys.readouterr().out


def test_parameters_reach_the_solver(tmp_path: Path, content: dict[str, Any]) -> None:
    out = tmp_path / "timeline.json"
    main([
        "solve", _write(tmp_path, content), "--solver", "forward_search",
        "--param", "depth=1", "--param", "breadth=2", "--seed", "7", "--out", str(out),
    ])  # fmt: skip
    solver = json.loads(out.read_text(encoding="utf-8"))["solver"]
    assert (solver["params"]["depth"], solver["params"]["breadth"], solver["seed"]) == (1, 2, 7)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--solver", "oracle"], "--solver"),
        (["--solver", "rule", "--param", "wings=2"], "--param wings"),
        (["--solver", "forward_search", "--param", "depth=-1"], "--param depth"),
        (["--solver", "rule", "--out", "/nowhere/timeline.json"], "/nowhere"),
    ],
)
def test_a_wrong_option_is_named(
    tmp_path: Path,
    content: dict[str, Any],
    options: list[str],
    named: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["solve", _write(tmp_path, content), *options]) == WRONG_INPUT
    assert named in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"horizon": {"start": "2019-01-01T00:00:00", "end": "x"}}, "/horizon/start"),
        ({"targets": [{"id": "a", "lat_deg": 91.0, "lon_deg": 0.0}]}, "/targets/0/lat_deg"),
        ({"satelites": []}, "/satelites"),
    ],
)
def test_a_wrong_field_of_the_file_is_named(
    tmp_path: Path,
    content: dict[str, Any],
    change: dict[str, Any],
    named: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = _write(tmp_path, content | change)
    assert main(["solve", path, "--solver", "rule"]) == WRONG_INPUT
    assert f"{path} {named}" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["{", "[]", "\xff"])
def test_a_file_that_holds_no_json_object_is_refused(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "day.json"
    path.write_bytes(text.encode("latin-1"))
    assert main(["solve", str(path), "--solver", "rule"]) == WRONG_INPUT
    assert str(path) in capsys.readouterr().err


def test_a_missing_file_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "no-such-file.json", "--solver", "rule"]) == WRONG_INPUT
    assert "no-such-file.json" in capsys.readouterr().err


def test_time_that_ends_before_the_search_leaves_its_first_plan(
    tmp_path: Path, content: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    path = _write(tmp_path, content)
    assert main(["solve", path, "--solver", "forward_search", "--time-s", "1e-9"]) == OK
    assert "ended: time_limit" in capsys.readouterr().out


def test_a_search_that_would_take_ages_ends_at_its_time_with_a_plan(
    tmp_path: Path, content: dict[str, Any]
) -> None:
    out = tmp_path / "timeline.json"
    status = main([
        "solve", _write(tmp_path, content), "--solver", "forward_search",
        "--param", "depth=12", "--param", "breadth=12", "--time-s", "1.5", "--out", str(out),
    ])  # fmt: skip
    assert status == OK
    assert json.loads(out.read_text(encoding="utf-8"))["termination"] == "time_limit"
