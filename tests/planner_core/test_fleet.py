"""Fleets without resources: brute force, true bounds, the same plan with any number of threads."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Termination
from planner_core.certified.driver import Effort
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.fleet_start import start_at_multipliers
from planner_core.certified.lns.search import WindowSearch
from planner_core.certified.mip.solution_pool import PlanPool
from planner_core.certified.multipliers.paths import ascent_on_paths
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.strategies.every import solved
from planner_core.certified.strategies.fleet import FleetSearch
from planner_core.certified.tuning import tuned
from planner_core.domain import Agility
from planner_core.precedence.network import heaviest_paths, network_of
from planner_core.precedence.relation import direct_precedence
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified, Milp
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import random_problem

SEEDS = st.integers(0, 10**6)


def fleet(seed: int, slew_rate_deg_s: float = 1.0) -> Problem:
    """Return a crowded fleet that competes for targets."""
    return random_problem(
        seed, use_resources=False, num_collects=240, num_targets=90, num_satellites=8,
        has_rewards=seed % 2 == 0, max_turn_deg=25.0,
        agility=Agility(settle_s=15.0, slew_rate_deg_s=slew_rate_deg_s),
    )  # fmt: skip


def searched(problem: Problem, budget: Budget, seed: int) -> FleetSearch:
    """Return a search that has completed all its steps."""
    search = FleetSearch(Incumbent(problem, budget, 0.0), seed)
    search.ascend()
    search.start()
    for _ in search.search(20.0):
        pass
    return search


@examples(60)
@given(
    seed=SEEDS, num_satellites=st.integers(2, 4), has_rewards=st.booleans(),
    num_offers=st.integers(1, 2), slew_rate_deg_s=st.sampled_from([1.0, 0.3]),
)  # fmt: skip
def test_small_fleets_are_planned_as_brute_force_does(
    seed: int, num_satellites: int, has_rewards: bool, num_offers: int, slew_rate_deg_s: float
) -> None:
    problem = random_problem(
        seed, use_resources=False, num_satellites=num_satellites, has_rewards=has_rewards,
        num_collects=10 // num_offers, num_offers=num_offers, span_s=400.0, max_turn_deg=25.0,
        agility=Agility(slew_rate_deg_s=slew_rate_deg_s),
    )  # fmt: skip
    best = best_reward(problem)
    search = searched(problem, Budget(), seed)
    assert search.best.reward == replay(problem, search.best.plan).reward
    assert search.best.reward <= best + 1e-9
    proven = search.best.solution().proven
    assert proven is not None
    assert proven.value >= best - 1e-9
    assert is_proven(problem, from_json(to_json(proven)))
    for solver in (Certified(), Milp()):
        solution = solver.solve(problem, Budget(), seed)
        assert solution.termination is Termination.OPTIMAL
        assert replay(problem, solution.plan).reward == pytest.approx(best)


@examples(15)
@given(seed=SEEDS, slew_rate_deg_s=st.sampled_from([1.0, 0.3]))
def test_the_plan_is_the_same_however_many_threads_work(seed: int, slew_rate_deg_s: float) -> None:
    problem = fleet(seed, slew_rate_deg_s)
    alone, together = (
        searched(problem, Budget(num_threads=num_threads), seed) for num_threads in (1, 3)
    )
    timeline = replay(problem, alone.best.plan)
    assert not timeline.violations
    assert timeline.reward == alone.best.reward > 0.0
    assert together.best.plan == alone.best.plan
    assert together.best.bound.value == alone.best.bound.value


def test_what_streams_are_worth_together_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = fleet(3)
    best = Certified().solve(problem, Budget(), 0).plan
    known: list[int] = []

    def merge(pool: PlanPool) -> None:
        known.append(len(pool._worth))
        pool.add(best)

    monkeypatch.setattr(PlanPool, "merge", merge)
    search = FleetSearch(Incumbent(problem, Budget(), 0.0), 0)
    for _ in search.search(20.0):
        pass
    assert known[0] == 2  # one plan from each stream
    assert search.best.reward >= replay(problem, best).reward


def test_windows_end_where_a_stream_claims_more_than_the_referee_gives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(WindowSearch, "reward", 1e6)
    search = FleetSearch(Incumbent(fleet(3), Budget(), 0.0), 0)
    assert len(list(itertools.islice(search.search(20.0), 10))) < 10
    assert not search.best.is_optimal


def test_a_large_fleet_is_planned_in_one_stream() -> None:
    problem = fleet(4)
    with tuned(small_fleet=10):
        solution = Certified().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert solution.proven is not None
    assert solution.proven.multipliers is not None
    assert is_proven(problem, from_json(to_json(solution.proven)))
    assert timeline.reward <= solution.proven.value <= 1.1 * timeline.reward


def test_a_large_fleet_searches_among_what_costs_the_bound_little() -> None:
    problem = fleet(4)
    search = FleetSearch(Incumbent(problem, Budget(), 0.0), 0)
    search.ascend(80)
    network = network_of(problem)
    worth, multiplier = problem.worth[network.row], np.append(search.multipliers, 0.0)[network.site]
    n = len(worth)
    ends = np.empty(len(network.first) - 1, dtype=np.int32)

    def bound(held: int | None) -> float:
        """Return the worth of the best paths; one must contain the held task, if any."""
        weight = np.maximum(worth - multiplier, 0.0)
        if held is not None:
            weight[held] = 1e6
        value = heaviest_paths(network, weight, np.empty(n), np.empty(n, dtype=np.int32), ends)
        return value if held is None else value - 1e6 + worth[held] - multiplier[held]

    is_near = search.near_best()[network.row]
    expected = [bound(None) - bound(a) <= 0.2 * worth[a] + 1e-6 for a in range(n)]
    assert is_near.tolist() == expected
    assert 0 < np.count_nonzero(is_near) < n


def test_multipliers_make_a_better_start() -> None:
    gained = 0.0
    for seed in range(10):
        problem = fleet(seed)
        network = network_of(problem)
        worth = problem.worth[network.row]
        dual = ascent_on_paths(problem, network, 100, 0)
        dual.improve(100, Budget().stop)
        nothing = np.zeros(len(problem.target_ids) + 1, dtype=np.bool_)
        plans = [
            Plan.of(problem, start_at_multipliers(network, worth, multipliers, nothing, 0))
            for multipliers in (np.append(dual.multipliers, 0.0), np.zeros(len(nothing)))
        ]
        priced, plain = (replay(problem, plan) for plan in plans)
        assert priced.is_valid
        assert plain.is_valid
        gained += priced.reward / plain.reward - 1.0
    assert gained > 0.0


def test_who_cancels_gets_the_plan_so_far_and_its_bound() -> None:
    problem = fleet(5)
    budget = Budget()
    budget.report = lambda _: budget.cancel()
    solution = Certified().solve(problem, budget, 0)
    assert solution.termination is Termination.CANCELLED
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert timeline.reward > 0.0
    assert solution.bound is not None
    assert timeline.reward <= solution.bound <= problem.best_worth.sum()


def test_paths_of_a_fleet_need_no_table_of_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan, bound and window search of a large fleet; a table would grow with density squared."""

    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("planner_core.precedence.relation._fill_bits", refuse)
    problem = random_problem(
        5, use_resources=False, num_collects=240, num_targets=90, num_satellites=8
    )
    effort = Effort(moves_per_task=5.0, max_rounds=0)
    with tuned(small_fleet=0):
        solution = solved(problem, Budget(), 0, 0.0, effort)
    assert solution.proven is not None
    assert 0.0 < replay(problem, solution.plan).reward <= solution.proven.value
    with pytest.raises(AssertionError):
        direct_precedence(problem.satellites[0])
