"""Multipliers with recorders alone: label setting finds the best path; no plan beats the bound."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.dp.data_labels import most_by_data
from planner_core.certified.dp.data_levels import DataLevels, data_levels
from planner_core.certified.dp.resource_network import Network, network_of
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.multipliers.ascent import Ascent, Steps
from planner_core.certified.multipliers.data import DataPaths
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.domain import Objective
from planner_core.problem import Floats, Problem
from planner_core.problem.delivery import with_objective
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem, varied_problem

SEEDS = st.integers(0, 10**6)
ROOMY = replace(TIGHT, battery_min_fraction=0.0, initial_battery_fraction=1.0)
_problem = partial(varied_problem, scarce=ROOMY)
Dynamics = Literal["physical", "paper"]


def best_by_enumeration(
    network: Network, levels: DataLevels, weight: Floats, end_cost: Floats
) -> float:
    """Return the most that any path gains, by enumeration."""

    def from_here(last: int, level: int) -> float:
        best = -float(end_cost[level]) if level <= levels.end else -np.inf
        for k in range(last + 1, len(weight)):
            near = network.near_rows[network.near_first[last] : network.near_first[last + 1]]
            if last >= 0 and k < network.idle_from[last] and k not in near:
                continue
            if weight[k] <= 0.0 and not network.is_contact[k]:
                continue
            to = max(int(levels.floor[k]), level + int(levels.gain[k]), 0)
            if level <= levels.before[k] and to <= levels.after[k]:
                best = max(best, float(weight[k]) + from_here(k, to))
        return best

    return from_here(-1, levels.start)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(150)
@given(seed=SEEDS, per_collect=st.sampled_from([1, 2, 8]))
def test_the_programme_finds_the_best_path(dynamics: Dynamics, seed: int, per_collect: int) -> None:
    problem = _problem(seed, dynamics)
    network = network_of(problem, problem.satellites[0])
    levels = data_levels(network, per_collect, is_optimistic=True)
    rng = np.random.default_rng(seed)
    m = len(problem.opportunities)
    weight = np.where(network.is_contact, 0.0, rng.uniform(-0.3, 1.0, m))
    end_cost = np.sort(rng.uniform(0.0, 2.0, levels.num_levels))
    shape = m, levels.num_levels
    own, source = np.empty(shape), np.empty(shape, dtype=np.int32)
    value, path = most_by_data(network, levels, weight, end_cost, own, source)
    assert value == pytest.approx(best_by_enumeration(network, levels, weight, end_cost))
    level = levels.start
    for k in path:
        assert level <= levels.before[k]
        level = max(levels.floor[k], level + levels.gain[k], 0)
        assert level <= levels.after[k]
    assert weight[path].sum() - end_cost[level] == pytest.approx(value)
    assert np.all(np.diff(path) > 0)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(100)
@given(
    seed=SEEDS, num_satellites=st.integers(1, 2), collected_share=st.sampled_from([0.2, 0.9]),
    has_quality=st.booleans(),
)  # fmt: skip
def test_no_plan_beats_the_multipliers(
    dynamics: Dynamics, seed: int, num_satellites: int, collected_share: float, has_quality: bool
) -> None:
    problem = _problem(seed, dynamics, num_satellites, num_contacts=2, has_quality=has_quality)
    problem = with_objective(problem, Objective(collected_share=collected_share))
    paths = DataPaths.of(problem)
    if paths is None:
        return
    steps = Steps(first=0.2, last=1e-3, num_epochs=30)
    begin = np.zeros(len(problem.target_ids))
    ascent = Ascent(paths, problem.best_worth, begin, steps, seed)
    ascent.improve(30, Budget().stop)
    assert ascent.value >= best_reward(problem) - 1e-6


def test_where_few_images_come_down_the_bound_knows_by_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Batteries do not bind, and the exact dynamic programmes converge too slowly."""

    def bound_of(problem: Problem) -> float:
        search = ResourceSearch(Incumbent(problem, Budget(), 0.0), 0)
        search.ascend(search.resource_ascent, 1)
        return search.best.bound.value

    resources = replace(
        ROOMY,
        collect_drain_per_s=1e-4,
        contact_drain_per_s=1e-5,
        recorder_max_fraction=1.0,
        initial_recorder_fraction=0.0,
        collect_fill_per_s=5e-4,
        downlink_per_s=1e-3,
        telemetry_per_s=1e-6,
    )
    with_data = without = 0.0
    for seed in range(2):
        problem = random_problem(
            seed, num_collects=120, num_targets=60, num_contacts=4, resources=resources
        )
        problem = with_objective(problem, Objective(collected_share=0.5))
        with_data += bound_of(problem)
        with monkeypatch.context() as patched:
            patched.setattr(
                ResourceSearch, "ask_data", lambda _, energy: (energy.value, energy.multipliers)
            )
            without += bound_of(problem)
    assert with_data < 0.98 * without
