"""The paper's mission at the paper's size: a day with 1,000 land scenes."""

from __future__ import annotations

import functools
from dataclasses import replace

import pytest

from benchmarks.missions import paper_scenario, problem_of
from benchmarks.objective import document
from benchmarks.paper.settings import MCTS_TUNED, PAPER_FORWARD, PAPER_MCTS, make_solver
from planner_core.budget import Budget, Termination
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.proofs import documents as proofs
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.certified.strategies.resources import choices
from planner_core.domain import Dynamics, GroundStation
from planner_core.problem import ACCESS_FOUND, Problem
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import (
    Certified,
    ForwardSearch,
    Graph,
    Mcts,
    Milp,
    Rule,
)
from service.scenarios.translate import scenario_from_content
from tests.planner_core.budgets import bounds_told, expiring

pytestmark = pytest.mark.full_size

TARGETS = 1000
HARD = {"feasibility": "hard"}


@functools.cache
def day(*, use_resources: bool, dynamics: Dynamics = "physical") -> Problem:
    return problem_of(
        paper_scenario(TARGETS, 2, use_resources=use_resources, dynamics=dynamics, preset="paper")
    )


def judged(problem: Problem, solver: Solver) -> Timeline:
    timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
    assert timeline.is_valid, timeline.violations[:3]
    return timeline


def test_without_resources_every_method_stands_where_it_should() -> None:
    problem = day(use_resources=False)
    solution = Milp().solve(problem, Budget(), 0)
    optimum = replay(problem, solution.plan).reward
    assert solution.termination is Termination.OPTIMAL
    graph, rule = (judged(problem, solver).reward for solver in (Graph(), Rule()))
    assert optimum >= graph >= rule > 0.0
    for solver in (ForwardSearch(), Mcts()):
        assert 0.95 * optimum <= judged(problem, solver).reward <= optimum


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
def test_with_resources_the_improved_search_leads_the_papers_methods(dynamics: Dynamics) -> None:
    problem = day(use_resources=True, dynamics=dynamics)
    mcts = judged(problem, Mcts()).reward
    paper_mcts = make_solver("mcts", {**PAPER_MCTS, **MCTS_TUNED[True], **HARD})
    paper_forward = make_solver("forward_search", {**PAPER_FORWARD, **HARD})
    for other in (paper_mcts, paper_forward):
        assert judged(problem, other).reward < mcts, other
    assert judged(problem, ForwardSearch()).reward <= mcts


def test_many_stations_cost_no_images() -> None:
    """Some contact is always available, and each costs the energy of many images."""
    scenario = paper_scenario(300, 2, use_resources=True)
    stations = tuple(
        GroundStation(id=f"g{lat}/{lon}", name="", lat_deg=lat, lon_deg=lon)
        for lat in (75, -70)
        for lon in range(0, 360, 30)
    )
    problem = problem_of(replace(scenario, ground_stations=stations))
    rule = judged(problem, Rule()).reward
    patient = ForwardSearch(contact_above_fraction=0.45)
    assert judged(problem, patient).reward >= rule
    assert judged(problem, Mcts(contact_above_fraction=0.45)).reward >= rule
    assert judged(problem, ForwardSearch()).reward < 0.9 * rule


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
def test_with_resources_the_bound_of_the_program_is_true(dynamics: Dynamics) -> None:
    """Even if cut short it has proven a bound, and no solver's plan exceeds it."""
    problem = day(use_resources=True, dynamics=dynamics)
    solution = Milp().solve(problem, expiring(bounds_told(2)), 0)
    own = replay(problem, solution.plan)
    assert own.is_valid
    assert solution.bound is not None
    others = (Rule(), Graph(), ForwardSearch(), Mcts())
    best = max(own.reward, *(judged(problem, solver).reward for solver in others))
    assert solution.bound >= best


def test_many_collects_of_each_access_are_planned_as_well() -> None:
    """More than five times the opportunities, and more images than with one collect per access."""
    scenario = paper_scenario(TARGETS, 2, use_resources=False)
    spaced = problem_of(replace(scenario, collect_spacing_s=15.0))
    plain = day(use_resources=False)
    assert len(spaced.opportunities) > 5 * len(plain.opportunities)
    for solver in (Rule(), ForwardSearch(), Graph(), Mcts()):
        assert judged(spaced, solver).reward > judged(plain, solver).reward


def test_a_choice_of_starts_is_planned_near_its_bound() -> None:
    scenario = replace(paper_scenario(TARGETS, 2, use_resources=False), collect_spacing_s=15.0)
    problem = problem_of(scenario)
    solution = Certified(moves_per_task=0.3).solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert solution.bound is not None
    assert timeline.reward <= solution.bound <= timeline.reward / 0.95
    assert solution.proven is not None
    assert proofs.is_proven(problem, solution.proven)
    assert judged(problem, ForwardSearch()).reward <= solution.bound
    # Its program would take gigabytes: the answer is the plan it would have started from.
    milp = Milp(formulation="pairwise", moves_per_task=0.1).solve(problem, Budget(), 0)
    assert milp.bound is None
    assert replay(problem, milp.plan).is_valid


def test_where_all_targets_fit_in_that_is_proven() -> None:
    scenario = replace(paper_scenario(500, 2, use_resources=False), collect_spacing_s=15.0)
    problem = problem_of(scenario)
    solution = Certified().solve(problem, Budget(), 0)
    assert solution.termination is Termination.OPTIMAL
    reward = replay(problem, solution.plan).reward
    assert solution.bound == reward == (problem.target_access == ACCESS_FOUND).sum()


@pytest.mark.parametrize("share", [0.5, 0.1])
def test_shares_begin_with_the_plan_for_images_where_agility_alone_decides(share: float) -> None:
    """Images account for most of the worth, whenever they are downlinked."""
    images, shares = (
        problem_of(scenario_from_content(document(1, own, None))) for own in (1.0, share)
    )
    plan = Certified().solve(images, Budget(), 0).plan
    best = Incumbent(shares, Budget(), 0.01)
    best.lower(quick_bound(shares, best.reward))
    search = Search(best, 0, STRATEGIES)
    for _ in choices(search):
        pass
    assert best.reward >= 0.98 * replay(shares, plan).reward
