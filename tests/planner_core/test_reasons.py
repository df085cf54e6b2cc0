"""Every target has one outcome, and each reason is true of the plan it explains."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Termination
from planner_core.domain import Agility, Dynamics
from planner_core.errors import InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import (
    ACCESS_TOO_SHORT,
    COLLECT,
    CONTACT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    Blocked,
    Kept,
    Pinned,
    Problem,
    build_satellite_problem,
)
from planner_core.problem.plan import Plan
from planner_core.reasons.explain import explain
from planner_core.reasons.reason import Change, Search
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.solvers.registry import ForwardSearch, Milp, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_plan
from tests.planner_core.problems import ECLIPSES, TIGHT, Task, make_problem, random_problem

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
AGILITIES = st.sampled_from(
    [
        Agility(),
        Agility(slew_rate_deg_s=0.5, settle_s=8.0),
        Agility(slew_rate_deg_s=2.0, acceleration_deg_s2=0.02, settle_s=1.0),
    ]
)


def rows_of(plan: Plan) -> list[int]:
    return [action.opportunity for action in plan.actions]


def with_settings(problem: Problem, change: Change) -> Problem:
    """Return the problem with a change applied, compiled again."""
    satellites = []
    for index, satellite in enumerate(problem.satellites):
        agility, resources = satellite.agility, satellite.resources
        if index == change.satellite:
            for name, value in change.settings.items():
                setting: dict[str, Any] = {name: value}
                if hasattr(agility, name):
                    agility = replace(agility, **setting)
                else:
                    resources = replace(resources, **setting)
        satellites.append(
            build_satellite_problem(
                index,
                problem.opportunities,
                id=satellite.id,
                name=satellite.name,
                agility=agility,
                resources=resources,
                sunlight=satellite.sunlight,
                downlinks=problem.downlinks,
                events=(satellite.event_s, satellite.event),
            )
        )
    return replace(problem, satellites=tuple(satellites))


def judged(problem: Problem, rows: Iterable[int]) -> Timeline:
    return replay(problem, Plan.of(problem, rows))


def check_reasons(problem: Problem, plan: Plan, search: Search) -> set[str]:
    """Check every reason of a valid plan with the referee; return the codes that occurred."""
    timeline = replay(problem, plan)
    outcomes = explain(problem, plan, timeline, search)
    assert [o.target for o in outcomes] == list(range(len(problem.target_ids)))
    own = rows_of(plan)
    codes: set[str] = set()
    for outcome in outcomes:
        reason, collects = outcome.reason, problem.collects_of(outcome.target)
        assert (reason is None) == (outcome.target in timeline.collected)
        if reason is None:
            continue
        codes.add(reason.code)
        assert (reason.opportunity is None) == (len(collects) == 0)
        forced = {int(c): judged(problem, [*own, int(c)]) for c in collects}
        fits = any(t.is_valid for t in forced.values())
        assert fits == (
            reason.code == "not_considered"
            or (reason.code == "solver_limit" and not reason.blocking)
        )
        if fits or reason.opportunity is None:
            continue
        broken = {v.code for v in forced[reason.opportunity].violations}
        if reason.at_s is None:
            assert broken & {"slew", "overlap"}
        freed = [row for p, row in enumerate(own) if p not in reason.blocking]
        again = judged(problem, [*freed, reason.opportunity])
        if reason.reward_delta is None:
            assert not again.is_valid
        else:
            assert again.is_valid
            assert again.reward - timeline.reward == pytest.approx(reason.reward_delta)
            assert reason.change is not None
            # No action is dropped unnecessarily.
            for p in reason.blocking:
                assert not judged(problem, [*freed, own[p], reason.opportunity]).is_valid
        if reason.code in ("battery", "recorder") and broken <= {"battery", "recorder"}:
            assert reason.code in broken
        if reason.change is not None and reason.change.satellite is not None:
            changed = with_settings(problem, reason.change)
            assert judged(changed, [*own, reason.change.opportunity]).is_valid
            codes.update(reason.change.settings)
        elif reason.change is not None:
            assert reason.change.drop == reason.blocking
    return codes


@examples(250)
@given(
    seed=SEEDS,
    dynamics=DYNAMICS,
    use_resources=st.booleans(),
    drop=st.integers(0, 3),
    agility=AGILITIES,
    has_rewards=st.booleans(),
)
def test_reasons_and_changes_hold_before_the_referee(
    seed: int,
    dynamics: Dynamics,
    use_resources: bool,
    drop: int,
    agility: Agility,
    has_rewards: bool,
) -> None:
    problem = random_problem(
        seed, dynamics=dynamics, use_resources=use_resources, num_satellites=2, agility=agility,
        num_targets=12, num_collects=24, num_contacts=5, has_rewards=has_rewards,
        sunlight=ECLIPSES if seed % 3 == 0 else None,
    )  # fmt: skip
    solver = ForwardSearch(breadth=2) if seed % 2 else Rule()
    actions = solver.solve(problem, Budget(), 0).plan.actions
    plan = Plan(tuple(a for i, a in enumerate(actions) if i % 4 != drop))
    if not replay(problem, plan).is_valid:  # a dropped contact can break the limits of the rest
        return
    check_reasons(problem, plan, Search(breadth=2 if seed % 2 else None))


def test_all_kinds_of_reasons_and_changes_come_up() -> None:
    codes: set[str] = set()
    weak = replace(TIGHT, initial_battery_fraction=0.5, recorder_max_fraction=1.0)
    for seed in range(60):
        problem = random_problem(
            seed, num_satellites=2, num_targets=14, num_collects=24, num_contacts=5,
            agility=Agility(settle_s=10.0), use_resources=seed % 3 > 0,
            resources=weak if seed % 3 == 1 else TIGHT,
        )  # fmt: skip
        plan = Rule().solve(problem, Budget(), 0).plan
        if replay(problem, plan).is_valid:
            codes |= check_reasons(problem, plan, Search())
    assert codes >= {
        "no_access", "displaced_by", "battery", "recorder", "slew_rate_deg_s", "settle_s",
        "battery_min_fraction", "recorder_max_fraction",
    }  # fmt: skip


@examples(40)
@given(seed=SEEDS, use_resources=st.booleans())
def test_no_plan_with_a_target_earns_more_than_an_optimal_one_without(
    seed: int, use_resources: bool
) -> None:
    problem = random_problem(
        seed, use_resources=use_resources, num_targets=6, num_collects=8, has_rewards=True
    )
    solution = Milp().solve(problem, Budget(), 0)
    assert solution.termination is Termination.OPTIMAL
    timeline = replay(problem, solution.plan)
    for outcome in explain(problem, solution.plan, timeline, Search(is_optimal=True)):
        reason = outcome.reason
        if reason is None or reason.reward_delta is None:
            continue
        assert reason.certainty == "proven"
        assert reason.reward_delta <= 0.0
        for row in problem.collects_of(outcome.target):
            must = Pinned(kept=(Kept(row=int(row), pointer="/pins/keep/0"),))
            best = best_plan(replace(problem, pinned=must))
            assert best is None or replay(problem, best).reward <= timeline.reward + 1e-9


@examples(80)
@given(seed=SEEDS, use_resources=st.booleans())
def test_what_pins_prove_no_plan_that_honours_them_contains(seed: int, use_resources: bool) -> None:
    whole = random_problem(
        seed, use_resources=use_resources, num_targets=8, num_collects=14, num_contacts=3
    )
    rng = np.random.default_rng(seed)
    pinned = Pinned(
        kept=tuple(
            Kept(row=int(row), pointer=f"/pins/keep/{i}")
            for i, row in enumerate(rng.choice(len(whole.opportunities), 2, replace=False))
        ),
        blocked=(
            Blocked(
                satellite=0, start_s=300.0, end_s=500.0, kinds=frozenset({COLLECT}),
                pointer="/pins/block/0",
            ),
        ),
        forbidden=frozenset({int(rng.integers(8))}),
    )  # fmt: skip
    try:
        problem = apply_pins(whole, pinned)
    except InvalidScenario:
        return
    plan = Rule().solve(problem, Budget(), 0).plan
    timeline = replay(problem, plan)
    if not timeline.is_valid:
        return
    check_reasons(problem, plan, Search())
    judge = replace(whole, pinned=pinned)
    for outcome in explain(problem, plan, timeline):
        assert (outcome.target in pinned.forbidden) <= (outcome.outcome == "excluded")
        if outcome.reason is None or outcome.reason.certainty != "proven":
            continue
        for row in whole.collects_of(outcome.target):
            beside = judged(judge, {*(kept.row for kept in pinned.kept), int(row)})
            broken = {v.code for v in beside.violations}
            assert broken & {"slew", "overlap", "pin"}
            assert (outcome.outcome == "excluded") <= ("pin" in broken)
            assert (outcome.reason.code == "slew_conflict") <= bool(outcome.reason.blocking)


def test_a_task_beyond_the_breadth_was_not_considered() -> None:
    tasks = [
        Task(kind=COLLECT, site=i, start_s=100.0 * i, end_s=100.0 * i + 30.0) for i in range(5)
    ]
    problem = make_problem(tasks, num_targets=5, use_resources=False)
    plan = Plan.of(problem, [0])
    reasons = [
        outcome.reason and outcome.reason.code
        for outcome in explain(problem, plan, replay(problem, plan), Search(breadth=2))
    ]
    assert reasons == [None, "solver_limit", "solver_limit", "not_considered", "not_considered"]


def test_a_contact_that_the_search_left_out_takes_no_breadth() -> None:
    tasks = [
        Task(kind=CONTACT, site=0, start_s=100.0, end_s=130.0),
        Task(kind=COLLECT, site=0, start_s=200.0, end_s=230.0),
    ]
    problem = make_problem(tasks, num_targets=1)
    plan = Plan.of(problem, [])
    codes = []
    for contact_above in (0.0, 0.45):
        search = Search(breadth=1, contact_above=contact_above)
        reason = explain(problem, plan, replay(problem, plan), search)[0].reason
        codes.append(reason and reason.code)
    assert codes == ["not_considered", "solver_limit"]


@pytest.mark.parametrize(
    ("why", "words"),
    [
        (NEVER_VISIBLE, "rises above"),
        (OUTSIDE_LIMITS, "limits of the sensor"),
        (ACCESS_TOO_SHORT, "shorter than its collect"),
    ],
)
def test_a_target_without_opportunity_says_what_geometry_proves(why: Any, words: str) -> None:
    task = Task(kind=COLLECT, site=0, start_s=0.0, end_s=30.0)
    problem = make_problem([task], num_targets=2)
    problem.target_access[1] = why
    plan = Plan.of(problem, [0])
    reason = explain(problem, plan, replay(problem, plan))[1].reason
    assert reason is not None
    assert (reason.code, reason.certainty) == ("no_access", "proven")
    assert words in reason.detail
