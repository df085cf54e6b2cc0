"""Programs with fixed contacts: their values, the multipliers proving them, valid plans."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.dp.resource_network import (
    cost_on_board,
    strict_network_of,
    worth_before_left,
)
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip import highs
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.certified.proofs.resource_bound import resource_value
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.tuning import TUNING
from planner_core.domain import Agility, Dynamics, Objective
from planner_core.problem import CONTACT, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Milp
from tests.examples import examples
from tests.planner_core.problems import random_problem, sunny_problem

SEEDS = st.integers(0, 10**6)


def _contacts(problem: Problem, plan: Plan) -> tuple[int, ...]:
    rows = sorted(action.opportunity for action in plan.actions)
    return tuple(row for row in rows if problem.opportunities.kind[row] == CONTACT)


@examples(40)
@given(
    seed=SEEDS,
    dynamics=st.sampled_from(["physical", "paper"]),
    num_satellites=st.integers(1, 2),
    is_slow=st.booleans(),
)
def test_the_best_plan_is_found_from_its_contacts(
    seed: int, dynamics: Dynamics, num_satellites: int, is_slow: bool
) -> None:
    problem = random_problem(
        seed, dynamics=dynamics, num_satellites=num_satellites, num_collects=14, num_targets=9,
        num_contacts=4, has_rewards=seed % 2 == 0,
        agility=Agility(slew_rate_deg_s=0.3) if is_slow else Agility(),
        max_turn_deg=20.0 if is_slow else 0.0,
    )  # fmt: skip
    best = Milp().solve(problem, Budget(), 0).plan
    reward = replay(problem, best).reward
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    program = FixedContacts(problem, every, _contacts(problem, best), Budget(), 0)
    relaxed = program.relaxed()
    assert relaxed >= reward - 1e-5
    plan = program.plan(reward)
    assert plan is not None
    timeline = replay(problem, plan)
    assert timeline.is_valid
    assert timeline.reward == pytest.approx(reward)
    assert _contacts(problem, plan) == _contacts(problem, best)


@pytest.mark.parametrize("is_sunny", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_an_interior_point_leads_to_as_good_a_corner(
    seed: int, is_sunny: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if is_sunny:
        problem = sunny_problem(seed, num_collects=30, is_moving=False)
    else:
        problem = random_problem(seed, num_collects=30, num_targets=20, has_rewards=True)
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    by_simplex = FixedContacts(problem, every, (), Budget(), 0).relaxed()
    monkeypatch.setattr(highs, "LARGE_PROGRAM", 0)
    from_inside = FixedContacts(problem, every, (), Budget(), 0).relaxed()
    assert from_inside == pytest.approx(by_simplex, rel=1e-6)
    assert from_inside > 0.0


@examples(20)
@given(seed=SEEDS, dynamics=st.sampled_from(["physical", "paper"]))
def test_multipliers_from_amid_prove_what_a_corner_is_worth(seed: int, dynamics: Dynamics) -> None:
    problem = random_problem(
        seed, dynamics=dynamics, num_collects=40, num_targets=20, num_contacts=0
    )
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    relaxation = FixedContacts(problem, every, (), Budget(), 0).relaxation()
    corner = FixedContacts(problem, every, (), Budget(), 0).relaxed()
    assert relaxation.value == pytest.approx(corner, rel=0.02)
    assert np.all((relaxation.multipliers >= 0.0) & (relaxation.multipliers <= problem.best_worth))
    # Without contacts the bound by paths is as tight as the linear program's.
    proven = resource_value(problem, relaxation.multipliers, 1e-3)
    assert proven <= relaxation.value + 0.05
    assert np.all(np.isfinite(relaxation.losses))


def test_contacts_that_exclude_each_other_leave_nothing() -> None:
    problem = random_problem(3, num_collects=10, num_contacts=8)
    contacts = tuple(int(r) for r in np.flatnonzero(problem.opportunities.kind == CONTACT))
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    relaxation = FixedContacts(problem, every, contacts, Budget(), 0).relaxation()
    assert relaxation.value == -np.inf
    assert np.all(np.isinf(relaxation.losses))


def _shared(
    seed: int, dynamics: Dynamics, num_satellites: int, collected_share: float, num_collects: int
) -> Problem:
    problem = random_problem(
        seed, dynamics=dynamics, num_satellites=num_satellites, num_collects=num_collects,
        num_targets=num_collects // 2, num_contacts=3, has_quality=seed % 2 == 0,
    )  # fmt: skip
    return with_objective(problem, Objective(collected_share=collected_share))


@examples(60)
@given(
    seed=SEEDS,
    dynamics=st.sampled_from(["physical", "paper"]),
    num_satellites=st.integers(1, 2),
    collected_share=st.sampled_from([0.2, 0.9]),
)
def test_programs_count_what_stays_on_board_as_the_other_searches_do(
    seed: int, dynamics: Dynamics, num_satellites: int, collected_share: float
) -> None:
    problem = _shared(seed, dynamics, num_satellites, collected_share, 14)
    plan = Milp().solve(problem, Budget(), 0).plan
    taken = np.zeros(len(problem.opportunities), dtype=np.bool_)
    taken[[action.opportunity for action in plan.actions]] = True
    rows = tuple(np.flatnonzero(taken).tolist())
    none = np.zeros(len(taken), dtype=np.bool_)
    counted = float(worth_before_left(problem)[taken].sum())
    for satellite in problem.satellites:
        if len(satellite):
            network = strict_network_of(problem, satellite)
            counted -= cost_on_board(network, taken[satellite.rows])
    program = FixedContacts(problem, none, rows, Budget(), 0)
    assert program.relaxed() == pytest.approx(counted, abs=1e-5)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
def test_the_contacts_of_the_best_plan_lead_to_others(dynamics: Dynamics) -> None:
    """From a good plan's contacts and one of its images, the search finds a plan as good."""
    num_better = 0
    for seed in range(8):
        problem = _shared(seed, dynamics, 1 + seed % 2, 0.5, 24)
        good = Milp().solve(problem, Budget(), 0).plan
        kind = problem.opportunities.kind
        images = [a for a in good.actions if kind[a.opportunity] != CONTACT]
        few = Plan(tuple(a for a in good.actions if a not in images[1:]))
        best = Incumbent(problem, Budget(), 0.0)
        if not best.offer(few):
            continue
        search = ResourceSearch(best, seed)
        before = best.reward
        while search.fix_own_contacts():
            assert best.reward > before
            before = best.reward
        # With less room than this between plan and bound, the next image is hard to find.
        room = TUNING.room * problem.typical_worth
        assert best.reward >= replay(problem, good).reward - room
        num_better += best.reward > replay(problem, few).reward
    assert num_better >= 4
