"""Contacts are added, and images moved, if that makes images earn more."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.lns.downlinks import _best_of_gaps, _by_gap, brought_down
from planner_core.domain import Dynamics, Objective
from planner_core.precedence.conflicts import conflicts
from planner_core.problem import CONTACT
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.view import View
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
    """One image of a target after the last contact, in plans that take all contacts."""
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


@examples(200)
@given(
    seed=st.integers(0, 10**6),
    num_satellites=st.integers(1, 3),
    antennas=st.integers(1, 2),
    share=st.sampled_from([0.3, 0.7]),
)
def test_contacts_fit_that_conflict_with_none_of_the_plan(
    seed: int, num_satellites: int, antennas: int, share: float
) -> None:
    problem = _problem(seed, "physical", num_satellites, num_contacts=9)
    problem = replace(problem, station_antennas=np.full_like(problem.station_antennas, antennas))
    table, rng = problem.opportunities, np.random.default_rng(seed)
    taken = [row for row in Rule().solve(problem, Budget(), 0).plan.actions if rng.random() < share]
    view = View.of(problem, Plan(tuple(taken)))
    rows = np.array([action.opportunity for action in taken], dtype=np.int32)
    chosen: list[int] = []
    for index, satellite in enumerate(problem.satellites):
        is_own = table.satellite[rows] == index
        beside = rows[is_own | (table.kind[rows] == CONTACT)].tolist()
        for offered in _by_gap(view, satellite, rows[is_own]):
            fits = (row for row in offered if not conflicts(problem, row, [*beside, *chosen]))
            chosen += [row for row in [next(fits, None)] if row is not None]
    assert _best_of_gaps(view) == chosen


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
