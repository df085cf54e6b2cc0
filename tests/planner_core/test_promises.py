"""Thousands of replans: no promise is bumped or late, and no frozen action differs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Objective
from planner_core.errors import InvalidScenario
from planner_core.problem import ImageOnBoard, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.on_board import without_on_board
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.replanning.question import Question
from planner_core.replanning.replan import solve_replan
from planner_core.solvers.registry import Rule
from tests.examples import examples
from tests.planner_core.problems import Task, make_problem
from tests.planner_core.test_delivery import ROOMY
from tests.planner_core.test_replanning import BETA, Event, event_at_random

SEEDS = st.integers(0, 10**7)


def _with_deadlines(happened: Event, seed: int) -> Question:
    """Return the question with deadlines for some promises, which the old plan would meet."""
    question, rng = happened.question, np.random.default_rng(seed)
    kept = Plan.of(question.problem, question.base.tolist())
    down_s = question.down_s(kept)
    deadline_s = {
        target: down_s[target] + float(rng.choice([0.0, 60.0, 300.0]))
        for target in question.promised
        if target in down_s and rng.random() < 0.7
    }
    return replace(question, deadline_s=deadline_s)


@examples(2500)
@given(seed=SEEDS)
def test_what_is_promised_and_frozen_holds(seed: int) -> None:
    """Most without any time, so that the first plan counts; some with all the time needed."""
    has_time, use_resources = seed % 25 == 0, seed % 3 > 0
    happened = event_at_random(seed, use_resources=use_resources, is_exact=False)
    if happened is None:
        return
    question = _with_deadlines(happened, seed)
    problem = question.problem
    budget = Budget() if has_time else Budget(0.0)
    try:
        plan = solve_replan(question, Rule(), budget, seed).plan
    except InvalidScenario as error:
        if error.fault.code != "promise_not_kept":
            raise
        event("refused")
        return
    event(f"promised: {len(question.promised)}, with a date: {len(question.deadline_s)}")
    assert not question.missing(plan)
    start_s = happened.whole.opportunities.start_s
    rows = happened.rows(plan)
    assert {r for r in rows if problem.pinned.is_frozen(start_s[r])} == happened.frozen
    codes = {v.code for v in replay(problem, plan).violations}
    assert not codes & {"frozen", "outage", "slew", "station", "overlap"}
    down_s = question.down_s(plan)
    for target, deadline_s in question.deadline_s.items():
        assert down_s[target] <= deadline_s + 1e-6


def _passes() -> Problem:
    tasks = [
        Task(kind=0, site=0, start_s=50.0, end_s=80.0),
        Task(kind=1, site=0, start_s=150.0, end_s=260.0),
        Task(kind=0, site=1, start_s=300.0, end_s=330.0),
        Task(kind=1, site=0, start_s=600.0, end_s=700.0),
    ]
    problem = make_problem(tasks, num_targets=2, resources=ROOMY)
    return with_objective(problem, Objective(collected_share=0.9))


def _asked(problem: Problem, base: list[int], **deadline_s: float) -> Question:
    targets = tuple(int(name[1:]) for name in deadline_s)
    return Question(
        problem=without_on_board(problem), base=np.array(base, dtype=np.int32),
        num_base=len(base), promised=targets, stability=BETA,
        deadline_s={int(name[1:]): at for name, at in deadline_s.items()},
        on_board=problem.on_board,
    )  # fmt: skip


def test_a_contact_is_added_where_a_date_asks_for_it() -> None:
    """The base plan downlinks it in the second pass, after the deadline."""
    problem = _passes()
    question = _asked(problem, [0, 2, 3], t0=400.0)
    plan = solve_replan(question, Rule(), Budget(), 0).plan
    assert 1 in {action.opportunity for action in plan.actions}
    assert question.down_s(plan)[0] <= 400.0


def test_what_no_contact_brings_down_in_time_is_refused_with_its_reason() -> None:
    problem = _passes()
    with pytest.raises(InvalidScenario) as caught:
        solve_replan(_asked(problem, [0, 2, 3], t1=400.0), Rule(), Budget(), 0)
    fault = caught.value.fault
    assert (fault.code, fault.pointer) == ("promise_not_kept", "/replan/promises/0/deliver_by")
    assert "too late" in fault.detail


def test_an_image_on_board_keeps_a_promise_once_it_is_down() -> None:
    problem = _passes()
    image = ImageOnBoard(satellite=0, target=0, amount=0.01, collected_s=-100.0, worth=1.0)
    loaded = replace(problem, on_board=(image,))
    question = _asked(loaded, [2, 3], t0=200.0)
    plan = solve_replan(question, Rule(), Budget(), 0).plan
    assert question.down_s(plan)[0] <= 200.0
    with pytest.raises(InvalidScenario):
        solve_replan(_asked(loaded, [2, 3], t0=120.0), Rule(), Budget(), 0)
    free = replace(question, deadline_s={})
    assert not free.missing(Plan())
