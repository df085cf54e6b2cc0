"""Round trips: what is written can be read, and has the same plan hash."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.referee.replay import plan_sha256, replay
from planner_core.spreadsheets import guarded, unguarded
from service.answers.answered import Answered
from service.answers.reading import READERS, Reading, UnreadableTimeline, plan_in
from service.answers.rebuilt import view_of
from service.commands.cli import main
from service.commands.outcome import FAILED, OK, WRONG_INPUT
from service.exports import table
from service.scenarios.canonical import canonical
from service.scenarios.translate import scenario_from_content
from service.wire.base import read as read_wire
from service.wire.timelines import TimelineOut
from tests.missions import Document, drawn_targets, paper_mission
from tests.service.answers import answered_of
from tests.service.exports.conftest import FINISHED_AT, Mission
from tests.service.test_plan_job import run


def compiled(scenario: Scenario) -> Problem:
    return build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())


@pytest.fixture(scope="module")
def problem(mission: Mission) -> Problem:
    return compiled(mission.scenario)


def csv_of(answered: Answered) -> bytes:
    return "".join(table.write(answered)).encode()


def read(data: bytes, suffix: str, scenario: Scenario, problem: Problem) -> Reading:
    return plan_in(READERS[suffix](data), scenario, problem)


def rows_of(answered: Answered) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(csv_of(answered).decode(), newline="")))


def written(rows: list[dict[str, str]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, rows[0])
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def test_the_table_has_one_row_for_each_action(answered: Answered) -> None:
    text = csv_of(answered).decode()
    assert text.count("\r\n") == text.count("\n") == 1 + len(list(answered.each_action()))
    for row, (satellite, action) in zip(rows_of(answered), answered.each_action(), strict=True):
        assert row["action_id"] == action["id"]
        assert unguarded(row["satellite_id"]) == satellite["id"]
        for name in ("mode", "start", "end"):
            assert row[name] == action[name]
        for name in ("off_nadir_deg", "reward", "battery_fraction_end"):
            assert (float(row[name]) if row[name] else None) == action[name]
        assert (float(row["slew_needed_s"]) if row["slew_needed_s"] else None) == (
            action["slew"]["needed_s"] if action["slew"] else None
        )


def test_no_cell_is_a_formula(answered: Answered) -> None:
    risky = [
        cell for row in rows_of(answered) for cell in row.values() if cell and cell[0] in "=+-@\t\r"
    ]
    assert risky == []
    assert {row["satellite_name"] for row in rows_of(answered)} == {"'=EYE, 1", 'EYE "2"'}


@given(st.text(alphabet="'=+-@\t\rA1", max_size=6))
def test_every_text_comes_back_from_behind_its_apostrophe(text: str) -> None:
    cell = guarded(text)
    assert cell is not None
    assert unguarded(cell) == text
    assert cell[:1] not in tuple("=+-@\t\r")


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_exports_come_back_as_the_same_plan(
    suffix: str, mission: Mission, answered: Answered, problem: Problem
) -> None:
    data = csv_of(answered) if suffix == ".csv" else mission.timeline.encode()
    reading = read(data, suffix, mission.scenario, problem)
    assert reading.impossible == ()
    assert plan_sha256(problem, reading.plan) == answered.head["plan_sha256"]
    verdict = replay(problem, reading.plan)
    assert verdict.is_valid
    assert verdict.reward == answered.head["totals"]["reward"]
    assert verdict.battery_min == answered.head["totals"]["battery_min_fraction"]


@pytest.mark.parametrize(
    ("solver", "flags"),
    [
        ("forward_search", {"dynamics": "paper"}),
        ("rule", {"use_resources": False}),
        ("rule", {"collect_spacing_s": 5.0}),
        ("milp", {"use_resources": False, "collect_spacing_s": 20.0}),
        ("rule", {"continuous_starts": True}),
        ("rule", {"quality": {"off_nadir_deg": [[0, 1], [50, 0.3]]}}),
    ],
    ids=str,
)
def test_plans_of_every_kind_of_scenario_come_back(solver: str, flags: dict[str, Any]) -> None:
    file = paper_mission(drawn_targets(80), **flags)
    answer = run(file, solver)
    answered = answered_of(answer.timeline, answer.targets, canonical(file), FINISHED_AT)
    scenario = scenario_from_content(file)
    problem = compiled(scenario)
    for data, suffix in ((csv_of(answered), ".csv"), (answer.timeline.encode(), ".json")):
        reading = read(data, suffix, scenario, problem)
        assert plan_sha256(problem, reading.plan) == answered.head["plan_sha256"]
        assert replay(problem, reading.plan).is_valid
        assert replay(problem, reading.plan).reward == answered.head["totals"]["reward"]


def test_answers_of_the_first_release_are_read_and_exported(
    mission: Mission, answered: Answered
) -> None:
    """Stored before images had their own worth and quality."""
    stored = mission.document
    del stored["totals"]["quality_mean"]
    actions = [action for satellite in stored["satellites"] for action in satellite["actions"]]
    for action in actions:
        del action["worth"], action["quality"]
    timeline = read_wire(TimelineOut, json.dumps(stored))
    assert timeline.totals.quality_mean is None
    assert {(a.worth, a.quality) for s in timeline.satellites for a in s.actions} == {(None, None)}
    assert view_of(timeline) == view_of(read_wire(TimelineOut, mission.timeline))
    old = answered_of(json.dumps(stored), mission.targets, mission.content, FINISHED_AT)
    now = rows_of(answered)
    assert rows_of(old) == [row | {"worth": "", "quality": ""} for row in now]
    assert any(row["worth"] for row in now)


def test_an_empty_plan_is_a_header(mission: Mission, answered: Answered, problem: Problem) -> None:
    header = csv_of(answered).partition(b"\r\n")[0] + b"\r\n"
    assert read(header, ".csv", mission.scenario, problem).plan.actions == ()


def test_rows_in_any_order_and_without_our_figures_are_the_same_plan(
    mission: Mission, answered: Answered, problem: Problem
) -> None:
    few = ("satellite_id", "mode", "start", "end", "target_id", "station_id")
    rows = [
        {name: row[name] for name in few} for row in rows_of(answered) if row["mode"] != "sunpoint"
    ]
    reading = read(written(rows[::-1]), ".csv", mission.scenario, problem)
    assert plan_sha256(problem, reading.plan) == answered.head["plan_sha256"]


@pytest.mark.parametrize(
    ("change", "code", "told"),
    [
        ({"satellite_id": "sat/9"}, "unknown_satellite", "sat/9"),
        ({"target_id": "nowhere"}, "unknown_target", "nowhere"),
        ({"target_id": ""}, "missing_field", "no target"),
        ({"mode": "contact"}, "missing_field", "no station"),
        ({"mode": "look"}, "unknown_value", "mode"),
        ({"start": "2019-01-01T00:00:00"}, "naive_time", "start"),
        ({"start": "soon"}, "invalid_time", "start"),
        ({"end": "2018-01-01T00:00:00Z"}, "invalid_time", "ends before"),
    ],
)
def test_what_is_wrong_with_a_row_is_told_with_its_line(
    change: dict[str, str],
    code: str,
    told: str,
    mission: Mission,
    answered: Answered,
    problem: Problem,
) -> None:
    rows = rows_of(answered)
    number = next(i for i, row in enumerate(rows) if row["mode"] == "collect")
    rows[number] |= change
    with pytest.raises(UnreadableTimeline) as refusal:
        read(written(rows), ".csv", mission.scenario, problem)
    (fault,) = refusal.value.faults
    assert (fault.code, fault.row) == (code, number + 2)
    assert told in fault.detail


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "empty_file"),
        (b"start,end\r\n", "missing_field"),
        (b"\xff\xfa", "not_utf8"),
    ],
)
def test_what_is_no_table_is_refused(
    data: bytes, code: str, mission: Mission, problem: Problem
) -> None:
    with pytest.raises(UnreadableTimeline) as refusal:
        read(data, ".csv", mission.scenario, problem)
    assert refusal.value.faults[0].code == code


@pytest.mark.parametrize(
    ("data", "pointer"),
    [
        (b"[]", "/satellites"),
        (b'{"satellites": [{}]}', "/satellites/0/actions"),
        (b'{"satellites": [{"actions": [5]}]}', "/satellites/0/actions/0"),
        (b'{"satellites": [{"actions": [{}]}]}', "/satellites/0/id"),
        (b"{", None),
    ],
)
def test_what_is_no_timeline_document_is_refused(
    data: bytes, pointer: str | None, mission: Mission, problem: Problem
) -> None:
    with pytest.raises(UnreadableTimeline) as refusal:
        read(data, ".json", mission.scenario, problem)
    assert refusal.value.faults[0].pointer == pointer


@pytest.fixture
def files(tmp_path: Path, mission: Mission) -> tuple[str, Path]:
    scenario = tmp_path / "day.json"
    scenario.write_text(mission.content, encoding="utf-8")
    return str(scenario), tmp_path / "timeline.csv"


def test_the_command_finds_our_own_plan_valid(
    files: tuple[str, Path],
    answered: Answered,
    mission: Mission,
    capsys: pytest.CaptureFixture[str],
) -> None:
    scenario, timeline = files
    timeline.write_bytes(csv_of(answered))
    assert main(["check", scenario, str(timeline)]) == OK
    of_csv = capsys.readouterr().out
    as_json = timeline.with_suffix(".json")
    as_json.write_text(mission.timeline, encoding="utf-8")
    assert main(["check", scenario, str(as_json)]) == OK
    assert capsys.readouterr().out == of_csv
    assert answered.head["plan_sha256"] in of_csv
    assert of_csv.splitlines()[1].split()[0] == "valid"


def test_the_command_names_what_an_edited_plan_breaks(
    files: tuple[str, Path], answered: Answered, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, timeline = files
    rows = rows_of(answered)
    collects = [i for i, row in enumerate(rows) if row["mode"] == "collect"]
    rows[collects[0]] |= {"start": "2019-01-01T23:00:00Z", "end": "2019-01-01T23:00:30Z"}
    rows[collects[1]]["target_id"] = "'@out of reach"
    timeline.write_bytes(written(rows))
    assert main(["check", scenario, str(timeline)]) == FAILED
    out = capsys.readouterr().out
    assert f"line {collects[0] + 2}: window: " in out
    assert f"line {collects[1] + 2}: window: sat/1#a has no access to @out of reach." in out
    assert out.splitlines()[1].split()[0] == "violations"


def test_the_command_does_not_believe_what_a_document_claims(
    files: tuple[str, Path], mission: Mission, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, timeline = files
    document: Document = mission.document
    document["totals"]["reward"] = 1e6
    document["plan_sha256"] = "0" * 64
    document["scenario_sha256"] = "1" * 64
    as_json = timeline.with_suffix(".json")
    as_json.write_text(json.dumps(document), encoding="utf-8")
    assert main(["check", scenario, str(as_json)]) == OK
    out = capsys.readouterr().out
    assert "note: the file claims a reward of 1e+06" in out
    assert "note: the file gives the plan as 0000" in out
    assert "note: the file was made for another scenario, 1111" in out


def test_the_command_names_what_it_cannot_read(
    files: tuple[str, Path], answered: Answered, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario, timeline = files
    rows = rows_of(answered)
    for row in rows[:30]:
        row["satellite_id"] = "x"
    timeline.write_bytes(written(rows))
    assert main(["check", scenario, str(timeline)]) == WRONG_INPUT
    told = capsys.readouterr().err
    assert f"{timeline} line 2: satellite_id: The scenario has no satellite 'x'." in told
    assert told.endswith("10 more\n")
    assert main(["check", scenario, str(timeline.with_name("none.csv"))]) == WRONG_INPUT
    with pytest.raises(SystemExit):
        main(["check", scenario, "timeline.czml"])
