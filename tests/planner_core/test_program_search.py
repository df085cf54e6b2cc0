"""Plans by programs with drawn contacts: valid, never worse, near the optimum, repeatable."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.certified.mip.program_search import ProgramSearch
from planner_core.certified.mip.solution_pool import PlanPool, rows_of
from planner_core.certified.multipliers.energy import EnergyPaths, ascent_on_energy
from planner_core.certified.multipliers.resources import ResourceAscent
from planner_core.certified.proofs.resource_bound import whole_worth
from planner_core.certified.proofs.satellite_relaxation import relaxations
from planner_core.certified.tuning import tuned
from planner_core.domain import Dynamics
from planner_core.problem import CONTACT, Floats, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem, varied_problem

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
STARVED = replace(TIGHT, battery_min_fraction=0.5, initial_battery_fraction=0.62)
_problem = partial(varied_problem, scarce=STARVED)


class Known(NamedTuple):
    """Costs that stay constant."""

    losses: Floats


def search_of(
    problem: Problem, start: Plan, seed: int = 0, budget: Budget | None = None
) -> tuple[ProgramSearch, PlanPool]:
    budget = budget or Budget()
    paths = EnergyPaths(problem)
    energy = ascent_on_energy(problem, paths, np.zeros(len(problem.target_ids)), 30, seed)
    energy.improve(30, budget.stop)
    multipliers = ResourceAscent(problem, max(energy.value, 1.0), energy.multipliers, budget.stop)
    multipliers.step(0.0)
    pool = PlanPool(problem, budget, seed)
    pool.add(start)
    losses = np.where(paths.usage > 0.0, 0.0, np.inf)
    return ProgramSearch(problem, pool, multipliers, Known(losses), budget, seed), pool


@examples(40)
@given(seed=SEEDS, dynamics=DYNAMICS, num_satellites=st.integers(2, 3))
def test_plans_stay_valid_and_below_the_optimum(
    seed: int, dynamics: Dynamics, num_satellites: int
) -> None:
    problem = _problem(seed, dynamics, num_satellites)
    start = Rule().solve(problem, Budget(), 0).plan
    search, pool = search_of(problem, start, seed)
    rewards = [pool.reward]
    for _ in range(10):
        search.step()
        rewards.append(pool.reward)
    timeline = replay(problem, pool.plan)
    assert timeline.is_valid
    assert timeline.reward == pytest.approx(pool.reward)
    assert np.all(np.diff(rewards) >= 0.0)
    assert pool.reward <= best_reward(problem) + 1e-6
    again, its_pool = search_of(problem, start, seed)
    for _ in range(10):
        again.step()
    assert its_pool.plan == pool.plan


def test_small_problems_end_at_the_optimum() -> None:
    reached = 0
    for seed in range(30):
        problem = _problem(seed, "physical" if seed % 2 else "paper", 1 + seed % 3)
        search, pool = search_of(problem, Rule().solve(problem, Budget(), 0).plan)
        for _ in range(20):
            search.step()
        reached += replay(problem, pool.plan).reward == best_reward(problem)
    assert reached >= 27


def test_a_program_of_some_satellites_leaves_the_others_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(PlanPool, "merge", lambda _: None)
    with tuned(most_columns=1):
        gained = sum(_changes_of_single_satellites(seed) for seed in range(3))
    assert gained > 0


def _changes_of_single_satellites(seed: int) -> int:
    problem = random_problem(
        seed, num_collects=90, num_targets=40, num_contacts=9, num_satellites=3,
        span_s=3000.0, resources=STARVED,
    )  # fmt: skip
    problem = replace(problem, horizon_s=3100.0)
    search, pool = search_of(problem, Rule().solve(problem, Budget(), 0).plan, seed)
    gained = 0
    for _ in range(40):
        before = pool.plan
        search.step()
        changed = {*rows_of(before)} ^ {*rows_of(pool.plan)}
        assert len(set(problem.opportunities.satellite[list(changed)])) <= 1
        gained += pool.plan != before
    assert replay(problem, pool.plan).is_valid
    return gained


@examples(30)
@given(seed=SEEDS, dynamics=DYNAMICS)
def test_contacts_fixed_anew_are_worth_what_a_new_program_says(
    seed: int, dynamics: Dynamics
) -> None:
    problem = random_problem(
        seed, num_collects=30, num_targets=15, num_contacts=5, num_satellites=2, dynamics=dynamics
    )
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    contacts = np.flatnonzero(problem.opportunities.kind == CONTACT)
    rng = np.random.default_rng(seed)
    program = FixedContacts(problem, every, (), Budget(), 0, tuple(contacts.tolist()))
    for _ in range(4):
        some = tuple(contacts[rng.random(len(contacts)) < 0.4].tolist())
        program.fix(some)
        alone = FixedContacts(problem, every, some, Budget(), 0).relaxed()
        # Cuts found for earlier sets hold for all: they may make it lower.
        assert program.relaxed() <= alone + 1e-5
        plan = FixedContacts(problem, every, some, Budget(), 0).plan(0.0)
        if plan is not None and replay(problem, plan).is_valid:
            assert program.relaxed() >= replay(problem, plan).reward - 1e-5


@examples(40)
@given(seed=SEEDS, dynamics=DYNAMICS)
def test_what_is_shut_is_on_no_path(seed: int, dynamics: Dynamics) -> None:
    problem = _problem(seed, dynamics)
    worth = whole_worth(problem, np.zeros(len(problem.target_ids)), 1.0)
    stop = Budget().stop
    for relaxation in relaxations(problem):
        is_shut = np.random.default_rng(seed).random(len(relaxation.satellite)) < 0.3
        most, path = relaxation.most(worth, 1.0, 0, stop, keeps_path=True)
        less, other = relaxation.without(is_shut).most(worth, 1.0, 0, stop, keeps_path=True)
        assert path is not None
        assert other is not None
        assert not is_shut[other].any()
        assert less <= most
        if not is_shut[path].any():
            assert less == most


def test_a_search_that_is_stopped_keeps_its_plan() -> None:
    problem = random_problem(3, num_collects=60, num_targets=30, num_contacts=6, num_satellites=2)
    plan = Rule().solve(problem, Budget(), 0).plan
    budget = Budget()
    search, pool = search_of(problem, plan, budget=budget)
    budget.cancel()
    for _ in range(5):
        search.step()
    pool.merge()
    assert pool.plan == plan
