"""The ascent: any multipliers bound all plans, and the ascent ends close to the best ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.certified.multipliers.ascent import Ascent, Latest, OneByOne, Steps
from planner_core.certified.multipliers.paths import Paths, ascent_on_paths
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.lagrangian import lagrangian_bound, lagrangian_value
from planner_core.domain import Agility
from planner_core.precedence.network import heaviest_paths, network_of
from planner_core.problem import Floats, Ints, Problem
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import random_problem

SEEDS = st.integers(0, 10**6)
GO_ON = np.zeros(1, dtype=np.uint8)


def crowded(seed: int, num_satellites: int) -> Problem:
    """Return a fleet that competes for targets."""
    return random_problem(
        seed, use_resources=False, num_collects=60 * num_satellites, num_targets=30,
        num_satellites=num_satellites, has_rewards=seed % 2 == 0, max_turn_deg=25.0,
    )  # fmt: skip


def settled(problem: Problem, num_epochs: int) -> tuple[float, Floats]:
    """Return the bound after this number of epochs, and the multipliers."""
    ascent = ascent_on_paths(problem, network_of(problem), num_epochs, 0)
    ascent.run(0.0, GO_ON)
    return ascent.value, ascent.multipliers


def best_known(problem: Problem) -> float:
    """Return the best bound of many plain subgradient steps, each over all satellites at once."""
    most = problem.best_worth
    now, best = 0.5 * most, np.inf
    for number in range(1, 2001):
        value, counts = lagrangian_value(problem, now)
        best = min(best, value)
        now = np.clip(now + 0.3 / np.sqrt(number) * most * (counts - 1.0), 0.0, most)
    return best


@examples(80)
@given(
    seed=SEEDS, num_satellites=st.integers(2, 3), has_rewards=st.booleans(),
    slew_rate_deg_s=st.sampled_from([1.0, 0.3]), num_epochs=st.sampled_from([0, 1, 7, 60]),
)  # fmt: skip
def test_no_plan_of_a_fleet_beats_them(
    seed: int, num_satellites: int, has_rewards: bool, slew_rate_deg_s: float, num_epochs: int
) -> None:
    problem = random_problem(
        seed, use_resources=False, num_satellites=num_satellites, has_rewards=has_rewards,
        num_collects=10, agility=Agility(slew_rate_deg_s=slew_rate_deg_s), max_turn_deg=25.0,
    )  # fmt: skip
    best = best_reward(problem)
    value, multipliers = settled(problem, num_epochs)
    assert value >= best - 1e-9
    proven, _ = lagrangian_value(problem, multipliers)
    assert proven == pytest.approx(value)
    bound = Bound(
        value=rounded_bound(problem, value, 0.0), proof="lagrangian", multipliers=multipliers
    )
    assert is_proven(problem, from_json(to_json(bound)))
    assert lagrangian_bound(problem, 0.0).value >= best - 1e-9


class PlainPaths(OneByOne):
    """Same as ``Paths``, one answer at a time."""

    def __init__(self, problem: Problem) -> None:
        self._network = network_of(problem)
        self._worth = problem.worth[self._network.row]
        num_parts = len(self._network.first) - 1
        self.parts = np.flatnonzero(np.diff(self._network.first)).astype(np.int32)
        self._latest = Latest(num_parts)
        self._ends = np.empty(num_parts, dtype=np.int32)

    def answer(self, part: int, multipliers: Floats, count: Ints) -> None:
        weight, previous, _ = self._longest(multipliers)
        targets, at = [], self._ends[part]
        while at >= 0:
            if weight[at] > 0.0:
                targets.append(self._network.site[at])
            at = previous[at]
        self._latest.replace(part, np.array(targets, dtype=np.int32), count)

    def gain(self, multipliers: Floats) -> float:
        return self._longest(multipliers)[2]

    def _longest(self, multipliers: Floats) -> tuple[Floats, Ints, float]:
        weight = np.maximum(self._worth - multipliers[self._network.site], 0.0)
        value, previous = np.empty(len(weight)), np.empty(len(weight), dtype=np.int32)
        gain = heaviest_paths(self._network, weight, value, previous, self._ends)
        return weight, previous, gain


@examples(40)
@given(seed=SEEDS, num_satellites=st.integers(1, 4))
def test_epochs_in_a_kernel_are_those_of_answers_one_by_one(seed: int, num_satellites: int) -> None:
    problem = crowded(seed, num_satellites)
    steps = Steps(first=0.3, last=0.1, num_epochs=20)
    begin = 0.5 * problem.best_worth
    quick, plain = (
        Ascent(oracle, problem.best_worth, begin, steps, seed)
        for oracle in (Paths(problem, network_of(problem)), PlainPaths(problem))
    )
    for ascent in (quick, plain):
        ascent.run(0.0, GO_ON)
    assert quick.value == plain.value
    assert quick.multipliers.tolist() == plain.multipliers.tolist()
    assert quick.mean.tolist() == plain.mean.tolist()


@pytest.mark.parametrize("num_satellites", [2, 4, pytest.param(8, marks=pytest.mark.full_size)])
def test_they_settle_near_the_best(num_satellites: int) -> None:
    for seed in range(6):
        problem = crowded(seed, num_satellites)
        value, _ = settled(problem, 300)
        assert value <= 1.003 * best_known(problem)


def test_the_same_multipliers_come_out_again() -> None:
    problem = crowded(1, 4)
    first, again = (settled(problem, 40) for _ in range(2))
    assert first[0] == again[0]
    np.testing.assert_array_equal(first[1], again[1])


def test_targets_without_access_cost_nothing() -> None:
    problem = crowded(2, 3)
    wider = replace(problem, target_ids=(*problem.target_ids, "far"))
    value, multipliers = settled(wider, 40)
    assert value == settled(problem, 40)[0]
    assert multipliers[-1] == 0.0
