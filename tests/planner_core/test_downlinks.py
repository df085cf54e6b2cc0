"""Contacts are added where images earn more with them."""

from __future__ import annotations

from functools import partial

from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.lns.downlinks import with_more_downlinks
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
def test_more_contacts_never_cost(
    seed: int, dynamics: Dynamics, num_satellites: int, collected_share: float
) -> None:
    problem = with_objective(
        _problem(seed, dynamics, num_satellites, num_contacts=4),
        Objective(collected_share=collected_share),
    )
    plan = Rule().solve(problem, Budget(), 0).plan
    before = replay(problem, plan)
    found = with_more_downlinks(problem, plan, Budget())
    after = replay(problem, found)
    assert after.reward >= before.reward
    assert after.validity == before.validity
    assert set(plan.actions) <= set(found.actions)


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
        after = replay(problem, with_more_downlinks(problem, images, Budget()))
        gained += before.is_valid and after.reward > before.reward
    assert gained >= 5
