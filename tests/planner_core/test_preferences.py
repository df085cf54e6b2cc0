"""Preferences never cost worth, and every aim gets closer."""

from __future__ import annotations

import functools
from dataclasses import replace
from functools import partial
from typing import Literal, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Objective, Preference
from planner_core.errors import InvalidScenario
from planner_core.preferences.aims import figure_of, liking_of, value_of
from planner_core.preferences.polish import polished
from planner_core.problem import Problem, Singles
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.view import View
from planner_core.solvers.milp import Milp
from planner_core.solvers.registry import SOLVERS
from planner_core.solvers.rule import Rule
from tests.examples import examples
from tests.planner_core.brute_force import possible_plans
from tests.planner_core.problems import TIGHT, random_problem, varied_problem

AIMS: tuple[Preference, ...] = get_args(Preference)
LOOSE = replace(TIGHT, initial_battery_fraction=0.9)
_problem = partial(varied_problem, scarce=TIGHT)


def alike_problem(
    seed: int, num_satellites: int = 2, num_targets: int = 12, num_offers: int = 2
) -> Problem:
    """Return a problem whose images are all worth the same and differ in angles alone."""
    problem = random_problem(
        seed,
        num_satellites=num_satellites,
        num_targets=num_targets,
        num_collects=num_offers * num_targets,
        resources=LOOSE,
    )
    table, draws = problem.opportunities, np.random.default_rng(seed)
    angles_deg = draws.uniform(0.0, 60.0, (2, len(table))).astype(np.float32)
    seen = replace(table, off_nadir_deg=angles_deg[0], sun_elevation_deg=angles_deg[1])
    return replace(problem, opportunities=seen)


@examples(300)
@given(
    seed=st.integers(0, 10**6),
    dynamics=st.sampled_from(["physical", "paper"]),
    num_satellites=st.integers(1, 3),
    collected_share=st.sampled_from([0.0, 0.5, 0.9, 1.0]),
    half_life_s=st.sampled_from([None, 600.0]),
    aims=st.permutations(AIMS),
    solve=st.sampled_from(["rule", "graph"]),
)
def test_preferences_cost_no_worth_to_the_last_bit(
    seed: int,
    dynamics: Literal["physical", "paper"],
    num_satellites: int,
    collected_share: float,
    half_life_s: float | None,
    aims: list[Preference],
    solve: str,
) -> None:
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    problem = with_objective(_problem(seed, dynamics, num_satellites, num_contacts=3), objective)
    plan = SOLVERS[solve]().solve(problem, Budget(), 0).plan
    before = View.of(problem, plan)
    polish = polished(problem, plan, tuple(aims), Budget(), seed)
    after = View.of(problem, polish.plan)
    assert after.timeline.reward == before.timeline.reward
    assert after.timeline.validity == before.timeline.validity
    first = aims[0]
    # Later aims may cost it a hundredth of the value it reached.
    reached = value_of(polished_for(problem, plan, first, seed), first)
    assert value_of(after, first) <= reached + 0.01 * abs(reached)
    assert reached <= value_of(before, first)
    for aim, effect in zip(aims, polish.effects, strict=True):
        assert effect.aim == aim
        assert effect.before == figure_of(aim, value_of(before, aim))
        assert effect.after == figure_of(aim, value_of(after, aim))


def polished_for(problem: Problem, plan: Plan, aim: Preference, seed: int) -> View:
    return View.of(problem, polished(problem, plan, (aim,), Budget(), seed).plan)


@pytest.mark.parametrize("aim", AIMS)
def test_every_aim_is_come_nearer_to(aim: Preference) -> None:
    gained, total = 0, 0
    for seed in range(12):
        # If everything is tight nothing can be moved to the other satellite.
        problem = alike_problem(seed, num_targets=6, num_offers=6)
        if aim == "balance":
            problem = replace(problem, use_resources=False)
        plan = Rule().solve(problem, Budget(), 0).plan
        before = value_of(View.of(problem, plan), aim)
        after = value_of(polished_for(problem, plan, aim, seed), aim)
        assert after <= before
        total += 1
        gained += after < before
    assert gained >= total // 4


@functools.cache
def all_best(seed: int) -> tuple[Problem, Plan, tuple[View, ...]]:
    """Return a small problem, a plan that earns the most, and every plan that earns as much."""
    problem = alike_problem(seed, num_satellites=1, num_targets=4)
    plan = Milp().solve(problem, Budget(), 0).plan
    reward = replay(problem, plan).reward
    views = (View.of(problem, Plan.of(problem, rows)) for rows in possible_plans(problem))
    best = (view for view in views if view.timeline.is_valid and view.timeline.reward == reward)
    return problem, plan, tuple(best)


@pytest.mark.parametrize("aim", AIMS)
def test_small_plans_often_end_at_the_best(aim: Preference) -> None:
    reached = 0
    for seed in range(10):
        problem, plan, views = all_best(seed)
        best = min(value_of(view, aim) for view in views)
        value = value_of(polished_for(problem, plan, aim, 0), aim)
        assert value >= best - 1e-12
        reached += value <= best + 1e-9
    assert reached >= 5


def test_nothing_is_done_where_the_budget_is_spent() -> None:
    problem = alike_problem(0)
    plan = Rule().solve(problem, Budget(), 0).plan
    spent = Budget(time_s=0.0)
    assert polished(problem, plan, AIMS, spent, 0).plan == plan


def test_an_empty_plan_stays_empty() -> None:
    problem = alike_problem(0)
    polish = polished(problem, Plan(), AIMS, Budget(), 0)
    assert polish.plan == Plan()
    assert [effect.after for effect in polish.effects] == [e.before for e in polish.effects]


def test_what_is_liked_is_what_lowers_the_aim() -> None:
    problem = alike_problem(3)
    view = View.of(problem, Rule().solve(problem, Budget(), 0).plan)
    columns: dict[Preference, Singles] = {
        "off_nadir": -problem.opportunities.off_nadir_deg,
        "sun": problem.opportunities.sun_elevation_deg,
    }
    for aim, column in columns.items():
        liking = liking_of(view, aim)
        assert liking is not None
        assert np.array_equal(np.argsort(liking, kind="stable"), np.argsort(column, kind="stable"))
        assert -1.0 <= liking.min() <= liking.max() <= 0.0
    assert liking_of(view, "few_contacts") is None


@pytest.mark.parametrize("prefer", [("latest",), ("early", "early")])
def test_aims_are_known_and_named_once(prefer: tuple[Preference, ...]) -> None:
    with pytest.raises(InvalidScenario) as refused:
        Objective(prefer=prefer)
    assert refused.value.fault.pointer == "/objective/prefer"
