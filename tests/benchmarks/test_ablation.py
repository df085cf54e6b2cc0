"""Changes hit what they name, each runs once, and the page says which are missed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks.ablation import trials
from benchmarks.ablation.constants import constants, scaled
from benchmarks.ablation.page import findings, page
from benchmarks.ablation.strategies import NOTHING, STRATEGIES, Change, Patch
from benchmarks.ablation.trials import Trial
from benchmarks.suite import rows
from benchmarks.suite.engine import Case, Result
from benchmarks.suite.families import FAMILIES, Family
from planner_core.certified.tuning import TUNING, Tuning, tuned

PLAIN = Trial(
    family="paper-200",
    draw=0,
    seed=0,
    budget_s=5.0,
    reward=99.0,
    bound=100.0,
    gap_percent=1.0,
    to_2_s=1.0,
    used_s=5.0,
    peak_mb=100.0,
    revision="r1",
)
FEW = "few"


@pytest.fixture
def few() -> Iterator[str]:
    """Return a family of small missions."""
    known: Any = FAMILIES
    known[FEW] = Family(num_targets=30, budget_s=9.0, quick_budget_s=None)
    yield FEW
    del known[FEW]


@pytest.mark.parametrize("name", STRATEGIES)
def test_every_strategy_is_where_it_is_switched_off(name: str) -> None:
    change = STRATEGIES[name]
    assert change.patches or change.tuning
    assert all(getattr(TUNING, name) != value for name, value in change.tuning.items())
    for patch in change.patches:
        owner, last = patch.place
        assert getattr(owner, last) != patch.value
    assert set(change.families) <= set(FAMILIES)


def test_a_name_that_is_gone_is_an_error() -> None:
    with pytest.raises(AttributeError, match="no_such"):
        Patch(module="planner_core.run", name="no_such", value=0).apply()


def test_all_constants_are_tried_but_those_that_only_kernels_read() -> None:
    found = constants()
    for change in found.values():
        ((name, value),) = change.tuning.items()
        assert getattr(TUNING, name) != value
        assert change.families
        assert set(change.families) <= set(FAMILIES)
    tried = {name.rpartition(" ")[0] for name in found}
    # Frozen into the kernels that make moves: another value would change nothing.
    assert {each.name for each in fields(Tuning)} - tried == {"aimed", "tie"}
    assert {name.rpartition(" ")[2] for name in found} == {"half", "double"}


def test_a_change_of_the_tuning_is_in_force_where_it_is_applied(few: str) -> None:
    change = Change(tuning={"tries": 7}, families={few: 9.0})
    with tuned(tries=TUNING.tries):
        change.apply()
        assert TUNING.tries == 7
    assert TUNING.tries == Tuning().tries
    with pytest.raises(AttributeError, match="no_such"):
        Change(tuning={"no_such": 1}, families={}).apply()


@pytest.mark.parametrize(
    ("value", "half", "double"),
    [(8, 4, 16), (1, 1, 2), (0.3, 0.15, 0.6), (0.99, 0.98, 0.995), ((4, 0.2), (2, 0.1), (8, 0.4))],
)
def test_shares_and_whole_numbers_stay_what_they_are(value: Any, half: Any, double: Any) -> None:
    assert scaled(value, 0.5) == pytest.approx(half)
    assert scaled(value, 2.0) == pytest.approx(double)


def test_each_case_is_run_once_as_it_is_and_once_with_each_change(tmp_path: Path, few: str) -> None:
    def awry(*_: object) -> None:
        raise ValueError("awry")

    broken = Patch(module="benchmarks.suite.engine", name="replay", value=awry)
    change = Change(patches=(broken,), families={few: 9.0}, num_draws=1)
    path = tmp_path / "ablation.csv"
    trials.run({"referee": change}, path)
    done = rows.read(path, Trial)
    assert [trial.change for trial in done] == [NOTHING, "referee"]
    assert done[0].gap_percent == 0.0
    assert done[1].failure == "ValueError: awry"
    assert getattr(*broken.place) is not awry
    trials.run({"referee": change}, path)
    assert rows.read(path, Trial) == done


def test_what_another_revision_has_told_is_run_again_where_that_is_asked(
    tmp_path: Path, few: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "ablation.csv"
    first, second = (Change(tuning={"tries": n}, families={few: 9.0}, num_draws=1) for n in (7, 8))
    monkeypatch.setattr(rows, "revision", lambda: "r1")
    trials.run({"first": first}, path)
    monkeypatch.setattr(rows, "revision", lambda: "r2")
    trials.run({"first": first}, path)
    trials.run({"first": first, "second": second}, path)
    trials.run({"first": first, "second": second}, path, anew=True)
    done = [(trial.change, trial.revision) for trial in rows.read(path, Trial)]
    assert done == [
        (NOTHING, "r1"), ("first", "r1"), (NOTHING, "r2"), ("second", "r2"), ("first", "r2"),
    ]  # fmt: skip


def test_a_process_that_dies_is_a_failure(few: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def die(*_: object) -> Result:
        raise SystemExit(3)

    monkeypatch.setattr(trials, "solve", die)
    answer = trials.forked(None, Case(family=few, draw=0, seed=0, budget_s=1.0), None)  # type: ignore[arg-type]
    assert answer == "ended without an answer"


def test_the_latest_counts_beside_the_latest_before_it() -> None:
    first = replace(PLAIN, change="first", gap_percent=1.5)
    faster = replace(PLAIN, gap_percent=0.5, revision="r2")
    second = replace(faster, change="second")
    (one, two) = findings([PLAIN, first, faster, second])
    assert (one.line.points, two.line.points) == (0.5, 0.0)
    (again, _) = findings([PLAIN, first, faster, second, replace(first, gap_percent=0.6)])
    assert again.line.points == pytest.approx(0.1)


def test_what_is_missed_is_found_and_written() -> None:
    other = replace(PLAIN, draw=1)
    kept = replace(PLAIN, change="kept", gap_percent=1.5)
    slow = replace(PLAIN, change="slow", to_2_s=1.3)
    idle = replace(PLAIN, change="idle", gap_percent=1.15, to_2_s=1.05)
    dead = replace(PLAIN, change="dead", failure="StopIteration")
    half = replace(PLAIN, change="lns _MOVES half", gap_percent=1.4)
    lonely = replace(PLAIN, change="lonely", budget_s=7.0)
    all_rows = [PLAIN, other, kept, slow, idle, dead, half, lonely]
    missed = {finding.change: finding.is_worse for finding in findings(all_rows)}
    assert missed == {
        "kept": True, "slow": True, "idle": False, "dead": True, "lns _MOVES half": True,
    }  # fmt: skip
    text = page(all_rows)
    assert "| kept | paper-200 | 1 | 1.00 | 1.50 | +0.50 |" in text
    assert "| `lns _MOVES` | paper-200 | +0.40 | x 1.00 |  |  | **yes** |" in text
