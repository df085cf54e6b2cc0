"""Outages: no plan touches them, the best remaining plan is found, and reasons name them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Dynamics
from planner_core.errors import InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import COLLECT, CONTACT, Blocked, Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.reasons.explain import explain
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import Certified, ForwardSearch, Graph, Mcts, Milp, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_plan
from tests.planner_core.problems import random_problem

SEEDS = st.integers(0, 10**6)
SOLVERS: list[Solver] = [Rule(), Graph(), ForwardSearch(), Mcts(num_simulations=20), Milp()]


def drawn(seed: int, dynamics: Dynamics, *, use_resources: bool) -> Problem:
    return random_problem(
        seed, dynamics=dynamics, use_resources=use_resources, num_satellites=2,
        num_targets=6, num_collects=8, num_contacts=4, num_stations=2,
    )  # fmt: skip


def outages_at_random(seed: int, problem: Problem) -> tuple[Blocked, ...]:
    """Return outages of a satellite and a station: both, one of them or none."""
    rng = np.random.default_rng(seed)
    from_s = rng.uniform(0, 900, size=2)
    to_s = from_s + rng.uniform(10, 400, size=2)
    both = (
        Blocked(
            satellite=int(rng.integers(2)), start_s=float(from_s[0]), end_s=float(to_s[0]),
            kinds=frozenset(rng.choice([COLLECT, CONTACT], size=rng.integers(1, 3)).tolist()),
            pointer="/outages/0",
        ),
        Blocked(
            station=int(rng.integers(len(problem.station_ids))), start_s=float(from_s[1]),
            end_s=float(to_s[1]), kinds=frozenset({CONTACT}), pointer="/outages/1",
        ),
    )  # fmt: skip
    return tuple(one for one in both if rng.random() < 0.8)


@examples(100)
@given(seed=SEEDS, dynamics=st.sampled_from(["physical", "paper"]), use_resources=st.booleans())
def test_plans_are_the_best_that_no_outage_touches(
    seed: int, dynamics: Dynamics, use_resources: bool
) -> None:
    """Brute force searches the whole table and knows the outages from the referee alone."""
    whole = drawn(seed, dynamics, use_resources=use_resources)
    pinned = Pinned(blocked=outages_at_random(seed, whole))
    problem = apply_pins(whole, pinned)
    event(f"opportunities lost: {len(whole.opportunities) > len(problem.opportunities)}")
    for solver in SOLVERS:
        timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
        assert "outage" not in {v.code for v in timeline.violations}, solver
    best = best_plan(replace(whole, pinned=pinned))
    if best is None:
        return
    reward = replay(whole, best).reward
    solution = Certified().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert timeline.reward == pytest.approx(reward)
    assert solution.bound == pytest.approx(reward, abs=1e-4)


@examples(100)
@given(seed=SEEDS)
def test_the_referee_tells_each_task_in_an_outage(seed: int) -> None:
    whole = drawn(seed, "physical", use_resources=True)
    outages = outages_at_random(seed, whole)
    problem = replace(whole, pinned=Pinned(blocked=outages))
    table = problem.opportunities
    plan = Plan.of(problem, range(len(table)))
    told = {
        problem.scenario_row(plan.actions[p].opportunity)
        for v in replay(problem, plan).violations
        if v.code == "outage"
        for p in v.blamed
    }
    expected = {
        row
        for row in range(len(table))
        for one in outages
        if table.start_s[row] < one.end_s - 1e-6 and table.end_s[row] > one.start_s + 1e-6
        if table.kind[row] in one.kinds
        if (table.satellite[row] == one.satellite if one.station is None
            else table.kind[row] == CONTACT and table.site[row] == one.station)
    }  # fmt: skip
    assert told == expected


@examples(60)
@given(seed=SEEDS)
def test_a_target_that_an_outage_takes_is_told_so(seed: int) -> None:
    whole = drawn(seed, "physical", use_resources=True)
    outages = outages_at_random(seed, whole)
    problem = apply_pins(whole, Pinned(blocked=outages))
    plan = Rule().solve(problem, Budget(), 0).plan
    outcomes = explain(problem, plan, replay(problem, plan))
    for target in range(len(whole.target_ids)):
        reason = outcomes[target].reason
        is_lost = len(whole.collects_of(target)) > 0 and len(problem.collects_of(target)) == 0
        assert (reason is not None and reason.code == "outage") == is_lost
        if is_lost:
            assert reason is not None
            assert reason.certainty == "proven"
            assert outcomes[target].outcome == "unscheduled"


def test_what_is_out_cannot_be_kept() -> None:
    whole = drawn(3, "physical", use_resources=False)
    table = whole.opportunities
    out = Blocked(
        satellite=int(table.satellite[0]), start_s=float(table.start_s[0]),
        end_s=float(table.end_s[0]), kinds=frozenset({COLLECT, CONTACT}), pointer="/outages/0",
    )  # fmt: skip
    with pytest.raises(InvalidScenario) as caught:
        apply_pins(whole, Pinned(kept=(Kept(row=0, pointer="/pins/keep/0"),), blocked=(out,)))
    assert caught.value.fault.code == "pins_conflict"
    assert caught.value.fault.pointer == "/pins/keep/0"
