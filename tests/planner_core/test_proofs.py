"""Bounds by agility alone, of problems in which plans earn multiples of a smaller unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.missions import paper_scenario, problem_of
from planner_core.budget import Budget
from planner_core.certified.multipliers.resources import ResourceAscent
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.certificate import Certificate, Multipliers, Refutation
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.lagrangian import lagrangian_value
from planner_core.domain import Objective, Resources
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.delivery import with_objective
from planner_core.solvers.rule import Rule
from tests.planner_core.problems import Task, make_problem


def _two_of_three_images() -> Problem:
    """Return a problem whose plans take two whole images, of which each may lose a tenth."""
    tasks = [
        Task(kind=COLLECT, site=site, start_s=at_s, end_s=at_s + 30.0)
        for site, at_s in enumerate([100.0, 200.0, 210.0])
    ]
    tasks.append(Task(kind=CONTACT, site=0, start_s=400.0, end_s=500.0))
    resources = replace(
        Resources.limitless(),
        collect_fill_per_s=0.001,
        downlink_per_s=0.001,
        initial_recorder_fraction=0.0,
    )
    problem = make_problem(tasks, num_targets=3, resources=resources)
    return with_objective(problem, Objective(collected_share=0.9))


@pytest.mark.parametrize("is_elementary", [False, True])
def test_what_agility_allows_is_rounded_in_its_own_unit(is_elementary: bool) -> None:
    problem = _two_of_three_images()
    assert problem.reward_unit < 1.0
    multipliers = np.array([0.0, 0.25, 0.25])
    assert lagrangian_value(problem, multipliers)[0] == pytest.approx(2.25)
    bound = Bound(
        value=2.0, proof="lagrangian", multipliers=multipliers, is_elementary=is_elementary
    )
    assert is_proven(problem, from_json(to_json(bound)))
    assert not is_proven(problem, replace(bound, value=1.9))
    assert not is_proven(problem, replace(bound, multipliers=np.ones(3)))


def test_an_amount_that_no_plan_reaches_by_agility_leaves_the_next_one_below() -> None:
    problem = _two_of_three_images()
    steps = (Multipliers(of_targets=np.array([0.0, 0.25, 0.25])),)
    certificate = Certificate(amount=3.0, refutation=Refutation(steps=steps))
    bound = Bound(value=2.0, proof="lagrangian", certificate=certificate)
    assert is_proven(problem, from_json(to_json(bound)))
    assert not is_proven(problem, replace(bound, value=1.9))
    too_low = replace(certificate, amount=2.0)
    assert not is_proven(problem, replace(bound, certificate=too_low))


def test_what_a_search_proves_by_knowing_its_goal_is_proven_without() -> None:
    """Images that earn a share on board are split at an instant, which depends on the goal."""
    scenario = paper_scenario(40, 0, use_resources=True)
    problem = problem_of(replace(scenario, objective=Objective(collected_share=0.9)))
    half = 0.5 * problem.best_worth
    ascent = ResourceAscent(problem, float(problem.best_worth.sum()), half, np.zeros(1, np.uint8))
    ascent.learn(Rule().solve(problem, Budget(), 0).plan)
    for _ in range(11):
        assert ascent.step(0.0)
        bound = ascent.bound()
        assert is_proven(problem, from_json(to_json(bound)))
        assert not is_proven(problem, replace(bound, value=0.99 * bound.value))
