"""The paper's study runs each case once and writes every promised file."""

from __future__ import annotations

import csv
import math
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.cpu_budget import CpuBudget
from benchmarks.paper.claims import claims
from benchmarks.paper.measure import Outcome, Task, run_task
from benchmarks.paper.published import TABLE_6, TABLE_7, forward_grid, mcts_grid
from benchmarks.paper.readings import BASE, Reading
from benchmarks.paper.readings_table import nearest
from benchmarks.paper.settings import settings as named_settings
from benchmarks.paper.store import Store
from benchmarks.paper.study import Study, best_forward, quick
from benchmarks.paper.summary import parts, row_params
from planner_core.solvers.registry import SOLVERS

FLAT = Reading(look_deg=(0.0, 50.0))
TINY = Study(
    targets=(20, 30),
    draws=1,
    grid_targets=30,
    forward_points=tuple(forward_grid()[:2]),
    mcts_points=tuple(mcts_grid()[:1]),
    mcts_runs=2,
    readings_without=(BASE, FLAT),
    readings_with=(BASE,),
    exact_limit_s=2.0,
)


def far() -> float:
    return time.time() + 300.0


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Store:
    store = Store(tmp_path_factory.mktemp("study") / "runs.csv")
    for _, choose in TINY.phases():
        for task in store.missing(choose(store.done)):
            outcome = run_task(task, far())
            assert outcome is not None
            store.add(task, outcome)
    return store


@pytest.mark.parametrize("use_resources", [False, True])
def test_every_setting_makes_a_solver_and_every_solver_has_one(use_resources: bool) -> None:
    found = named_settings(use_resources=use_resources)
    assert {setting.make().name for setting in found} == set(SOLVERS)
    assert len({(setting.solver, setting.kind) for setting in found}) == len(found)


def test_the_grids_have_the_papers_points_and_its_best_rows_lie_on_them() -> None:
    assert (len(forward_grid()), len(mcts_grid())) == (54, 720)
    assert all(row_params(row) in forward_grid() for row in TABLE_6)
    assert all(row_params(row) in mcts_grid() for row in TABLE_7)


def test_the_whole_study_has_all_runs_and_the_quick_one_a_part() -> None:
    full, small = Study().all_tasks(), quick().all_tasks()
    grid = {task for task in full if task.solver == "mcts" and task.reading == BASE}
    assert len(grid) >= 2 * 720 * 10
    assert len(small) < len(full) / 50


def test_finished_runs_are_read_back_and_not_run_again(finished: Store, tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    store = Store(path)
    tasks = list(finished.done)
    for task in tasks[:3]:
        store.add(task, finished.done[task])
    again = Store(path)
    assert again.done == {task: finished.done[task] for task in tasks[:3]}
    assert again.missing(tasks) == tasks[3:]


def test_a_line_that_was_cut_off_counts_as_not_run(finished: Store, tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    store = Store(path)
    first, second = list(finished.done)[:2]
    store.add(first, finished.done[first])
    store.add(second, finished.done[second])
    path.write_text(path.read_text(encoding="utf-8")[:-9], encoding="utf-8")
    again = Store(path)
    assert list(again.done) == [first]
    again.add(second, finished.done[second])
    assert list(Store(path).done) == [first, second]


def test_a_file_of_other_columns_is_begun_anew(finished: Store, tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    task = next(iter(finished.done))
    Store(path).add(task, finished.done[task])
    path.write_text(path.read_text(encoding="utf-8").replace("cost_s", "cost"), encoding="utf-8")
    assert Store(path).done == {}


def test_a_run_counts_all_its_cpu_time(finished: Store) -> None:
    assert all(0.0 < o.seconds <= o.cost_s for o in finished.done.values())


def test_a_limit_counts_the_cpu_time_of_this_process() -> None:
    budget = CpuBudget(0.05, math.inf)
    began_s = time.process_time()
    while not budget.is_spent():
        pass
    assert time.process_time() - began_s >= 0.04
    assert budget.remaining_s() == 0.0


def test_the_deadline_ends_a_run_without_a_limit() -> None:
    assert CpuBudget(math.inf, time.time() - 1.0).is_spent()
    budget = CpuBudget(math.inf, far())
    assert not budget.is_spent()
    assert budget.remaining_s() <= 300.0


_KILLED = """
import math, time
from benchmarks.paper.pool import Pool
from tests.benchmarks.test_paper_study import TINY
with Pool(1, math.inf) as pool:
    next(pool.run(TINY.figures(exact=False)[:1]))
    print("ready", flush=True)
    time.sleep(600.0)
"""


def test_no_worker_outlives_a_study_that_is_killed() -> None:
    with subprocess.Popen([sys.executable, "-c", _KILLED], stdout=subprocess.PIPE) as study:
        assert study.stdout is not None
        assert study.stdout.readline() == b"ready\n"
        study.kill()
        # The workers hold the other end too: this returns when the last of them has ended.
        assert study.communicate(timeout=60.0)[0] == b""


def test_a_run_that_the_time_cuts_off_leaves_nothing() -> None:
    task = TINY.mcts(range(1))[0]
    assert run_task(task, time.time() - 1.0) is None


def test_outcomes_keep_the_bound_and_hard_limits(finished: Store) -> None:
    for task, outcome in finished.done.items():
        assert outcome.reward <= outcome.bound
        assert outcome.reward <= outcome.images
        if '"penalty"' not in task.params:
            assert outcome.violations == 0


def test_what_is_unfinished_is_said(finished: Store) -> None:
    assert all(part.is_whole for part in parts(TINY, finished.done))
    unfinished = parts(TINY, without_grid(finished.done))
    assert [p.name for p in unfinished if not p.is_whole] == ["MCTS grid, further runs"]
    assert {claim.verdict for claim in claims(TINY, {})} == {"not measured"}


def test_the_nearest_reading_is_judged_beside_our_own(finished: Store) -> None:
    task = TINY.reading_task(best_forward(False), FLAT)
    exact = replace(finished.done[task], images=450)
    done = {**finished.done, task: exact}
    near = nearest(TINY, done, is_mcts=False, res=False)
    assert near is not None
    assert (near.reading, near.images, near.error) == (FLAT, 450, 0.0)
    level = claims(TINY, done)[0]
    assert (level.verdict, level.near) == ("does not reproduce", "reproduces")


def test_the_parts_hold_every_run_once(finished: Store) -> None:
    made = parts(TINY, finished.done)
    assert sum(part.runs for part in made) == len(finished.done)
    assert sum(part.cost_s for part in made) == pytest.approx(
        sum(outcome.cost_s for outcome in finished.done.values())
    )


def without_grid(done: dict[Task, Outcome]) -> dict[Task, Outcome]:
    return {task: outcome for task, outcome in done.items() if task.seed == 0}


@pytest.fixture(scope="module")
def page(finished: Store, tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("matplotlib")
    from benchmarks.paper.report import write_report

    docs = tmp_path_factory.mktemp("docs")
    return write_report(TINY, finished.done, docs, took_min=1.0, command="make paper")


def test_the_page_shows_every_figure_and_table(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    pictures = sorted(path.name for path in page.parent.glob("paper/*.png"))
    assert pictures == [
        f"{family}-resources-{size}.png" for family in ("with", "without") for size in (20, 30)
    ]
    assert all(f"paper/{name}" in text for name in pictures)
    for part in ("Table 6", "Table 7", "does not reproduce", "All planned runs were made"):
        assert part in text


def test_each_figure_has_its_numbers_with_a_bound_beside_every_bar(page: Path) -> None:
    for path in page.parent.glob("paper/*-resources-*.csv"):
        with path.open(encoding="utf-8") as file:
            lines = list(csv.DictReader(file))
        solvers = {(line["solver"], line["kind"]) for line in lines}
        assert {("rule", "paper"), ("forward_search", "paper"), ("mcts", "paper")} <= solvers
        assert all(float(line["bound"]) >= float(line["reward"]) > 0.0 for line in lines)


def test_minutes_add_up_over_calls(tmp_path: Path) -> None:
    for took_min, in_all_min in ((3.0, 3.0), (1.5, 4.5)):
        store = Store(tmp_path / "runs.csv")
        assert store.minutes_in_all(took_min) == pytest.approx(in_all_min)
