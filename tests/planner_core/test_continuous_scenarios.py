"""Continuous starts over real orbits: pins, reasons, what-ifs and the whole way to an answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Scenario
from planner_core.errors import InvalidScenario
from planner_core.pins import BlockedInterval, PinnedAction, Pins
from planner_core.problem import COLLECT
from planner_core.reasons.at_length import explain_target
from planner_core.reasons.what_if import Change, what_if
from planner_core.referee.replay import replay
from planner_core.run import Judged, plan_scenario
from planner_core.solvers.registry import SOLVERS, Certified, Rule
from tests.planner_core.test_build import scenario as built_scenario
from tests.planner_core.test_build import two_satellites


def scenario(*, use_resources: bool = False, spacing_s: float | None = None) -> Scenario:
    """Return a crowded hour of two satellites."""
    return replace(
        built_scenario(
            satellites=two_satellites(), span_h=4.0, num_targets=150,
            use_resources=use_resources, spacing_s=spacing_s,
        ),
        continuous_starts=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def judged() -> Judged:
    return plan_scenario(scenario(), Certified(moves_per_task=10.0), 0, Budget())


def own_starts(judged: Judged) -> list[int]:
    table = judged.problem.opportunities
    return [
        position
        for position, action in enumerate(judged.solution.plan.actions)
        if abs(action.start_s - table.start_s[action.opportunity]) > 1.0
    ]


def test_free_starts_gain_images_that_the_referee_grants(judged: Judged) -> None:
    fixed = plan_scenario(
        replace(scenario(), continuous_starts=False), Certified(), 0, Budget()
    ).timeline
    assert judged.timeline.is_valid
    assert judged.timeline.reward > fixed.reward
    assert judged.bound is not None
    assert judged.bound.value >= judged.timeline.reward
    assert len(own_starts(judged)) > 10
    for action in judged.solution.plan.actions:
        assert action.start_s == pytest.approx(round(action.start_s, 3), abs=1e-9)


@pytest.mark.parametrize("name", sorted(SOLVERS))
@pytest.mark.parametrize("use_resources", [False, True])
def test_every_solver_answers_such_a_scenario(name: str, use_resources: bool) -> None:
    asked = scenario(use_resources=use_resources)
    answer = plan_scenario(asked, SOLVERS[name](), 0, Budget())
    assert answer.timeline.is_valid
    assert answer.bound is not None
    assert answer.timeline.reward <= answer.bound.value + 1e-9


def test_each_target_left_out_has_a_reason_true_of_continuous_starts(judged: Judged) -> None:
    """If the actions named as blocking are removed, the image fits, judged by the referee."""
    problem, plan = judged.problem, judged.solution.plan
    left = [o for o in judged.outcomes if o.reason is not None and o.reason.blocking]
    assert left
    for outcome in left[:5]:
        assert outcome.reason is not None
        assert outcome.reason.opportunity is not None
        assert problem.opportunities.site[outcome.reason.opportunity] == outcome.target
        found = explain_target(problem, plan, judged.timeline, outcome.target)
        assert found.outcome.reason is not None
        assert found.outcome.reason.code == outcome.reason.code
        assert found.outcome.reason.blocking == outcome.reason.blocking
        starts = {a.start_s for a in found.attempts}
        assert len(starts) > len(problem.collects_of(outcome.target))
        for attempt in found.attempts:
            assert attempt.end_s - attempt.start_s == pytest.approx(30.0)
            assert attempt.violations or attempt.is_settled
            assert set(attempt.displaces) >= {
                p for v in attempt.violations for p in v.blamed if v.code == "overlap"
            }


def pinned(judged: Judged, pins: Pins) -> Judged:
    return plan_scenario(
        replace(judged.scenario, pins=pins), Certified(moves_per_task=5.0), 0, Budget()
    )


def test_an_action_with_its_own_start_can_be_kept(judged: Judged) -> None:
    """If actions with their own starts are pinned, the plan holds each of them, to the ms."""
    horizon, problem = judged.scenario.horizon, judged.problem
    table = problem.opportunities
    actions = [judged.solution.plan.actions[p] for p in own_starts(judged)][:25]
    keep = tuple(
        PinnedAction(
            target_id=problem.target_ids[table.site[a.opportunity]],
            satellite_id=problem.satellites[table.satellite[a.opportunity]].id,
            start=horizon.instant(a.start_s),
        )
        for a in actions
    )
    again = pinned(judged, Pins(keep=keep))
    assert again.timeline.is_valid
    site = again.problem.opportunities.site
    held = {(int(site[a.opportunity]), a.start_s) for a in again.solution.plan.actions}
    assert {(int(table.site[a.opportunity]), a.start_s) for a in actions} <= held
    # Around them at least as much fits as in the original plan.
    assert again.timeline.reward >= judged.timeline.reward - 2.0
    moved = replace(
        again.solution.plan,
        actions=tuple(
            a._replace(start_s=a.start_s + 1.0, end_s=a.end_s + 1.0)
            if a.opportunity in again.problem.kept_rows
            else a
            for a in again.solution.plan.actions
        ),
    )
    assert "pin" in {v.code for v in replay(again.problem, moved).violations}


def test_a_kept_start_lies_in_its_access(judged: Judged) -> None:
    table, horizon = judged.problem.opportunities, judged.scenario.horizon
    row = 20
    name = judged.problem.target_ids[table.site[row]]
    late = horizon.instant(float(table.access_end_s[row]) - 10.0)
    again = pinned(judged, Pins(keep=(PinnedAction(target_id=name, start=late),)))
    (kept,) = again.problem.kept_rows
    assert again.problem.opportunities.end_s[kept] == table.access_end_s[row]
    assert again.timeline.is_valid
    away = horizon.instant(float(table.access_end_s[row]) + 60.0)
    with pytest.raises(InvalidScenario, match="no opportunity at that time"):
        pinned(judged, Pins(keep=(PinnedAction(target_id=name, start=away),)))


def test_skipping_an_image_skips_its_access_and_blocking_leaves_what_is_around(
    judged: Judged,
) -> None:
    problem, horizon = judged.problem, judged.scenario.horizon
    table = problem.opportunities
    action = judged.solution.plan.actions[own_starts(judged)[5]]
    access = int(table.access[action.opportunity])
    skip = PinnedAction(
        target_id=problem.target_ids[table.site[action.opportunity]],
        satellite_id=problem.satellites[table.satellite[action.opportunity]].id,
        start=horizon.instant(action.start_s),
    )
    middle_s = round(float(np.median([a.start_s for a in judged.solution.plan.actions])))
    block = BlockedInterval(
        satellite_id=problem.satellites[0].id,
        start=horizon.instant(middle_s),
        end=horizon.instant(middle_s + 40.0),
    )
    again = pinned(judged, Pins(skip=(skip,), block=(block,)))
    assert again.timeline.is_valid
    taken = again.problem.opportunities
    assert access not in {int(taken.access[a.opportunity]) for a in again.solution.plan.actions}
    for a in again.solution.plan.actions:
        if taken.satellite[a.opportunity] == 0:
            assert a.end_s <= middle_s + 1e-6 or a.start_s >= middle_s + 40.0 - 1e-6
    assert again.timeline.reward >= judged.timeline.reward - 4.0


def test_forcing_a_target_names_a_start_that_it_may_have(judged: Judged) -> None:
    left = next(o.target for o in judged.outcomes if o.reason and o.reason.blocking)
    name = judged.problem.target_ids[left]
    asked = what_if(
        judged.scenario,
        Change(force=(PinnedAction(target_id=name),)),
        judged.problem,
        judged.solution.plan,
    )
    again = plan_scenario(asked, Certified(moves_per_task=5.0), 0, Budget())
    assert again.timeline.is_valid
    assert left in again.timeline.collected
    held = next(iter(judged.timeline.collected))
    action = judged.solution.plan.actions[judged.timeline.collected[held].position]
    asked = what_if(
        judged.scenario,
        Change(force=(PinnedAction(target_id=judged.problem.target_ids[held]),)),
        judged.problem,
        judged.solution.plan,
    )
    assert asked.pins.keep[0].start == judged.scenario.horizon.instant(action.start_s)


def test_with_resources_what_fits_between_is_put_in_and_limits_hold() -> None:
    asked = scenario(use_resources=True)
    rich = replace(
        asked,
        satellites=tuple(
            replace(s, resources=replace(s.resources, collect_drain_per_s=1e-5,
                                         collect_fill_per_s=1e-5))
            for s in asked.satellites
        ),
    )  # fmt: skip
    for one in (asked, rich):
        computed = compute_opportunities(one, Budget())
        problem = build_problem(one, computed, Budget())
        plan = Rule().solve(problem, Budget(), 0).plan
        judged = plan_scenario(one, Rule(), 0, Budget(), computed)
        assert judged.timeline.is_valid
        gained = judged.timeline.reward - replay(problem, plan).reward
        assert gained >= (3.0 if one is rich else 0.0)
        contacts = problem.opportunities.kind != COLLECT
        assert {a for a in plan.actions if contacts[a.opportunity]} == {
            a for a in judged.solution.plan.actions if contacts[a.opportunity]
        }
