"""``slewline compare-spacing``: a line for each choice of starts."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest

from planner_core.budget import Budget
from service.commands import compare_spacing
from service.commands.cli import main
from service.commands.outcome import OK, WRONG_INPUT
from service.commands.solve import answer_of
from service.jobs.plan_request import PlanAnswer, PlanRequest
from service.scenarios.canonical import canonical
from tests.missions import drawn_targets, paper_mission

A_QUARTER = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T06:00:00Z"}


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    mission = paper_mission(drawn_targets(150), use_resources=False, horizon=A_QUARTER)
    path = tmp_path / "scenario.json"
    # The file's own spacing does not matter.
    path.write_text(json.dumps(mission | {"collect_spacing_s": 7.0}))
    return path


def test_more_starts_never_earn_less(
    scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "table.csv"
    asked = ["compare-spacing", str(scenario), "--spacing-s", "40", "--spacing-s", "20"]
    assert main([*asked, "--out", str(table)]) == OK
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["starts"] for row in rows] == [
        "one, centred",
        "every 40 s",
        "every 20 s",
        "anywhere",
    ]
    assert {row["validity"] for row in rows} == {"valid"}
    rewards = [float(row["reward"]) for row in rows]
    assert rewards[0] < rewards[2]
    assert rewards[1] <= rewards[2]
    assert rewards[0] <= rewards[3]
    assert rows[2]["gain"] == f"{rewards[2] / rewards[0] - 1.0:+.1%}"
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 5
    assert printed[3].startswith("every 20 s")


def test_with_quality_nothing_starts_anywhere(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quality = {"off_nadir_deg": [[0, 1], [50, 0.2]]}
    scenario.write_text(json.dumps(json.loads(scenario.read_text()) | {"quality": quality}))
    assert main(["compare-spacing", str(scenario), "--spacing-s", "30"]) == OK
    _, centred, every = capsys.readouterr().out.splitlines()
    assert centred.startswith("one, centred")
    assert every.startswith("every 30 s")


def test_what_is_wrong_is_told_by_its_place(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare-spacing", str(scenario), "--solver", "magic"]) == WRONG_INPUT
    assert capsys.readouterr().err.startswith("slewline: --solver: There is no solver 'magic'")
    content = json.loads(scenario.read_text())
    content["targets"][3]["lat_deg"] = 95.0
    scenario.write_text(json.dumps(content))
    assert main(["compare-spacing", str(scenario)]) == WRONG_INPUT
    assert "scenario.json /targets/3/lat_deg" in capsys.readouterr().err


@pytest.mark.parametrize("again", ["certified", "nothing"])
def test_no_row_is_worse_than_the_one_above(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, again: str
) -> None:
    """Later searches find little, as if time were short; those from a plan find all or nothing."""
    num_searches = 0

    def poor(request: PlanRequest, budget: Budget) -> PlanAnswer:
        nonlocal num_searches
        num_searches += 1
        from_plan = '"replan"' in request.content
        if num_searches == 1 or (from_plan and again == "certified"):
            return answer_of(request, budget)
        few = json.loads(request.content) | {"targets": drawn_targets(3)}
        few.pop("replan", None)
        return answer_of(replace(request, content=canonical(few)), budget)

    monkeypatch.setattr(compare_spacing, "answer_of", poor)
    table = tmp_path / "table.csv"
    asked = ["compare-spacing", str(scenario), "--spacing-s", "45", "--spacing-s", "20"]
    assert main([*asked, "--out", str(table)]) == OK
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    rewards = [float(row["reward"]) for row in rows]
    assert num_searches == 6  # with continuous starts no search starts from a plan
    assert rewards[0] > 3
    if again == "certified":
        assert rewards[1] > rewards[0]
        assert rewards == sorted(rewards)
    else:
        assert rewards == [rewards[0]] * 4
        assert {row["ended"] for row in rows[1:]} == {"plan above"}
    assert {row["validity"] for row in rows} == {"valid"}
