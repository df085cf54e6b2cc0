"""Contacts are added, and images taken elsewhere, where images earn more with that."""

from __future__ import annotations

from functools import partial

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.lns.downlinks import brought_down
from planner_core.domain import Dynamics, Objective
from planner_core.problem import CONTACT
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.rule import Rule
from tests.examples import examples
from tests.planner_core.problems import TIGHT, varied_problem

_problem = partial(varied_problem, scarce=TIGHT)


@examples(200)
@given(
    seed=st.integers(0, 10**6),
    dynamics=st.sampled_from(["physical", "paper"]),
    num_satellites=st.integers(1, 3),
    collected_share=st.sampled_from([0.0, 0.5, 0.9]),
)
def test_no_image_is_lost_and_no_contact_dropped(
    seed: int, dynamics: Dynamics, num_satellites: int, collected_share: float
) -> None:
    problem = with_objective(
        _problem(seed, dynamics, num_satellites, num_contacts=4),
        Objective(collected_share=collected_share),
    )
    plan = Rule().solve(problem, Budget(), 0).plan
    before = replay(problem, plan)
    found = brought_down(problem, plan, Budget())
    after = replay(problem, found)
    assert after.reward >= before.reward
    assert after.validity == before.validity
    kind = problem.opportunities.kind
    contacts = {action for action in plan.actions if kind[action.opportunity] == CONTACT}
    assert contacts <= set(found.actions)
    assert after.collected.keys() == before.collected.keys()


def test_an_image_that_stays_on_board_is_taken_where_it_comes_down() -> None:
    """One image of a target, after the last contact, of a plan that takes all contacts."""
    moved = 0
    for seed in range(100):
        problem = with_objective(
            _problem(seed, "physical", 2, num_contacts=4), Objective(collected_share=0.9)
        )
        table = problem.opportunities
        contacts = np.flatnonzero(table.kind == CONTACT)
        last_s = max((table.start_s[row] for row in contacts), default=0.0)
        late = np.flatnonzero((table.kind != CONTACT) & (table.start_s >= last_s))
        for row in late.tolist():
            plan = Plan.of(problem, [*contacts, row])
            before = replay(problem, plan)
            if before.is_valid and before.collected:
                after = replay(problem, brought_down(problem, plan, Budget()))
                assert after.is_valid
                assert after.reward >= before.reward
                assert after.collected.keys() == before.collected.keys()
                moved += after.reward > before.reward
    assert moved >= 5


def test_an_image_gets_its_contact() -> None:
    gained = 0
    for seed in range(20):
        problem = with_objective(
            _problem(seed, "physical", 1, num_contacts=4), Objective(collected_share=0.5)
        )
        kind = problem.opportunities.kind
        plan = Rule().solve(problem, Budget(), 0).plan
        images = Plan(tuple(a for a in plan.actions if kind[a.opportunity] != CONTACT)[:1])
        before = replay(problem, images)
        after = replay(problem, brought_down(problem, images, Budget()))
        gained += before.is_valid and after.reward > before.reward
    assert gained >= 5
