"""Bounds by energy alone: label setting finds the best path, and no plan beats the bound."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.dp.energy_labels import EnergyLevels, energy_levels, most_by_energy
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.multipliers.ascent import Ascent
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.proofs.bound import rounded_bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.domain import Objective
from planner_core.problem import Floats, Problem
from planner_core.problem.delivery import with_objective
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem, varied_problem

SEEDS = st.integers(0, 10**6)
STARVED = replace(TIGHT, battery_min_fraction=0.5, initial_battery_fraction=0.62)
_problem = partial(varied_problem, scarce=STARVED)
Dynamics = Literal["physical", "paper"]


def ascent(problem: Problem, num_epochs: int, seed: int = 0) -> Ascent:
    """Return the ascent by energy alone, from zero multipliers."""
    begin = np.zeros(len(problem.target_ids))
    return ascent_on_energy(problem, EnergyPaths(problem), begin, num_epochs, seed)


def best_by_enumeration(network: Network, levels: EnergyLevels, weight: Floats) -> float:
    """Return the most that any path gains, by enumeration."""

    def from_here(last: int, energy: int) -> float:
        best = 0.0
        for k in range(last + 1, len(weight)):
            near = network.near_rows[network.near_first[last] : network.near_first[last + 1]]
            if last >= 0 and k < network.idle_from[last] and k not in near:
                continue
            left = min(energy, int(levels.cap[k])) - int(levels.cost[k])
            if weight[k] > 0.0 and left >= levels.floor[k]:
                best = max(best, float(weight[k]) + from_here(k, left))
        return best

    return from_here(-1, levels.start)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(60)
@given(seed=SEEDS, collected_share=st.sampled_from([0.0, 0.5, 1.0]))
def test_what_batteries_alone_prove_bounds_all_plans(
    dynamics: Dynamics, seed: int, collected_share: float
) -> None:
    problem = _problem(seed, dynamics, 2, num_contacts=2, has_quality=True)
    problem = with_objective(problem, Objective(collected_share=collected_share))
    search = ResourceSearch(Incumbent(problem, Budget(), 0.0), seed)
    energy = ascent(problem, 30, seed)
    search.ask_energy(energy)
    energy.ask()
    search.prove_by_energy(energy)
    bound = search.best.bound
    assert bound.value >= best_reward(problem) - 1e-9
    if bound.contact_multipliers is not None:
        assert not bound.contact_multipliers.any()
        assert bound.value <= rounded_bound(problem, energy.value, 0.0) + 1e-6
        assert is_proven(problem, from_json(to_json(bound)))
        if bound.value > 0.1:
            assert not is_proven(problem, replace(bound, value=0.98 * bound.value))


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(150)
@given(seed=SEEDS, per_collect=st.sampled_from([1, 3, 24]))
def test_the_programme_finds_the_best_path(dynamics: Dynamics, seed: int, per_collect: int) -> None:
    problem = _problem(seed, dynamics)
    network = network_of(problem, problem.satellites[0])
    levels = energy_levels(network, per_collect)
    rng = np.random.default_rng(seed)
    m = len(problem.opportunities)
    weight = rng.uniform(-0.3, 1.0, m)
    own, num_own = np.empty((m, levels.width)), np.zeros(m, dtype=np.int64)
    value, path = most_by_energy(network, levels, weight, own, num_own)
    assert value == pytest.approx(best_by_enumeration(network, levels, weight))
    assert weight[path].sum() == pytest.approx(value)
    energy = levels.start
    for k in path:
        energy = min(energy, levels.cap[k]) - levels.cost[k]
        assert energy >= levels.floor[k]
    assert np.all(np.diff(path) > 0)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(150)
@given(seed=SEEDS, num_satellites=st.integers(1, 3))
def test_no_plan_beats_the_multipliers(dynamics: Dynamics, seed: int, num_satellites: int) -> None:
    problem = _problem(seed, dynamics, num_satellites)
    search = ascent(problem, 30, seed)
    search.improve(30, Budget().stop)
    assert search.is_settled
    assert search.value >= best_reward(problem) - 1e-6
    assert np.all((search.multipliers >= 0.0) & (search.multipliers <= problem.best_worth))


def test_collects_that_cost_next_to_nothing_need_no_endless_table() -> None:
    frugal = replace(TIGHT, collect_drain_per_s=1e-12, sunpoint_charge_per_s=1e-13)
    problem = random_problem(3, num_collects=40, num_targets=20, num_satellites=2, resources=frugal)
    levels = energy_levels(network_of(problem, problem.satellites[0]), 24)
    assert levels.width < 2000
    search = ascent(problem, 20)
    search.improve(20, Budget().stop)
    free = replace(problem, use_resources=False)
    assert search.value >= replay(free, Certified().solve(free, Budget(), 0).plan).reward - 1e-6


def test_multipliers_lower_what_satellites_gain_that_share_targets() -> None:
    problem = random_problem(
        1, num_collects=120, num_targets=30, num_contacts=6, num_satellites=3, span_s=3000.0
    )
    problem = replace(problem, horizon_s=3100.0)
    search = ascent(problem, 100)
    first = search.value
    search.improve(100, Budget().stop)
    assert search.value < 0.75 * first
    again = ascent(problem, 100)
    again.improve(100, Budget().stop)
    assert again.value == search.value
    assert np.array_equal(again.multipliers, search.multipliers)
