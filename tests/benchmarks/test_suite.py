"""The suite runs each case once, keeps its result, and reports what has become worse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.suite import __main__ as suite
from benchmarks.suite import rows
from benchmarks.suite.compare import line_of, markdown
from benchmarks.suite.engine import Case, Curve, Result, run_case
from benchmarks.suite.families import FAMILIES, Family, scenario_of, warm_up_of
from planner_core.budget import Progress

CASE = Case(family="paper-200", draw=0, seed=0, budget_s=5.0)
RESULT = Result(
    reward=98.0,
    bound=100.0,
    to_level_s=(3.0, None, None, None),
    used_s=5.0,
    peak_mb=200.0,
    compiled_s=0.0,
)
ROW = rows.Row(
    family="paper-200",
    draw=0,
    seed=0,
    budget_s=5.0,
    reward=98.0,
    bound=100.0,
    gap_percent=2.0,
    to_2_s=3.0,
    used_s=5.0,
    peak_mb=200.0,
    revision="first",
)


def test_what_is_in_the_file_is_not_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "new" / "suite.csv"
    asked: list[Case] = []

    def apart(case: Case) -> Result | str:
        asked.append(case)
        return RESULT if case.draw == 0 else "ValueError: none"

    monkeypatch.setattr(suite, "apart", apart)
    suite.run([CASE], path)
    suite.run([CASE, replace(CASE, draw=1), replace(CASE, budget_s=9.0)], path)
    suite.run([CASE, replace(CASE, draw=1)], path)
    assert asked == [CASE, replace(CASE, draw=1), replace(CASE, budget_s=9.0)]
    kept = rows.read(path, rows.Row)
    assert [row.case for row in kept] == asked
    assert kept[0].gap_percent == 2.0
    assert kept[0].to_level_s == RESULT.to_level_s
    assert kept[1].failure == "ValueError: none"
    assert kept[1].reward is None


def test_a_run_without_a_bound_has_no_gap(tmp_path: Path) -> None:
    row = rows.row_of(CASE, replace(RESULT, bound=float("inf")), rows.Row)
    rows.append(tmp_path / "suite.csv", row)
    assert rows.read(tmp_path / "suite.csv", rows.Row) == [row]
    assert row.gap_percent is None
    assert row.reward == 98.0


def test_more_gap_and_more_time_are_worse() -> None:
    assert line_of([(ROW, ROW)]).worse == ()
    assert line_of([(ROW, replace(ROW, gap_percent=2.1, to_2_s=3.3))]).worse == ()
    assert line_of([(ROW, replace(ROW, gap_percent=2.11))]).worse == ("gap",)
    assert line_of([(ROW, replace(ROW, to_2_s=3.5))]).worse == ("time to 2 %",)
    assert line_of([(ROW, replace(ROW, gap_percent=1.0, to_2_s=1.0))]).worse == ()
    assert line_of([(ROW, replace(ROW, gap_percent=None))]).worse == ("gap",)


def test_a_gap_that_is_not_reached_counts_with_all_the_time_used() -> None:
    line = line_of([(ROW, replace(ROW, to_2_s=None))])
    assert line.ratios[0] == pytest.approx(5.1 / 3.1)
    assert line.ratios[1] is None
    assert line.worse == ("time to 2 %",)


def test_a_case_that_fails_is_worse_and_not_averaged() -> None:
    other, failed = replace(ROW, draw=1), replace(ROW, draw=1, failure="StopIteration")
    line = line_of([(ROW, ROW), (other, failed)])
    assert line.worse == ("1 without an answer",)
    assert (line.gap_before, line.gap_after) == (2.0, 2.0)
    assert line_of([(ROW, ROW), (failed, other)]).worse == ()
    assert line_of([(failed, failed)]).worse == ()


def test_the_table_names_families_revisions_and_what_is_alone() -> None:
    other = replace(ROW, family="tight-150")
    text = markdown([ROW, other], [replace(ROW, gap_percent=3.0, revision="second")])
    assert "| paper-200 | 1 | 2.00 | 3.00 | +1.00 |" in text
    assert "**gap**" in text
    assert "first before, second after; 1 of 1 families worse." in text
    assert "In one file only: tight-150 draw 0 seed 0 in 5 s." in text


def test_the_curve_notes_when_a_gap_is_first_reached() -> None:
    curve = Curve()
    curve(Progress(phase="solve", fraction=0.1, reward=98.0))
    assert curve.to_level_s == [None] * 4
    curve(Progress(phase="solve", fraction=0.1, bound=100.0))
    first = curve.to_level_s[0]
    assert first is not None
    assert curve.to_level_s[1:] == [None] * 3
    curve(Progress(phase="solve", fraction=0.2, reward=90.0, bound=98.0))
    assert curve.to_level_s[0] == first
    assert None not in curve.to_level_s


def test_a_case_is_planned_and_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    small = Family(num_targets=40, budget_s=20.0, quick_budget_s=None, dynamics="paper")
    monkeypatch.setitem(FAMILIES, "small", small)
    result = run_case(Case(family="small", draw=0, seed=0, budget_s=20.0))
    assert result.reward == result.bound > 0.0
    assert None not in result.to_level_s
    assert result.peak_mb > 0.0


@pytest.mark.parametrize("name", FAMILIES)
def test_families_differ_in_what_they_say(name: str) -> None:
    family = FAMILIES[name]
    small = replace(family, num_targets=60, num_satellites=min(2, family.num_satellites))
    scenario = scenario_of(small, 0)
    assert scenario == scenario_of(small, 0)
    assert scenario != scenario_of(small, 1)
    assert len(scenario.targets) == 60
    assert len(scenario.satellites) == small.num_satellites
    assert scenario.use_resources == (family.dynamics is not None)
    assert (len({target.reward for target in scenario.targets}) > 1) == family.has_random_rewards
    assert len(warm_up_of(family).targets) == min(100, family.num_targets)


def test_the_quick_form_takes_five_minutes() -> None:
    names = list(FAMILIES)
    quick, full = (suite.cases(names, is_quick=is_quick) for is_quick in (True, False))
    assert sum(case.budget_s for case in quick) <= 240.0  # the rest is starting processes
    assert {case.family for case in full} == set(names)
    assert len(set(full)) == len(full) > len(quick)


def test_as_many_draws_as_are_asked_for() -> None:
    few = suite.cases(["paper-200", "agility-200"], 3, is_quick=False)
    assert [case.draw for case in few] == [0, 0, 1, 1, 2, 2]
    assert {case.seed - case.draw for case in few} == {0}
