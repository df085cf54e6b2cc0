"""Continuous starts as a problem with several fixed starts in each access."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.sampled_starts import with_own_rows, with_sampled_starts
from planner_core.certified.proofs.bound import accessible
from planner_core.certified.sizes import APART_S
from planner_core.certified.strategies import continuous
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.certified.strategies.supports import samples_starts
from planner_core.certified.tuning import tuned
from planner_core.domain import Objective, Resources
from planner_core.precedence.time_windows import time_windows_of
from planner_core.problem import COLLECT, Blocked, Pinned, Problem
from planner_core.problem.delivery import with_objective
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Rule
from tests.examples import examples
from tests.planner_core.flat_earth import flat_problem


def _problem(seed: int, num_satellites: int = 1) -> Problem:
    return flat_problem(
        seed, num_targets=12, num_satellites=num_satellites, num_contacts=2, horizon_s=900.0,
        use_resources=True,
    )  # fmt: skip


@examples(60)
@given(
    seed=st.integers(0, 10**6),
    num_satellites=st.integers(1, 2),
    most=st.sampled_from([20, 60, 10_000]),
    is_blocked=st.booleans(),
)
def test_starts_lie_in_accesses_no_further_apart_than_their_number_allows(
    seed: int, num_satellites: int, most: int, is_blocked: bool
) -> None:
    problem = _problem(seed, num_satellites)
    if is_blocked:
        blocked = Blocked(satellite=0, start_s=300.0, end_s=400.0,
                          kinds=frozenset({COLLECT}), pointer="/pins/block/0")  # fmt: skip
        problem = replace(problem, pinned=Pinned(blocked=(blocked,)))
    with tuned(most_relaxed=most):
        made = with_sampled_starts(problem)
    table, source = made.problem.opportunities, problem.opportunities
    assert np.array_equal(table.access, source.access[made.source])
    windows = [time_windows_of(problem, index) for index in range(num_satellites)]
    total_s = sum(float((each.close_s - each.open_s).sum()) for each in windows)
    apart_s = max(APART_S, total_s / most)
    for each in windows:
        for row, open_s, close_s in zip(each.row, each.open_s, each.close_s, strict=True):
            starts_s = table.start_s[(table.access == source.access[row])]
            starts_s = np.sort(starts_s[(starts_s >= open_s) & (starts_s <= close_s)])
            edges_s = np.concatenate([[open_s], starts_s, [close_s]])
            assert np.diff(edges_s).max() <= apart_s + 2e-3
    is_own = table.start_s == source.start_s[made.source]
    assert sorted(made.source[is_own]) == list(range(len(source)))
    new = (table.kind == COLLECT) & ~is_own
    for index, each in enumerate(windows):
        for row in np.flatnonzero(new & (table.satellite == index)):
            fits = (each.open_s <= table.start_s[row]) & (table.start_s[row] <= each.close_s)
            assert (fits & (source.access[each.row] == table.access[row])).any()


@examples(40)
@given(seed=st.integers(0, 10**6), num_satellites=st.integers(1, 2))
def test_a_plan_among_them_is_one_with_continuous_starts(seed: int, num_satellites: int) -> None:
    problem = _problem(seed, num_satellites)
    made = with_sampled_starts(problem)
    fixed = replace(made.problem, pointing=None)
    plan = Rule().solve(fixed, Budget(), seed).plan
    judged = replay(problem, with_own_rows(problem, made, plan))
    assert judged.is_valid
    assert judged.reward == pytest.approx(replay(fixed, plan).reward)


def test_more_is_earned_with_them() -> None:
    own = sampled = 0.0
    for seed in range(4):
        problem = flat_problem(
            seed, num_targets=25, horizon_s=600.0, use_resources=True,
            resources=Resources.limitless(),
        )  # fmt: skip
        for begin in (continuous.fixed_starts, continuous.sampled_starts):
            best = Incumbent(problem, Budget(), 0.0, bound=accessible(problem), covers_starts=True)
            with patch.object(continuous, "filled_with_resources", lambda _p, plan, _b: plan):
                for _ in begin(Search(best, 0, STRATEGIES)):
                    pass
            if begin is continuous.fixed_starts:
                own += best.reward
            else:
                sampled += best.reward
    assert sampled > 1.05 * own


def test_days_of_fleets_whose_images_age_go_without() -> None:
    aging = Objective(collected_share=0.0, half_life_s=3600.0)
    for num_satellites, expected in ((1, True), (2, False)):
        problem = _problem(1, num_satellites)
        assert samples_starts(problem)
        assert samples_starts(with_objective(problem, aging)) is expected
    assert not samples_starts(replace(problem, use_resources=False))
    assert not samples_starts(replace(problem, continuous_starts=False, pointing=None))
