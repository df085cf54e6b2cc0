"""The other tests' best plans, compared with every possible set of tasks."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.domain import Objective
from planner_core.problem import ImageOnBoard, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, sunny_problem, varied_problem


def _best_of_all(problem: Problem) -> float:
    """Return the highest reward of all sets of tasks that the referee accepts."""
    rows = range(len(problem.opportunities))
    timelines = (
        replay(problem, Plan.of(problem, some), in_detail=False)
        for size in range(len(rows) + 1)
        for some in itertools.combinations(rows, size)
    )
    return max((timeline.reward for timeline in timelines if timeline.is_valid), default=0.0)


@examples(50)
@given(
    seed=st.integers(0, 10**6),
    num_satellites=st.integers(1, 2),
    is_sunny=st.booleans(),
    collected_share=st.sampled_from([0.0, 0.4, 1.0]),
    half_life_s=st.one_of(st.none(), st.floats(60.0, 2000.0)),
    has_on_board=st.booleans(),
)
def test_no_set_of_tasks_earns_more(
    seed: int,
    num_satellites: int,
    is_sunny: bool,
    collected_share: float,
    half_life_s: float | None,
    has_on_board: bool,
) -> None:
    if is_sunny:
        problem = sunny_problem(
            seed, num_satellites=num_satellites, num_collects=5, is_moving=bool(seed % 2)
        )
    else:
        problem = varied_problem(
            seed, "physical" if seed % 2 else "paper", num_satellites, scarce=TIGHT,
            num_collects=5, has_quality=bool(seed % 3),
        )  # fmt: skip
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    problem = with_objective(problem, objective)
    if has_on_board:
        image = ImageOnBoard(satellite=0, target=0, amount=0.05, collected_s=-60.0, worth=2.0)
        problem = replace(problem, on_board=(image,))
    assert best_reward(problem) == pytest.approx(_best_of_all(problem), abs=1e-9)
