"""The plan that searches start from if images age."""

from __future__ import annotations

import pytest

from planner_core.budget import Budget, Progress
from planner_core.certified.driver import Search, Strategy
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.strategies import half_life
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.domain import Objective
from planner_core.problem import Problem
from planner_core.problem.delivery import with_objective
from planner_core.referee.replay import replay
from planner_core.solvers.forward_search import ForwardSearch
from tests.planner_core.problems import random_problem


def _aging(seed: int, num_satellites: int) -> Problem:
    problem = random_problem(
        seed, num_collects=40, num_targets=20, num_contacts=6, num_satellites=num_satellites
    )
    return with_objective(problem, Objective(collected_share=0.0, half_life_s=300.0))


def _strategy(name: str) -> Strategy:
    (found,) = [one for one in STRATEGIES if one.name == name]
    return found


@pytest.mark.parametrize("num_satellites", [1, 2, 4])
def test_images_that_age_are_first_planned_by_forward_search(num_satellites: int) -> None:
    """The rule alone earns less: it waits until the recorder is nearly full."""
    rule_alone = with_forward_search = 0.0
    for seed in range(6):
        problem = _aging(seed, num_satellites)
        strategies = [_strategy("rule"), _strategy("forward search")]
        less, more = (Incumbent(problem, Budget(), 0.0) for _ in range(2))
        Search(less, 0, strategies[:1]).solved()
        Search(more, 0, strategies).solved()
        timeline = replay(problem, ForwardSearch().solve(problem, Budget(), 0).plan)
        assert timeline.is_valid
        assert more.reward >= max(less.reward, timeline.reward)
        rule_alone += less.reward
        with_forward_search += more.reward
    assert with_forward_search > 1.1 * rule_alone


def test_what_forward_search_expects_is_not_reported() -> None:
    """It counts images in full, as if they did not age: more than any bound."""
    problem = _aging(0, 2)
    told: list[Progress] = []
    best = Incumbent(problem, Budget(report=told.append), 0.0)
    for _ in half_life.forward_search(Search(best, 0, STRATEGIES)):
        pass
    assert all(one.reward is None or one.reward <= best.reward for one in told)
