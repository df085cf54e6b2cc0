"""SPOT-5: the published optima, and plans that obey the files' rules."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from benchmarks.spot5 import read_instance, solve, worth_of
from planner_core.budget import Budget


def test_every_single_orbit_instance_reaches_its_published_optimum(shared_data: Path) -> None:
    folder = shared_data / "bench" / "spot5"
    with (folder / "known_results.csv").open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    solved = 0
    for row in rows:
        instance = read_instance(folder / f"{row['instance']}.spot")
        if instance.capacity is not None:
            continue
        assert len(instance.weight) == int(row["variables"])
        taken, bound = solve(instance, Budget())
        assert worth_of(instance, taken) == int(row["best_1999"]), row["instance"]
        assert bound == pytest.approx(int(row["best_1999"]), abs=0.5)
        solved += 1
    assert solved == 9


def test_choices_that_break_a_rule_are_refused(shared_data: Path) -> None:
    instance = read_instance(shared_data / "bench" / "spot5" / "8.spot")
    pair = instance.forbidden[0]
    with pytest.raises(ValueError, match="together"):
        worth_of(instance, frozenset(pair))
    with pytest.raises(ValueError, match="twice"):
        worth_of(instance, frozenset({(0, 1), (0, 2)}))


def test_a_file_that_ends_too_early_is_named(tmp_path: Path) -> None:
    path = tmp_path / "cut.spot"
    path.write_text("2\n0 1 3 1 0 2 0 3 0\n")
    with pytest.raises(ValueError, match=r"cut\.spot"):
        read_instance(path)
