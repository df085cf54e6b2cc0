"""Horizons that begin in the middle of a plan: flown actions give the satellite's state.

Everything is compared with the whole plan, judged from its own beginning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import (
    Agility,
    Flown,
    GroundStation,
    Horizon,
    Objective,
    Replan,
    Resources,
    Scenario,
    State,
    Target,
)
from planner_core.errors import InvalidScenario
from planner_core.pins import PinnedAction
from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.run import plan_scenario
from planner_core.solvers.registry import Certified, Rule
from tests.geometry import hours, orbit, satellite
from tests.planner_core.budgets import expiring, reports

BEGIN = hours(1).start
END = BEGIN + timedelta(hours=5)
ROOMY = replace(
    Resources.paper(5668.7), recorder_capacity_mbit=1000.0, recorder_max_fraction=0.9,
    eclipse_aware=True, initial_battery_fraction=0.9, collect_fill_per_s=1 / 1000,
    downlink_per_s=8 / 3000,
)  # fmt: skip
KINDS: dict[str, dict[str, Any]] = {
    "free": {"resources": ROOMY},
    "slew": {"resources": replace(ROOMY, sun_pointing="slew", idle_drain_per_s=2e-5)},
    "moving": {
        "resources": replace(ROOMY, sun_pointing="slew"),
        "agility": Agility(
            slew_rate_deg_s=2.0, acceleration_deg_s2=0.3, settle_s=2.0, slew_model="moving"
        ),
    },
    "elevation": {
        "resources": replace(
            ROOMY,
            downlink_per_s=8 / 3000,
            downlink_by_elevation=((5.0, 3 / 3000), (60.0, 8 / 3000)),
        )
    },
}


def mission(kind: str, **more: Any) -> Scenario:
    sites = np.random.default_rng(4).uniform((-70.0, -180.0), (70.0, 180.0), (250, 2)).tolist()
    values: dict[str, Any] = {
        "horizon": Horizon(start=BEGIN, end=END),
        "satellites": (replace(satellite(orbit()), **KINDS[kind]),),
        "targets": tuple(
            Target(id=f"t{i}", lat_deg=lat, lon_deg=lon) for i, (lat, lon) in enumerate(sites)
        ),
        "ground_stations": (
            GroundStation(id="sv", name="sv", lat_deg=78.2, lon_deg=15.4, setup_s=20.0),
            GroundStation(id="tr", name="tr", lat_deg=-72.0, lon_deg=2.5),
        ),
        "objective": Objective(collected_share=0.5, half_life_s=7200.0),
    }
    return Scenario(**(values | more))


@dataclass(frozen=True, kw_only=True)
class Whole:
    """A plan from its beginning, and its actions as a client describes them."""

    scenario: Scenario
    problem: Problem
    timeline: Timeline
    actions: tuple[Flown, ...]


def whole_of(kind: str) -> Whole:
    scenario = mission(kind)
    judged = plan_scenario(scenario, Rule(), 0, Budget())
    assert judged.timeline.is_valid
    return Whole(
        scenario=scenario, problem=judged.problem, timeline=judged.timeline,
        actions=tuple(words(scenario, judged.problem, judged.solution.plan)),
    )  # fmt: skip


def words(scenario: Scenario, problem: Problem, plan: Plan) -> list[Flown]:
    found = []
    for action in plan.actions:
        row = action.opportunity
        site = int(problem.opportunities.site[row])
        is_image = problem.opportunities.kind[row] == COLLECT
        found.append(
            Flown(
                satellite_id=scenario.satellites[int(problem.opportunities.satellite[row])].id,
                target_id=problem.target_ids[site] if is_image else None,
                station_id=None if is_image else problem.station_ids[site],
                start=scenario.horizon.instant(action.start_s),
                end=scenario.horizon.instant(action.end_s),
            )
        )
    return found


def continued(
    whole: Whole, start: datetime, freeze_until: datetime, *states: State,
    flown: tuple[Flown, ...] | None = None,
) -> Scenario:  # fmt: skip
    """Return the scenario that continues a plan from an instant and keeps all that remains."""
    own = whole.scenario.satellites[0]
    before = State(
        satellite_id=own.id, at=BEGIN, recorder_fraction=0.0,
        battery_fraction=own.resources.initial_battery_fraction,
    )  # fmt: skip
    base = tuple(
        PinnedAction(
            satellite_id=one.satellite_id, target_id=one.target_id, station_id=one.station_id,
            start=max(one.start, start), end=one.end,
        )
        for one in whole.actions
        if one.end > start
    )  # fmt: skip
    done = tuple(one for one in whole.actions if one.start < start)
    return replace(
        whole.scenario,
        horizon=Horizon(start=start, end=END),
        states=states or (before,),
        replan=Replan(base=base, freeze_until=freeze_until, flown=done if flown is None else flown),
    )


def built(scenario: Scenario) -> Problem:
    return build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())


def instants(whole: Whole) -> list[datetime]:
    """Return instants between actions, during an image and a contact, and at their edges."""
    images = [one for one in whole.actions if one.target_id is not None]
    contacts = [one for one in whole.actions if one.station_id is not None]
    image, contact = images[len(images) // 2], contacts[len(contacts) // 2]
    between = next(
        a.end + timedelta(seconds=5)
        for a, b in zip(whole.actions[10:], whole.actions[11:], strict=False)
        if (b.start - a.end).total_seconds() > 10.0
    )
    return [
        BEGIN + timedelta(minutes=80), between, contact.end + timedelta(minutes=3),
        image.start + timedelta(seconds=12), contact.start + timedelta(seconds=90),
        image.end, contact.start,
    ]  # fmt: skip


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_a_plan_goes_on_as_if_its_horizon_had_not_begun_anew(kind: str) -> None:
    """Battery, recorder, times of delivery, and the reward of the rest."""
    whole = whole_of(kind)
    line = whole.timeline.satellites[0].resources
    assert line is not None
    for start in instants(whole):
        problem = built(continued(whole, start, END))
        plan = Plan().with_kept(problem)
        timeline = replay(problem, plan)
        assert timeline.is_valid, (start, timeline.violations)
        begun_s = (start - BEGIN).total_seconds()
        later = [one for one in whole.actions if one.end > start]
        found = words(continued(whole, start, END), problem, plan)
        assert found == [replace(one, start=max(one.start, start)) for one in later]
        own = timeline.satellites[0].resources
        assert own is not None
        in_contact = any(
            one.station_id == "sv" and one.start < start < one.end for one in whole.actions
        )
        # The rest of a pass is set up again: a little less is downlinked.
        # A rate by elevation is sampled from the start of the horizon.
        slack = 25.0 * 8 / 3000 if in_contact else 5e-5 if kind == "elevation" else 1e-6
        at_s = np.linspace(0.0, problem.horizon_s, 500)
        assert np.interp(at_s, own.time_s, own.battery) == pytest.approx(
            np.interp(at_s + begun_s, line.time_s, line.battery), abs=1e-5
        )
        assert np.interp(at_s, own.time_s, own.recorder) == pytest.approx(
            np.interp(at_s + begun_s, line.time_s, line.recorder), abs=slack + 1e-6
        )
        if in_contact:
            continue
        before = {
            round(c.delivered_s - begun_s, 1): target
            for target, c in whole.timeline.collected.items()
            if c.delivered_s is not None and c.delivered_s > begun_s
        }
        after = {
            round(c.delivered_s, 1): target
            for target, c in timeline.collected.items()
            if c.delivered_s is not None
        }
        after |= {
            round(one.delivered_s, 1): one.target
            for one in timeline.brought_down
            if one.delivered_s is not None and one.target >= 0
        }
        assert sorted(before.values()) == sorted(after.values())
        for (mine, _), (other, _) in zip(
            sorted(after.items()), sorted(before.items()), strict=True
        ):
            assert mine == pytest.approx(other, abs=0.3)
        # Everything is earned once: images taken before earned their half then.
        earned_before = sum(
            0.5
            + (
                0.0
                if (c.delivered_s or np.inf) > begun_s
                else 0.5 * 2 ** (-(c.age_s or 0.0) / 7200.0)
            )
            for c in whole.timeline.collected.values()
            if whole.actions[c.position].end <= start
        )
        assert timeline.reward + earned_before == pytest.approx(whole.timeline.reward, abs=0.01)


def test_what_was_imaged_is_not_imaged_again_and_what_failed_is() -> None:
    whole = whole_of("free")
    start = BEGIN + timedelta(hours=2)
    done = [one for one in whole.actions if one.start < start]
    images = [one for one in done if one.target_id is not None]
    failed, skipped = images[3], images[5]
    flown = tuple(
        replace(
            one, outcome="failed" if one is failed else "skipped" if one is skipped else "executed"
        )
        for one in done
    )
    scenario = continued(whole, start, start, flown=flown)
    problem = built(scenario)
    imaged = {problem.target_ids[one.target] for one in problem.on_board if one.target >= 0}
    assert imaged == {one.target_id for one in images} - {failed.target_id, skipped.target_id}
    offered = {problem.target_ids[t] for t in problem.opportunities.site[
        problem.opportunities.kind == COLLECT]}  # fmt: skip
    assert not offered & imaged


def _levels(whole: Whole, flown: tuple[Flown, ...], start: datetime) -> tuple[float, float]:
    r = built(continued(whole, start, start, flown=flown)).satellites[0].resources
    return r.initial_battery_fraction, r.initial_recorder_fraction


def test_what_failed_draws_energy_and_holds_no_data() -> None:
    """The last image before the horizon failed or succeeded, with various data, or was skipped."""
    whole = whole_of("free")
    image = [one for one in whole.actions if one.target_id is not None][8]
    start = image.end + timedelta(seconds=20)
    done = [one for one in whole.actions if one.start < start]
    others = tuple(one for one in done if one is not image)
    drain = ROOMY.collect_drain_per_s * 30.0
    fill = ROOMY.collect_fill_per_s * 30.0
    whole_battery, whole_recorder = _levels(whole, (*others, image), start)
    for outcome, mbit, data in (
        ("failed", None, 0.0), ("failed", 4.0, 0.004), ("partial", 5.0, 0.005),
        ("partial", None, fill), ("executed", 7.0, 0.007),
    ):  # fmt: skip
        told = replace(image, outcome=outcome, mbit=mbit)  # type: ignore[arg-type]
        battery, recorder = _levels(whole, (*others, told), start)
        assert battery == pytest.approx(whole_battery, abs=1e-9)
        assert whole_recorder - recorder == pytest.approx(fill - data, abs=1e-9)
    battery, recorder = _levels(whole, (*others, replace(image, outcome="skipped")), start)
    assert whole_recorder - recorder == pytest.approx(fill, abs=1e-9)
    charged = 30.0 * ROOMY.sunpoint_charge_per_s
    assert whole_battery + drain - 1e-9 <= battery <= whole_battery + drain + charged + 1e-9


def test_a_contact_that_failed_leaves_its_data_on_board() -> None:
    whole = whole_of("free")
    contact = next(one for one in whole.actions if one.station_id is not None)
    start = contact.end + timedelta(seconds=1)
    done = [one for one in whole.actions if one.start < start]
    lost = tuple(replace(one, outcome="failed") if one is contact else one for one in done)
    problems = [built(continued(whole, start, start, flown=flown)) for flown in (tuple(done), lost)]
    levels = [p.satellites[0].resources.initial_recorder_fraction for p in problems]
    amounts = [sum(one.amount for one in p.on_board if one.target >= 0) for p in problems]
    assert levels[1] > levels[0]
    assert amounts[1] > amounts[0] >= 0.0
    waiting = [sum(one.is_waiting for one in p.on_board) for p in problems]
    assert waiting[1] == sum(one.target_id is not None for one in done)
    assert waiting[0] < waiting[1]


def test_telemetry_in_the_middle_corrects_what_was_planned() -> None:
    """From that state on; only actions flown later change the levels."""
    whole = whole_of("free")
    start = BEGIN + timedelta(hours=2)
    at = BEGIN + timedelta(hours=1)
    own = whole.scenario.satellites[0].id
    line = whole.timeline.satellites[0].resources
    assert line is not None
    battery, recorder = (
        float(np.interp((at - BEGIN).total_seconds(), line.time_s, level))
        for level in (line.battery, line.recorder)
    )
    lower = State(
        satellite_id=own, at=at, battery_fraction=battery - 0.02, recorder_fraction=recorder + 0.03
    )
    r = built(continued(whole, start, start, lower)).satellites[0].resources
    plain = built(continued(whole, start, start)).satellites[0].resources
    assert r.initial_battery_fraction == pytest.approx(
        plain.initial_battery_fraction - 0.02, abs=0.02
    )
    assert r.initial_battery_fraction < plain.initial_battery_fraction + 1e-9
    assert r.initial_recorder_fraction > plain.initial_recorder_fraction - 1e-9


def test_a_replan_from_a_state_keeps_the_frozen_part_to_the_bit() -> None:
    whole = whole_of("moving")
    for start in instants(whole)[:4]:
        freeze = start + timedelta(minutes=25)
        scenario = continued(whole, start, freeze)
        judged = plan_scenario(scenario, Certified(), 0, expiring(reports(5)))
        assert judged.timeline.is_valid
        flown = words(scenario, judged.problem, judged.solution.plan)
        expected = [
            replace(one, start=max(one.start, start))
            for one in whole.actions
            if one.end > start and one.start < freeze
        ]
        assert [one for one in flown if one.start < freeze] == expected
        assert judged.bound is not None
        assert judged.bound.value >= judged.timeline.reward


def _newer(scenario: Scenario, shift_deg: float) -> Scenario:
    """Return the scenario with elements that put the satellite further along its orbit."""
    own = scenario.satellites[0]
    newer = replace(own, orbit=orbit(mean_anomaly_deg=shift_deg))
    assert scenario.replan is not None
    return replace(
        scenario, satellites=(newer,), replan=replace(scenario.replan, elements="newest")
    )


def test_newest_elements_leave_what_is_frozen_and_match_what_is_not() -> None:
    """A shift of seconds along the orbit moves accesses by as much."""
    whole = whole_of("free")
    freeze = BEGIN + timedelta(hours=2)
    scenario = _newer(continued(whole, BEGIN, freeze), 0.5)
    problem = built(scenario)
    kept = words(scenario, problem, Plan().with_kept(problem))
    frozen = [one for one in whole.actions if one.start < freeze]
    assert kept == frozen
    judged = plan_scenario(scenario, Rule(), 0, Budget(0.5))
    assert judged.timeline.is_valid
    later = [
        one for one in words(scenario, judged.problem, judged.solution.plan) if one.start >= freeze
    ]
    matched = 0
    for one in whole.actions:
        if one.start < freeze:
            continue
        near = [
            abs((other.start - one.start).total_seconds())
            for other in later
            if (other.target_id, other.station_id) == (one.target_id, one.station_id)
        ]
        matched += min(near, default=np.inf) < 60.0
    assert matched > 0.6 * sum(one.start >= freeze for one in whole.actions)


def test_a_frozen_action_that_newest_elements_do_not_see_is_refused() -> None:
    whole = whole_of("free")
    scenario = _newer(continued(whole, BEGIN, BEGIN + timedelta(hours=2)), 90.0)
    with pytest.raises(InvalidScenario) as caught:
        built(scenario)
    fault = caught.value.fault
    assert fault.code == "frozen_not_kept"
    assert (fault.pointer or "").startswith("/replan/base/")
    assert "does not see" in fault.detail
