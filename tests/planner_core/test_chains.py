"""Longest paths: covering arcs say the same as the whole table, with fewer pairs."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Agility
from planner_core.precedence.arcs import covering_arcs
from planner_core.precedence.chains import chain_with_history, heaviest_chain
from planner_core.precedence.relation import direct_precedence
from planner_core.problem import COLLECT, Bools, SatelliteProblem
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Graph
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import Task, make_problem, random_problem

SEEDS = st.integers(0, 10**6)


@examples(60)
@given(seed=SEEDS, num_collects=st.integers(0, 60), span_s=st.sampled_from([300.0, 5000.0]))
def test_arcs_are_the_pairs_with_nothing_in_between(
    seed: int, num_collects: int, span_s: float
) -> None:
    problem = random_problem(seed, num_collects=num_collects, span_s=span_s, use_resources=False)
    satellite = problem.satellites[0]
    arcs = covering_arcs(direct_precedence(satellite))
    m = len(satellite)
    found = np.zeros((m, m), dtype=np.bool_)
    found[np.repeat(np.arange(m), np.diff(arcs.first)), arcs.to] = True
    assert (found == _nothing_between(satellite)).all()


def _nothing_between(satellite: SatelliteProblem) -> Bools:
    """Return the pairs that may follow each other without a third task between. Shape (m, m)."""
    m = len(satellite)
    follows = np.array(
        [[a < b and satellite.transitions.allows(a, b) for b in range(m)] for a in range(m)],
        dtype=np.int64,
    ).reshape(m, m)
    covering: Bools = (follows == 1) & (follows @ follows == 0)
    return covering


@examples(60)
@given(seed=SEEDS)
def test_of_chains_as_heavy_the_one_handed_on_first_counts(seed: int) -> None:
    """Values and tasks are passed along the arcs; a task of no worth passes on what it received."""
    problem = random_problem(
        seed, num_collects=40, num_targets=30, use_resources=False, span_s=1500.0
    )
    satellite = problem.satellites[0]
    covering = _nothing_between(satellite)
    weight = np.random.default_rng(seed).integers(0, 3, 40).astype(np.float64)
    chains: list[tuple[float, list[int]]] = [(0.0, [])] * 40
    best: tuple[float, list[int]] = (0.0, [])
    for a in range(40):
        if weight[a] > 0.0:
            chains[a] = chains[a][0] + weight[a], [*chains[a][1], a]
        best = chains[a] if chains[a][0] > best[0] else best
        for b in np.flatnonzero(covering[a]):
            chains[b] = chains[a] if chains[a][0] > chains[b][0] else chains[b]
    assert heaviest_chain(satellite, weight) == best[1]


@examples(60)
@given(seed=SEEDS, slew_rate_deg_s=st.sampled_from([1.0, 0.3]))
def test_chains_are_as_heavy_as_those_of_the_listing(seed: int, slew_rate_deg_s: float) -> None:
    """Alg. 3 in plain Python, over all pairs; tasks of no worth are in no chain."""
    problem = random_problem(
        seed, num_collects=40, num_targets=30, use_resources=False, max_turn_deg=25.0,
        agility=Agility(slew_rate_deg_s=slew_rate_deg_s), span_s=1500.0,
    )  # fmt: skip
    satellite = problem.satellites[0]
    allows = satellite.transitions.allows
    weight = np.maximum(0.0, np.random.default_rng(seed).uniform(-0.5, 1.0, 40))
    value = np.zeros(40)
    for b in range(40):
        earlier = [value[a] for a in range(b) if weight[a] > 0.0 and allows(a, b)]
        value[b] = weight[b] + max(earlier, default=0.0)
    chain = heaviest_chain(satellite, weight)
    assert weight[chain].sum() == pytest.approx(value[weight > 0.0].max(initial=0.0))
    for tasks in (chain, chain_with_history(satellite, weight, satellite.site)):
        assert (weight[tasks] > 0.0).all()
        assert all(allows(a, b) for a, b in itertools.pairwise(tasks))
    assert len(set(satellite.site[tasks])) == len(tasks)


@examples(60)
@given(seed=SEEDS)
@pytest.mark.parametrize("path", ["history", "longest"])
def test_graph_finds_the_optimum_where_no_target_comes_twice(path: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    starts_s = rng.uniform(0.0, 400.0, 9).round(3)
    tasks = [
        Task(kind=COLLECT, site=i, start_s=float(s), end_s=float(s) + 30.0,
             angle_deg=float(rng.uniform(-55.0, 55.0)))
        for i, s in enumerate(starts_s)
    ]  # fmt: skip
    rewards = [float(reward) for reward in rng.integers(0, 9, 9)]
    problem = make_problem(tasks, num_targets=9, use_resources=False, rewards=rewards)
    plan = Graph(path=path).solve(problem, Budget(), 0).plan  # type: ignore[arg-type]
    timeline = replay(problem, plan)
    assert timeline.is_valid
    assert timeline.reward == best_reward(problem)
