"""Every target once, and each reason true of the plan it speaks of."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.domain import Dynamics
from planner_core.plan import Plan
from planner_core.problem import ACCESS_TOO_SHORT, COLLECT, NEVER_VISIBLE, OUTSIDE_LIMITS
from planner_core.reasons import explain
from planner_core.solvers import Rule
from planner_core.solvers.base import Budget
from planner_core.timeline import replay
from tests.planner_core.problems import Task, make_problem, random_problem


@settings(max_examples=120, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    dynamics=st.sampled_from(["physical", "paper"]),
    use_resources=st.booleans(),
    drop=st.integers(0, 3),
)
def test_forcing_a_left_out_target_in_breaks_what_its_reason_says(
    seed: int, dynamics: Dynamics, use_resources: bool, drop: int
) -> None:
    problem = random_problem(
        seed, dynamics=dynamics, use_resources=use_resources, num_satellites=2,
        num_targets=12, num_collects=24, num_contacts=5,
    )  # fmt: skip
    actions = Rule().solve(problem, Budget(), 0).plan.actions
    plan = Plan(tuple(a for i, a in enumerate(actions) if i % 4 != drop))
    timeline = replay(problem, plan)
    if not timeline.is_valid:  # a dropped contact can break the limits of the rest
        return
    outcomes = explain(problem, plan, timeline)
    assert [o.target for o in outcomes] == list(range(12))
    for outcome in outcomes:
        reason = outcome.reason
        collects = problem.collects_of(outcome.target)
        assert (reason is None) == (outcome.target in timeline.collected)
        if reason is None:
            continue
        assert (reason.code == "no_access") == (len(collects) == 0)
        forced = {
            int(c): replay(
                problem, Plan.of(problem, [*(a.opportunity for a in plan.actions), int(c)])
            )
            for c in collects
        }
        fits = [c for c, t in forced.items() if t.is_valid]
        assert (reason.code == "solver_limit") == bool(fits)
        if reason.opportunity is None:
            continue
        codes = {v.code for v in forced[reason.opportunity].violations}
        if reason.code in ("battery", "recorder"):
            assert reason.code in codes
        if reason.code == "slew_conflict":
            assert codes & {"slew", "overlap"}
            freed = [a.opportunity for p, a in enumerate(plan.actions) if p not in reason.blocking]
            again = replay(problem, Plan.of(problem, [*freed, reason.opportunity]))
            assert not {v.code for v in again.violations} & {"slew", "overlap"}


@pytest.mark.parametrize(
    ("why", "words"),
    [
        (NEVER_VISIBLE, "rises above"),
        (OUTSIDE_LIMITS, "limits of the sensor"),
        (ACCESS_TOO_SHORT, "shorter than its collect"),
    ],
)
def test_a_target_without_opportunity_says_what_geometry_proves(why: Any, words: str) -> None:
    task = Task(kind=COLLECT, place=0, start_s=0.0, end_s=30.0)
    problem = make_problem([task], num_targets=2)
    problem.target_access[1] = why
    plan = Plan.of(problem, [0])
    reason = explain(problem, plan, replay(problem, plan))[1].reason
    assert reason is not None
    assert (reason.code, reason.certainty) == ("no_access", "proven")
    assert words in reason.detail
