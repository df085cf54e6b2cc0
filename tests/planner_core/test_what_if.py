"""Pins, what-if and explanations on a real mission, tested through the whole core."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest

from benchmarks.missions import paper_scenario
from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Dynamics, Horizon, Scenario
from planner_core.errors import InvalidScenario
from planner_core.pins import BlockedInterval, PinnedAction, Pins
from planner_core.problem import (
    ACCESS_FOUND,
    ACCESS_TOO_SHORT,
    COLLECT,
    CONTACT,
    OUTSIDE_LIMITS,
)
from planner_core.reasons.access_changes import access_changes
from planner_core.reasons.at_length import explain_target
from planner_core.reasons.what_if import (
    Change,
    Relaxation,
    relaxed,
    what_if,
)
from planner_core.referee.plan_diff import PlanView, plan_diff
from planner_core.referee.timeline import JudgedAction
from planner_core.run import Judged, plan_scenario
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import (
    SOLVERS,
    ForwardSearch,
    Milp,
    Rule,
)


@functools.cache
def mission(num_targets: int = 250, dynamics: Dynamics = "physical") -> Scenario:
    whole = paper_scenario(num_targets, 3, use_resources=True, dynamics=dynamics)
    start = whole.horizon.start
    return replace(whole, horizon=Horizon(start=start, end=start + timedelta(hours=8)))


@functools.cache
def computed(dynamics: Dynamics = "physical") -> ScenarioOpportunities:
    return compute_opportunities(mission(dynamics=dynamics), Budget())


def judged(scenario: Scenario, solver: Solver | None = None, **known: Any) -> Judged:
    return plan_scenario(scenario, solver or ForwardSearch(), 0, Budget(), **known)


@functools.cache
def base(dynamics: Dynamics = "physical") -> Judged:
    return judged(mission(dynamics=dynamics), computed=computed(dynamics))


def actions_of(plan: Judged) -> list[JudgedAction]:
    return [a for line in plan.timeline.satellites for a in line.actions if a.mode != "sunpoint"]


def instant(plan: Judged, offset_s: float) -> datetime:
    return plan.scenario.horizon.instant(offset_s)


def name_of(plan: Judged, action: JudgedAction) -> dict[str, Any]:
    assert action.opportunity is not None
    site = int(plan.problem.opportunities.site[action.opportunity])
    if action.mode == "collect":
        return {"target_id": plan.problem.target_ids[site]}
    return {"station_id": plan.problem.station_ids[site]}


def view_of(plan: Judged) -> PlanView:
    return PlanView.of(plan.scenario, plan.problem, plan.timeline)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@pytest.mark.parametrize("solver", sorted(SOLVERS))
def test_every_solver_keeps_what_a_mission_pins(solver: str, dynamics: Dynamics) -> None:
    """A contact booked in whole seconds, an image left out before, an hour without images."""
    plan = base(dynamics)
    contact = next(a for a in actions_of(plan) if a.mode == "contact")
    left_out = next(
        outcome.reason.opportunity
        for outcome in plan.outcomes
        if outcome.reason is not None and outcome.reason.code == "displaced_by"
    )
    assert left_out is not None
    table = plan.problem.opportunities
    promised = plan.problem.target_ids[int(table.site[left_out])]
    collected = [a for a in actions_of(plan) if a.reward > 0.0]
    quiet_s = 4.0 * 3600.0
    pins = Pins(
        keep=(
            PinnedAction(
                satellite_id="paper",
                start=instant(plan, contact.start_s).replace(microsecond=0),
                end=instant(plan, contact.end_s).replace(microsecond=0),
                **name_of(plan, contact),
            ),
            PinnedAction(target_id=promised, start=instant(plan, float(table.start_s[left_out]))),
        ),
        block=(
            BlockedInterval(
                satellite_id="paper",
                start=instant(plan, quiet_s),
                end=instant(plan, quiet_s + 3600.0),
                modes=("collect",),
            ),
        ),
        forbid=(name_of(plan, collected[0])["target_id"],),
    )
    if table.start_s[left_out] > quiet_s - 60.0:
        pins = replace(pins, block=())
    made: Any = SOLVERS[solver]
    limited = {"cut_rounds": 5} if solver == "milp" else {}
    scenario = replace(mission(dynamics=dynamics), pins=pins)
    pinned = judged(scenario, made(**limited), computed=computed(dynamics))
    assert pinned.timeline.is_valid, pinned.timeline.violations
    names = [(a.start_s, name_of(pinned, a)) for a in actions_of(pinned)]
    assert (contact.start_s, name_of(plan, contact)) in names
    assert (float(table.start_s[left_out]), {"target_id": promised}) in names
    outcomes = {pinned.problem.target_ids[o.target]: o for o in pinned.outcomes}
    assert outcomes[pins.forbid[0]].outcome == "excluded"
    if pins.block:
        assert not [
            a for a in actions_of(pinned)
            if a.mode == "collect" and quiet_s - 30.0 < a.start_s < quiet_s + 3600.0
        ]  # fmt: skip
    assert pinned.bound is None or pinned.bound.value >= pinned.timeline.reward
    # Opportunities still have the names of the scenario.
    for action in actions_of(pinned):
        assert action.opportunity is not None
        row = pinned.problem.scenario_row(action.opportunity)
        assert computed(dynamics).opportunities.start_s[row] == action.start_s


@pytest.mark.parametrize(
    ("keep", "code", "words"),
    [
        ({"target_id": "T"}, "pin_ambiguous", "opportunities"),
        ({"target_id": "T", "start": -1.0}, "pin_without_opportunity", "nearest one starts at"),
        ({"opportunity_id": "o999999"}, "pin_without_opportunity", "no such opportunity"),
        ({"opportunity_id": "seventeen"}, "pin_without_opportunity", "no such opportunity"),
        ({"target_id": "none"}, "unknown_target", "'none'"),
        ({"target_id": "T", "satellite_id": "none"}, "unknown_satellite", "'none'"),
        ({}, "value_out_of_range", "target_id"),
    ],
)
def test_a_pin_that_means_nothing_is_refused_by_name(
    keep: dict[str, Any], code: str, words: str
) -> None:
    scenario, table = mission(), computed().opportunities
    counts = np.bincount(table.site[table.kind == COLLECT])
    several = scenario.targets[int(np.flatnonzero(counts > 1)[0])].id
    pin: dict[str, Any] = {name: several if value == "T" else value for name, value in keep.items()}
    if "start" in pin:
        pin["start"] = scenario.horizon.instant(pin["start"] - 3600.0)

    def build() -> None:
        pinned = replace(scenario, pins=Pins(keep=(PinnedAction(**pin),)))
        build_problem(pinned, computed(), Budget())

    with pytest.raises(InvalidScenario, match=words) as refused:
        build()
    assert refused.value.code == code
    assert (refused.value.fault.pointer or "").startswith("/pins/keep/0")


def test_images_that_the_battery_cannot_bear_are_refused_at_the_first_of_them() -> None:
    table = computed().opportunities
    collects = np.flatnonzero(table.kind == COLLECT)
    chain: list[int] = []
    seen: set[int] = set()
    for row in collects.tolist():
        is_clear = not chain or table.start_s[row] > table.end_s[chain[-1]] + 190.0
        if is_clear and int(table.site[row]) not in seen:
            chain.append(row)
            seen.add(int(table.site[row]))
    (satellite,) = mission().satellites
    weak = replace(satellite.resources, collect_drain_per_s=1 / 250.0, sunpoint_charge_per_s=1e-6)
    scenario = replace(
        mission(),
        satellites=(replace(satellite, resources=weak),),
        pins=Pins(keep=tuple(PinnedAction(opportunity_id=f"o{row}") for row in chain[:8])),
    )
    with pytest.raises(InvalidScenario, match="battery reaches") as refused:
        build_problem(scenario, computed(), Budget())
    # 12 % each, and 70 % available.
    assert refused.value.code == "pin_breaks_limits"
    assert refused.value.fault.pointer == "/pins/keep/5"


def test_a_forced_target_is_taken_and_a_forbidden_one_is_not() -> None:
    plan = base()
    displaced = next(
        outcome for outcome in plan.outcomes
        if outcome.reason is not None and outcome.reason.code == "displaced_by"
    )  # fmt: skip
    collected = next(o for o in plan.outcomes if o.outcome == "downlinked")
    contact = next(a for a in actions_of(plan) if a.mode == "contact")
    ids = plan.problem.target_ids
    change = Change(
        force=(PinnedAction(target_id=ids[displaced.target]),),
        forbid=(
            PinnedAction(target_id=ids[collected.target]),
            PinnedAction(start=instant(plan, contact.start_s), **name_of(plan, contact)),
        ),
    )
    changed = what_if(plan.scenario, change, plan.problem, plan.solution.plan)
    other = judged(changed, computed=computed())
    assert other.timeline.is_valid
    assert displaced.target in other.timeline.collected
    assert other.outcomes[collected.target].outcome == "excluded"
    starts = [a.start_s for a in actions_of(other) if a.mode == "contact"]
    assert contact.start_s not in starts
    diff = plan_diff(view_of(plan), view_of(other))
    assert ids[displaced.target] in {a.site_id for a in diff.added}
    assert ids[collected.target] in {a.site_id for a in diff.removed}
    assert plan_diff(view_of(plan), view_of(plan)).is_empty
    assert diff.totals["reward"] == pytest.approx(other.timeline.reward - plan.timeline.reward)


def test_nothing_changed_is_the_same_question() -> None:
    plan = base()
    assert what_if(plan.scenario, Change(), plan.problem, plan.solution.plan) == plan.scenario


def test_settings_are_relaxed_by_name() -> None:
    settings = {"slew_rate_deg_s": 2.0, "off_nadir_max_deg": 60.0, "battery_min_fraction": 0.1}
    changed = relaxed(mission(), Relaxation(satellites={"paper": settings}))
    (satellite,) = changed.satellites
    assert satellite.agility.slew_rate_deg_s == 2.0
    assert satellite.sensor.off_nadir_max_deg == 60.0
    assert satellite.resources.battery_min_fraction == 0.1
    for relax, pointer in (
        (Relaxation(satellites={"none": {}}), "/relax/satellites/none"),
        (Relaxation(satellites={"paper": {"warp": 9}}), "/relax/satellites/paper/warp"),
        (
            Relaxation(satellites={"paper": {"slew_rate_deg_s": -1.0}}),
            "/relax/satellites/paper/slew_rate_deg_s",
        ),
        (Relaxation(targets={"none": {}}), "/relax/targets/none"),
    ):
        with pytest.raises(InvalidScenario) as refused:
            relaxed(mission(), relax)
        assert refused.value.fault.pointer == pointer


def test_what_the_reasons_state_plans_come_to() -> None:
    """A stated change of settings, applied to the scenario, lets that target in."""
    plan = base()
    tried = set()
    for outcome in plan.outcomes:
        reason = outcome.reason
        if reason is None or reason.change is None or reason.change.satellite is None:
            continue
        name = tuple(sorted(reason.change.settings))
        if name in tried:
            continue
        tried.add(name)
        relax = Relaxation(satellites={"paper": dict(reason.change.settings)})
        scenario = relaxed(plan.scenario, relax)
        kept = [a.opportunity for a in actions_of(plan)] + [reason.change.opportunity]
        pins = Pins(keep=tuple(PinnedAction(opportunity_id=f"o{row}") for row in kept))
        forced = judged(replace(scenario, pins=pins), Rule(), computed=computed())
        assert forced.timeline.is_valid, forced.timeline.violations
        assert outcome.target in forced.timeline.collected
    assert tried >= {("slew_rate_deg_s",), ("recorder_max_fraction",)}


def test_an_explanation_goes_through_every_opportunity() -> None:
    plan = base()
    for outcome in plan.outcomes[:60]:
        found = explain_target(plan.problem, plan.solution.plan, plan.timeline, outcome.target)
        assert found.outcome.outcome == outcome.outcome
        if outcome.target in plan.timeline.collected:
            assert found.attempts == ()
            continue
        collects = plan.problem.collects_of(outcome.target)
        assert [a.opportunity for a in found.attempts] == collects.tolist()
        for attempt in found.attempts:
            assert bool(attempt.violations) == bool(attempt.displaces)
            assert (attempt.reward_delta is not None) == attempt.is_settled


def test_an_explanation_names_what_pins_have_ruled_out() -> None:
    plan = base()
    kept = next(a for a in actions_of(plan) if a.mode == "contact")
    assert kept.opportunity is not None
    pins = Pins(keep=(PinnedAction(opportunity_id=f"o{kept.opportunity}"),))
    other = judged(replace(plan.scenario, pins=pins), Rule(), computed=computed())
    assert other.problem.pinned.ruled_out
    for target, struck in other.problem.pinned.ruled_out.items():
        if target in other.timeline.collected:
            continue
        found = explain_target(other.problem, other.solution.plan, other.timeline, target)
        ruled_out = [a for a in found.attempts if a.ruled_out]
        assert [a.scenario_row for a in ruled_out] == [s.row for s in struck]
        for attempt in ruled_out:
            rows = [other.solution.plan.actions[p].opportunity for p in attempt.displaces]
            assert [other.problem.opportunities.kind[row] for row in rows] == [CONTACT]


@pytest.mark.parametrize("why", [OUTSIDE_LIMITS, ACCESS_TOO_SHORT])
def test_what_is_said_to_give_access_does(why: int) -> None:
    scenario = paper_scenario(1000, 0, use_resources=True)
    access = compute_opportunities(scenario, Budget()).target_access
    target = int(np.flatnonzero(access == why)[0])
    changes = {c.setting: c for c in access_changes(scenario, target, Budget())}
    assert {"off_nadir_max_deg", "horizon_end"} <= set(changes)
    assert ("collect_s" in changes) == (why == ACCESS_TOO_SHORT)
    own_id = scenario.targets[target].id
    applied: dict[str, Callable[[Any], Relaxation]] = {
        "off_nadir_max_deg": lambda v: Relaxation(satellites={"paper": {"off_nadir_max_deg": v}}),
        "horizon_end": lambda v: Relaxation(horizon_end=v),
        "collect_s": lambda v: Relaxation(targets={own_id: {"collect_s": v}}),
    }
    for setting, change in changes.items():
        looser = relaxed(scenario, applied[setting](change.value))
        assert compute_opportunities(looser, Budget()).target_access[target] == ACCESS_FOUND
    value = changes["off_nadir_max_deg"].value
    assert isinstance(value, float)
    tighter = relaxed(scenario, applied["off_nadir_max_deg"](value - 0.1))
    assert compute_opportunities(tighter, Budget()).target_access[target] != ACCESS_FOUND


def test_pins_of_an_optimal_plan_change_nothing() -> None:
    """With all actions of a plan pinned, every solver returns the same plan."""
    small = replace(mission(), targets=mission().targets[:25])
    plan = judged(small, Milp())
    pins = Pins(
        keep=tuple(
            PinnedAction(start=instant(plan, a.start_s), **name_of(plan, a))
            for a in actions_of(plan)
        )
    )
    again = judged(replace(small, pins=pins), Rule(contact_above_fraction=1.0))
    assert plan_diff(view_of(plan), view_of(again)).totals.get("reward", 0.0) == 0.0
    assert again.timeline.is_valid
