"""Programs with fixed contacts: true values, prices that prove them, and plans that keep them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.certified.proofs.resource_bound import resource_value
from planner_core.domain import Agility, Dynamics
from planner_core.problem import CONTACT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Milp
from tests.examples import examples
from tests.planner_core.problems import random_problem

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


@examples(20)
@given(seed=SEEDS, dynamics=st.sampled_from(["physical", "paper"]))
def test_prices_from_amid_prove_what_a_corner_is_worth(seed: int, dynamics: Dynamics) -> None:
    problem = random_problem(
        seed, dynamics=dynamics, num_collects=40, num_targets=20, num_contacts=0
    )
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    relaxation = FixedContacts(problem, every, (), Budget(), 0).relaxation()
    corner = FixedContacts(problem, every, (), Budget(), 0).relaxed()
    assert relaxation.value == pytest.approx(corner, rel=0.02)
    assert np.all((relaxation.prices >= 0.0) & (relaxation.prices <= problem.best_worth))
    # Without contacts the programme over paths is no weaker than the linear one.
    proven = resource_value(problem, relaxation.prices, 1e-3)
    assert proven <= relaxation.value + 0.05
    assert np.all(np.isfinite(relaxation.losses))


def test_contacts_that_exclude_each_other_leave_nothing() -> None:
    problem = random_problem(3, num_collects=10, num_contacts=8)
    contacts = tuple(int(r) for r in np.flatnonzero(problem.opportunities.kind == CONTACT))
    every = np.ones(len(problem.opportunities), dtype=np.bool_)
    relaxation = FixedContacts(problem, every, contacts, Budget(), 0).relaxation()
    assert relaxation.value == -np.inf
    assert np.all(np.isinf(relaxation.losses))
