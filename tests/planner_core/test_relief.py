"""A recorder too full at the start: contacts empty it, and proofs hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import pytest

from planner_core.budget import Budget
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.replanning.relief import flyable, within_limits
from planner_core.solvers.registry import SOLVERS, Certified
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem

FULL = replace(TIGHT, initial_recorder_fraction=TIGHT.recorder_max_fraction + 0.1)
TASKS = [
    Task(kind=COLLECT, site=0, start_s=50.0, end_s=60.0),
    Task(kind=CONTACT, site=0, start_s=100.0, end_s=200.0),
    Task(kind=COLLECT, site=1, start_s=400.0, end_s=410.0),
]


def _full_problem(seed: int) -> Problem:
    return random_problem(seed, num_collects=5, num_contacts=3, resources=FULL)


def _flown(problem: Problem) -> Iterator[Timeline]:
    """Yield the timeline of every plan that may be flown."""
    rows = range(len(problem.opportunities))
    for number in range(len(rows) + 1):
        for taken in combinations(rows, number):
            timeline = replay(problem, Plan.of(problem, taken))
            if timeline.validity != "violations":
                yield timeline


def test_a_contact_that_empties_a_full_recorder_breaks_nothing() -> None:
    problem = make_problem(TASKS, num_targets=2, resources=FULL)
    timeline = replay(problem, Plan.of(problem, [1, 2]))
    assert timeline.validity == "inherited"
    assert [(v.code, v.blamed, v.inherited) for v in timeline.violations] == [
        ("recorder", (), True)
    ]
    assert timeline.reward == 1.0


def test_an_image_that_fills_it_further_is_to_blame() -> None:
    problem = make_problem(TASKS, num_targets=2, resources=FULL)
    timeline = replay(problem, Plan.of(problem, [0, 1, 2]))
    assert timeline.validity == "violations"
    assert [(v.code, v.blamed, v.inherited) for v in timeline.violations] == [
        ("recorder", (0,), False)
    ]
    assert set(timeline.collected) == {1}


@pytest.mark.parametrize("code", ["battery", "recorder"])
def test_an_image_without_energy_or_room_is_to_blame_though_no_level_moves(code: str) -> None:
    """An empty battery cannot fall, nor a full recorder rise: using them is the violation."""
    battery, recorder = (0.0, 0.0) if code == "battery" else (0.9, 1.0)
    worn = replace(TIGHT, initial_battery_fraction=battery, initial_recorder_fraction=recorder)
    image = Task(kind=COLLECT, site=0, start_s=0.0, end_s=10.0)
    problem = make_problem([image], num_targets=1, resources=worn)
    timeline = replay(problem, Plan.of(problem, [0]))
    (broken,) = timeline.violations
    assert (broken.code, broken.blamed, broken.inherited) == (code, (0,), False)
    assert replay(problem, Plan(())).validity == "inherited"


def test_a_recorder_that_fills_again_is_not_inherited() -> None:
    again = Task(kind=COLLECT, site=0, start_s=500.0, end_s=600.0)
    problem = make_problem([*TASKS, again], num_targets=2, resources=FULL)
    timeline = replay(problem, Plan.of(problem, [1, 2, 3]))
    assert [(v.blamed, v.inherited) for v in timeline.violations] == [((), True), ((2,), False)]


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_every_solver_finds_the_way_back(name: str) -> None:
    problem = make_problem(TASKS, num_targets=2, resources=FULL)
    searched = within_limits(problem)
    found = flyable(problem, searched, SOLVERS[name]().solve(searched, Budget(), 0))
    timeline = replay(problem, found.plan)
    assert (timeline.validity, timeline.reward) == ("inherited", 1.0)


@pytest.mark.parametrize("seed", range(12))
def test_bounds_hold_for_all_that_may_be_flown(seed: int) -> None:
    problem = _full_problem(seed)
    best = max(timeline.reward for timeline in _flown(problem))
    searched = within_limits(problem)
    solution = Certified().solve(searched, Budget(), 0)
    assert solution.bound is not None
    assert solution.bound >= best - 1e-9
    assert quick_bound(searched, 0.0).value >= best - 1e-9
    timeline = replay(problem, flyable(problem, searched, solution).plan)
    assert timeline.validity != "violations"
    assert timeline.reward <= best + 1e-9


def test_a_problem_within_its_limits_is_left_alone() -> None:
    problem = random_problem(0)
    assert within_limits(problem) is problem
