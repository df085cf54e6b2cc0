"""The bound that pays a target once per pass: above all plans, below the plain bound, provable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.dp.elementary import (
    elementary_paths,
    elementary_value,
    labels_for,
    memory_of,
)
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.search import improved
from planner_core.certified.multipliers.elementary import ascent_on_passes
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.lagrangian import lagrangian_bound, lagrangian_value
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.domain import Agility
from planner_core.precedence.arcs import arc_network_of
from planner_core.problem import COLLECT, Floats, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import Task, make_problem, random_problem

NEVER = np.zeros(1, dtype=np.uint8)


def spaced_problem(
    seed: int, *, num_accesses: int = 3, num_offers: int = 5, span_s: float = 200.0
) -> Problem:
    """Return a problem whose accesses offer collects 9 s apart; much varies with the seed."""
    rng = np.random.default_rng(seed)
    problem = random_problem(
        seed,
        use_resources=False,
        num_collects=num_accesses,
        num_offers=num_offers,
        num_targets=max(2, num_accesses - 1),
        num_satellites=int(rng.integers(1, 3)),
        max_turn_deg=float(rng.choice([0.0, 25.0])),
        has_rewards=bool(rng.integers(2)),
        agility=Agility(
            slew_rate_deg_s=float(rng.choice([1.0, 0.3])), settle_s=float(rng.choice([0.0, 8.0]))
        ),
        span_s=span_s,
    )
    return replace(problem, horizon_s=span_s + 200.0)


def random_multipliers(problem: Problem, rng: np.random.Generator) -> Floats:
    multipliers: Floats = rng.uniform(-0.3, 1.2, len(problem.target_ids)) * problem.best_worth
    return multipliers


@examples(150)
@given(seed=st.integers(0, 10**6))
def test_whatever_the_multipliers_it_lies_between_the_optimum_and_the_plain_bound(
    seed: int,
) -> None:
    problem = spaced_problem(seed)
    rng = np.random.default_rng(seed)
    best = best_reward(problem)
    for _ in range(4):
        multipliers = random_multipliers(problem, rng)
        value, counts = elementary_value(problem, multipliers)
        plain, _ = lagrangian_value(problem, multipliers)
        assert best - 1e-9 <= value <= plain + 1e-9
        assert counts.min() >= 0


@examples(40)
@given(seed=st.integers(0, 10**6))
def test_crowded_problems_never_hold_a_better_plan(seed: int) -> None:
    """Too large for brute force: many accesses are open at once, and label bits are reused."""
    problem = spaced_problem(seed, num_accesses=40, num_offers=8, span_s=1500.0)
    reward = replay(problem, improved(problem, Plan(), 30.0, Budget(), seed)).reward
    rng = np.random.default_rng(seed)
    for _ in range(4):
        multipliers = random_multipliers(problem, rng)
        value, _ = elementary_value(problem, multipliers)
        plain, _ = lagrangian_value(problem, multipliers)
        assert reward - 1e-9 <= value <= plain + 1e-9


@examples(100)
@given(seed=st.integers(0, 10**6))
def test_it_holds_for_weights_that_differ_from_collect_to_collect(seed: int) -> None:
    """Compared with the heaviest path without repetition, found by enumeration."""
    problem = spaced_problem(seed, num_accesses=2, num_offers=4)
    network = arc_network_of(problem)
    memory = memory_of(problem, network)
    rng = np.random.default_rng(seed)
    weight = rng.uniform(0.0, 3.0, len(network.row)) * rng.integers(0, 2, len(network.row))
    by_row = np.empty(len(weight))
    by_row[network.row] = weight
    counts = np.zeros(len(problem.target_ids) + 1, dtype=np.int32)
    value = elementary_paths(network, memory, weight, labels_for(network, memory), counts)
    assert value >= heaviest_without_repetition(problem, by_row) - 1e-9


def heaviest_without_repetition(problem: Problem, worth: Floats) -> float:
    """Return the worth of the satellites' best chains that take each target at most once."""
    table, total = problem.opportunities, 0.0
    for satellite in problem.satellites:
        chains: list[tuple[float, int, frozenset[int]]] = [(0.0, -1, frozenset())]
        best = 0.0
        while chains:
            value, last, seen = chains.pop()
            best = max(best, value)
            for row in range(last + 1, len(satellite)):
                target = int(table.site[satellite.rows[row]])
                if last >= 0 and not satellite.transitions.allows(last, row):
                    continue
                gained = 0.0 if target in seen else float(worth[satellite.rows[row]])
                chains.append((value + gained, row, seen | {target}))
        total += best
    return total


def test_a_target_in_view_for_long_is_paid_once() -> None:
    """Ten collects of one access, 30 s apart: the plain bound pays for all of them."""
    tasks = [
        Task(kind=COLLECT, site=0, start_s=30.0 * k, end_s=30.0 * k + 30.0, access=0)
        for k in range(10)
    ]
    problem = make_problem(tasks, num_targets=1, use_resources=False)
    nothing = np.zeros(1)
    assert elementary_value(problem, nothing)[0] == pytest.approx(1.0)
    assert lagrangian_value(problem, nothing)[0] == pytest.approx(10.0)


def test_multipliers_get_better_and_their_proof_survives_being_written_down() -> None:
    problem = spaced_problem(5, num_accesses=60, num_offers=8, span_s=3000.0)
    first, again = (ascent_on_passes(problem, 0) for _ in range(2))
    first.improve(5, NEVER)
    before = first.value
    first.improve(100, NEVER)
    again.improve(105, NEVER)
    assert first.value < before
    assert first.value == again.value
    proven = first.multipliers
    bound = Bound(value=first.value, proof="lagrangian", multipliers=proven, is_elementary=True)
    read = from_json(to_json(bound))
    assert is_proven(problem, read)
    assert not is_proven(problem, replace(read, value=first.value - 1.5))
    assert not is_proven(problem, replace(read, is_elementary=False))


def test_the_quick_bound_pays_a_target_once_in_each_pass() -> None:
    problem = spaced_problem(6, num_accesses=60, num_offers=8, span_s=3000.0)
    reward = replay(problem, improved(problem, Plan(), 10.0, Budget(), 0)).reward
    bound = lagrangian_bound(problem, reward)
    assert bound.value >= reward
    assert bound.is_elementary
    assert is_proven(problem, bound)


@pytest.mark.parametrize("seed", [0, 3, 12])
def test_a_fleet_s_bound_pays_a_target_once_in_each_pass_too(seed: int) -> None:
    """It is below that of plain paths, which give a fleet's multipliers."""
    problem = spaced_problem(seed, num_accesses=60, num_offers=8, span_s=1000.0)
    assert sum(len(satellite) > 0 for satellite in problem.satellites) == 2

    def bound(*names: str) -> Bound:
        best = Incumbent(problem, Budget(), 0.0)
        Search(best, 0, [one for one in STRATEGIES if one.name in names]).solved()
        return best.bound

    plain = bound("rule", "multipliers of a fleet's paths")
    once = bound("rule", "multipliers of a fleet's paths", "multipliers of a fleet's passes")
    assert once.is_elementary
    assert not plain.is_elementary
    assert once.value < plain.value
    reward = replay(problem, improved(problem, Plan(), 10.0, Budget(), 0)).reward
    assert once.value >= reward
    assert is_proven(problem, once)
