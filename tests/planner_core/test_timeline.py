"""The referee against hand-worked plans: the meaning of each rule of the plan model."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from planner_core.domain import Agility
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Problem,
    Sunlight,
)
from planner_core.problem.plan import Action, Plan
from planner_core.referee.replay import plan_sha256, replay
from planner_core.referee.timeline import Timeline
from tests.planner_core.problems import TIGHT, Task, make_problem


def collect(site: int, start_s: float, angle_deg: float = 0.0, satellite: int = 0) -> Task:
    return Task(
        kind=COLLECT,
        site=site,
        start_s=start_s,
        end_s=start_s + 30.0,
        angle_deg=angle_deg,
        satellite=satellite,
        margin_s=10.0,
    )


def contact(start_s: float, end_s: float, angle_deg: float = 0.0, satellite: int = 0) -> Task:
    return Task(
        kind=CONTACT,
        site=0,
        start_s=start_s,
        end_s=end_s,
        angle_deg=angle_deg,
        satellite=satellite,
    )


def judge(problem: Problem, *rows: int) -> Timeline:
    return replay(problem, Plan.of(problem, rows))


def codes(timeline: Timeline) -> list[str]:
    return [v.code for v in timeline.violations]


def test_a_turn_that_just_fits_is_valid_and_one_millisecond_less_is_a_slew_violation() -> None:
    fits = make_problem(
        [collect(0, 0.0), collect(1, 70.0, 40.0)], num_targets=2, use_resources=False
    )
    assert judge(fits, 0, 1).is_valid
    late = make_problem(
        [collect(0, 0.0), collect(1, 69.999, 40.0)], num_targets=2, use_resources=False
    )
    timeline = judge(late, 0, 1)
    assert codes(timeline) == ["slew"]
    violation = timeline.violations[0]
    assert violation.needed == pytest.approx(40.0)
    assert violation.available == pytest.approx(39.999)
    assert violation.at_s == 69.999
    assert timeline.reward == 1.0, "the collect that cannot be reached earns nothing"


def test_settling_and_acceleration_lengthen_the_turn() -> None:
    agility = Agility(slew_rate_deg_s=1.0, acceleration_deg_s2=0.5, settle_s=3.0)
    problem = make_problem(
        [collect(0, 0.0), collect(1, 75.0, 40.0)],
        num_targets=2,
        agility=agility,
        use_resources=False,
    )
    timeline = judge(problem, 0, 1)
    slew = timeline.satellites[0].actions[1].slew
    assert slew is not None
    assert slew.needed_s == pytest.approx(40.0 + 2.0 + 3.0)
    assert slew.available_s == pytest.approx(45.0)
    assert timeline.is_valid


def test_overlap_is_seen_past_a_short_task_inside_a_long_one() -> None:
    problem = make_problem(
        [contact(0.0, 200.0), collect(0, 20.0), collect(1, 100.0)],
        num_targets=2,
        use_resources=False,
    )
    timeline = judge(problem, 0, 1, 2)
    assert codes(timeline) == ["overlap", "overlap"]
    assert [(v.needed, v.available) for v in timeline.violations] == [(0.0, -180.0), (0.0, -100.0)]
    assert timeline.violations[0].detail == "It starts 180.000 s before the previous task ends."
    assert timeline.reward == 0.0


def test_a_plan_is_judged_alike_in_whatever_order_its_actions_are_listed() -> None:
    problem = make_problem(
        [collect(0, 0.0), collect(1, 20.0), contact(200.0, 300.0)], num_targets=2
    )
    plan = Plan.of(problem, [0, 1, 2])
    timeline, turned = replay(problem, plan), replay(problem, Plan(plan.actions[::-1]))
    assert [(v.code, v.blamed) for v in timeline.violations] == [("overlap", (1,))]
    assert [(v.code, v.blamed) for v in turned.violations] == [("overlap", (1,))]
    assert turned.collected[0].worth == timeline.reward == turned.reward == 1.0
    assert turned.on_board == timeline.on_board


def test_an_action_outside_its_access_or_moved_without_leave_is_a_window_violation() -> None:
    problem = make_problem([collect(0, 100.0)], num_targets=1)
    moved = Plan((Action(105.0, 135.0, 0),))
    assert codes(replay(problem, moved)) == ["window"]
    assert replay(replace(problem, continuous_starts=True), moved).is_valid
    outside = Plan((Action(111.0, 141.0, 0),))
    assert codes(replay(replace(problem, continuous_starts=True), outside)) == ["window"]
    short = Plan((Action(100.0, 120.0, 0),))
    assert codes(replay(problem, short)) == ["window"]


def test_an_access_that_reaches_beyond_the_horizon_may_be_used_within_it_alone() -> None:
    whole = make_problem([collect(0, 5.0), collect(1, 965.0)], num_targets=2)
    problem = replace(whole, continuous_starts=True)
    within = Plan((Action(0.0, 30.0, 0), Action(970.0, 1000.0, 1)))
    assert replay(problem, within).is_valid
    beyond = replay(problem, Plan((Action(-0.5, 29.5, 0), Action(970.5, 1000.5, 1))))
    assert [(v.code, v.needed, v.available) for v in beyond.violations] == [
        ("window", 0.0, -0.5),
        ("window", 1000.0, 1000.5),
    ]


@pytest.mark.parametrize(
    ("quality", "earns"),
    [((0.4, 0.9), 1), ((0.9, 0.4), 0), ((0.5, 0.5), 0), ((0.0, 0.0), 0)],
)
def test_the_best_image_of_a_target_counts_and_of_equal_ones_the_first(
    quality: tuple[float, float], earns: int
) -> None:
    tasks = [replace(collect(0, 200.0 * i), quality=q) for i, q in enumerate(quality)]
    problem = make_problem(tasks, num_targets=1, use_resources=False, rewards=[3.0])
    timeline = judge(problem, 0, 1)
    assert timeline.is_valid
    assert codes(timeline) == ["duplicate"]
    why = "has a better image later" if earns else "is collected already"
    assert timeline.violations[0].detail == f"Target t0 {why}."
    assert timeline.collected[0].position == earns
    assert timeline.reward == timeline.collected[0].worth == 3.0 * max(quality)
    (line,) = timeline.satellites
    assert line.actions[earns].reward == timeline.reward
    assert line.actions[1 - earns].reward == 0.0


def test_a_better_image_that_breaks_a_rule_does_not_count() -> None:
    tasks = [replace(collect(0, 0.0), quality=0.4), replace(collect(0, 200.0), quality=0.9)]
    problem = make_problem(
        [*tasks, collect(1, 195.0, 40.0)], num_targets=2, use_resources=False, rewards=[3.0, 0.0]
    )
    timeline = judge(problem, 0, 1, 2)
    assert codes(timeline) == ["overlap"]
    assert timeline.collected[0].position == 0
    assert timeline.reward == pytest.approx(1.2)


def test_a_station_with_one_antenna_serves_one_satellite_at_a_time() -> None:
    tasks = [contact(0.0, 100.0), contact(50.0, 150.0, satellite=1), contact(100.0, 180.0)]
    one = make_problem(tasks, num_targets=0, num_satellites=2)
    (violation,) = judge(one, 0, 1).violations
    assert (violation.code, violation.needed, violation.available) == ("station", 2.0, 1.0)
    assert violation.detail == "Station g0 serves another satellite until 100.000 s."
    assert judge(one, 0, 2).is_valid, "the next contact may begin as the last ends"
    two = make_problem(tasks, num_targets=0, num_satellites=2, antennas=2)
    assert judge(two, 0, 1, 2).is_valid


def test_the_second_collect_of_a_target_earns_nothing_and_is_only_a_warning() -> None:
    problem = make_problem(
        [collect(0, 0.0), collect(0, 50.0, satellite=1)],
        num_targets=1,
        num_satellites=2,
        rewards=[7.0],
    )
    timeline = judge(problem, 0, 1)
    assert codes(timeline) == ["duplicate"]
    assert timeline.is_valid
    assert timeline.reward == 7.0
    assert timeline.collected[0].satellite == 0


def test_battery_and_recorder_follow_the_hand_worked_integral() -> None:
    # Collect 100-130, contact 400-450, horizon 1000; TIGHT starts at 0.7 and 0.1.
    problem = make_problem([collect(0, 100.0), contact(400.0, 450.0)], num_targets=1)
    timeline = judge(problem, 0, 1)
    actions = {a.mode: a for a in timeline.satellites[0].actions if a.mode != "sunpoint"}
    battery = 0.7 + 100 / 2500 - 30 / 300
    recorder = 0.1 + 130e-4 + 30 / 200
    assert actions["collect"].battery_end == pytest.approx(battery)
    assert actions["collect"].recorder_end == pytest.approx(recorder)
    battery += 270 / 2500 - 50 / 1200
    recorder += 320e-4 - 50 / 250
    assert actions["contact"].battery_end == pytest.approx(battery)
    assert actions["contact"].recorder_end == pytest.approx(recorder)
    assert timeline.downlinked[0] == pytest.approx(50 / 250)
    assert timeline.battery_min == pytest.approx(0.7 + 100 / 2500 - 30 / 300)
    assert timeline.recorder_max == pytest.approx(0.1 + 130e-4 + 30 / 200 + 270e-4)


def test_there_is_no_idle_time_between_tasks_that_follow_at_once() -> None:
    problem = make_problem([collect(0, 0.0), collect(1, 30.0)], num_targets=2)
    (line,) = judge(problem, 0, 1).satellites
    assert [a.mode for a in line.actions] == ["collect", "collect", "sunpoint"]


def test_an_image_is_downlinked_only_once_everything_before_it_is_down() -> None:
    # 0.1 + telemetry are in the recorder before the image: a 70 s contact downlinks 0.28.
    image, long, short = collect(0, 0.0), contact(100.0, 170.0), contact(100.0, 150.0)
    needed = 0.1 + 30e-4 + 30 / 200
    assert 50 / 250 < needed < 70 / 250
    assert judge(make_problem([image, long], num_targets=1), 0, 1).collected[0].is_downlinked
    assert not judge(make_problem([image, short], num_targets=1), 0, 1).collected[0].is_downlinked


def test_a_recorder_that_runs_empty_in_a_contact_stays_empty() -> None:
    problem = make_problem([contact(0.0, 140.0)], num_targets=0)
    timeline = judge(problem, 0)
    contact_action = timeline.satellites[0].actions[0]
    assert contact_action.recorder_end == 0.0
    assert timeline.downlinked[0] == pytest.approx(0.1 + 140e-4)


def test_limits_are_strict_and_the_action_that_breaks_them_earns_nothing() -> None:
    battery = replace(
        TIGHT,
        battery_min_fraction=0.25,
        initial_battery_fraction=0.5,
        collect_drain_per_s=0.25 / 30.0,
        sunpoint_charge_per_s=0.0,
    )
    exactly = make_problem([collect(0, 100.0)], num_targets=1, resources=battery)
    timeline = judge(exactly, 0)
    assert codes(timeline) == ["battery"]
    assert timeline.reward == 0.0
    assert timeline.violations[0].needed == 0.25
    above = replace(battery, initial_battery_fraction=0.5 + 1e-9)
    assert judge(make_problem([collect(0, 100.0)], num_targets=1, resources=above), 0).is_valid


def test_telemetry_alone_can_fill_the_recorder_and_no_action_is_blamed() -> None:
    filling = replace(TIGHT, telemetry_per_s=1e-3)
    timeline = replay(make_problem([], num_targets=0, resources=filling), Plan())
    assert codes(timeline) == ["recorder"]
    violation = timeline.violations[0]
    assert violation.at_s == pytest.approx(400.37)
    assert violation.blamed == ()


def test_an_eclipse_aware_battery_charges_in_sunlight_only() -> None:
    shade = Sunlight(enter_s=np.array([0.0, 600.0]), exit_s=np.array([100.0, 700.0]))
    low = replace(TIGHT, initial_battery_fraction=0.5)
    problem = make_problem([collect(0, 300.0)], num_targets=1, resources=low, sunlight=shade)
    timeline = judge(problem, 0)
    taken = timeline.satellites[0].actions[1]
    assert taken.battery_end == pytest.approx(0.5 + 100 / 2500 - 30 / 300)
    assert timeline.satellites[0].actions[-1].battery_end == pytest.approx(
        0.5 + 200 / 2500 - 30 / 300
    )


def test_the_event_model_books_lumps_at_starts_and_forgoes_the_segment_before_a_task() -> None:
    problem = make_problem(
        [collect(0, 100.0), collect(1, 300.0), collect(2, 500.0)], num_targets=3, dynamics="paper"
    )
    timeline = judge(problem, 1)
    taken = next(a for a in timeline.satellites[0].actions if a.mode == "collect")
    # Sun-pointing to event 0 at 100 s charges; the segment from 100 to 300 s is forgone.
    assert taken.battery_end == pytest.approx(0.7 + 100 / 2500 - 30 / 300)
    assert taken.recorder_end == pytest.approx(0.1 + 300e-4 + 30 / 200)
    assert timeline.satellites[0].actions[-1].battery_end == pytest.approx(
        0.7 + 100 / 2500 - 30 / 300 + 200 / 2500
    )


def test_a_recorder_of_the_event_model_holds_no_more_than_it_can() -> None:
    full = replace(TIGHT, initial_recorder_fraction=0.95, telemetry_per_s=1e-3)
    tasks = [contact(200.0, 230.0), collect(0, 400.0), collect(1, 600.0)]
    problem = make_problem(tasks, num_targets=2, resources=full, dynamics="paper")
    timeline = judge(problem, 0, 1)
    (line,) = timeline.satellites
    levels = {a.mode: a.recorder_end for a in line.actions if a.mode != "sunpoint"}
    assert levels == {"contact": 1.0, "collect": 1.0}
    assert timeline.recorder_max == 1.0


def test_without_resources_there_is_neither_sun_pointing_nor_a_curve() -> None:
    problem = make_problem([collect(0, 100.0)], num_targets=1, use_resources=False)
    timeline = judge(problem, 0)
    assert [a.mode for a in timeline.satellites[0].actions] == ["collect"]
    assert timeline.satellites[0].resources is None
    assert timeline.battery_min is None


def test_the_plan_hash_tells_plans_apart_and_ignores_the_order_of_actions() -> None:
    problem = make_problem([collect(0, 0.0), collect(1, 200.0)], num_targets=2)
    plan = Plan.of(problem, [0, 1])
    assert plan_sha256(problem, plan) == plan_sha256(problem, Plan(plan.actions[::-1]))
    assert plan_sha256(problem, plan) != plan_sha256(problem, Plan.of(problem, [0]))
    # 1.001 s are 1000.9999999999999 ms in floating point, but must be 1001 ms in a plan.
    plan, later, earlier = (Plan((Action(s, s + 30.0, 0),)) for s in (1.001, 1.0014, 1.0))
    assert plan_sha256(problem, plan) == plan_sha256(problem, later)
    assert plan_sha256(problem, plan) != plan_sha256(problem, earlier)


def test_the_plan_hash_stays_as_it_is_and_names_targets_by_their_ids() -> None:
    problem = make_problem([collect(0, 0.0), contact(200.0, 300.0)], num_targets=1)
    plan = Plan.of(problem, [0, 1])
    listed = b'[[0,"collect","t0",0,30000],[0,"contact",0,200000,300000]]'
    assert plan_sha256(problem, plan) == hashlib.sha256(listed).hexdigest()
