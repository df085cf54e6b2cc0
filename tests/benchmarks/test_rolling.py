"""The closed loop: its world agrees with the referee, and luck is the same for all solvers."""

from __future__ import annotations

import math
from collections import Counter
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from benchmarks.missions import START, paper_scenario, problem_of
from benchmarks.rolling.__main__ import rows_of, run
from benchmarks.rolling.loop import POLICIES, Case, Loop, commands_of
from benchmarks.rolling.plot import compared
from benchmarks.rolling.plot import main as draw
from benchmarks.rolling.world import Command, Flown, Luck, Report
from planner_core.budget import Budget
from planner_core.problem import COLLECT
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Rule


class Lucky(Luck):
    """Luck in which nothing fails."""

    def image_fails(self, satellite: int, target_id: str, start: object) -> bool:
        return False

    def pass_is_lost(self, satellite: int, station_id: str, at: object) -> bool:
        return False

    def safe_modes(self, satellite: int) -> tuple[()]:
        return ()


def test_without_bad_luck_it_flies_what_the_referee_says() -> None:
    scenario = paper_scenario(300, 0, use_resources=True)
    problem = problem_of(scenario)
    plan = Rule().solve(problem, Budget(), 0).plan
    timeline = replay(problem, plan)
    assert timeline.is_valid
    flown = Flown(
        number=0, resources=scenario.satellites[0].resources, luck=Lucky(seed=0, days=1)
    )  # fmt: skip
    flown.commands = commands_of(scenario.horizon, problem, plan)
    flown.fly(scenario.horizon.end)
    points = timeline.satellites[0].resources
    assert points is not None
    assert flown.battery == pytest.approx(points.battery[-1], abs=1e-7)
    assert flown.recorder == pytest.approx(points.recorder[-1], abs=1e-7)
    assert {r.outcome for r in flown.reports} == {"taken"}
    assert len(flown.reports) == sum(
        problem.opportunities.kind[a.opportunity] == COLLECT for a in plan.actions
    )
    down = {
        problem.target_ids[int(problem.opportunities.site[a.opportunity])]
        for satellite in timeline.satellites
        for a in satellite.actions
        if a.opportunity is not None and a.mode == "collect" and a.delivered_s is not None
    }
    assert down
    assert flown.down.keys() == down


def test_what_finds_no_room_or_no_power_is_skipped_and_said() -> None:
    resources = paper_scenario(1, 0, use_resources=True).satellites[0].resources
    flown = Flown(number=0, resources=resources, luck=Lucky(seed=0, days=1))
    length = timedelta(seconds=30)
    images = [
        Command(start=START + i * length, end=START + (i + 1) * length, mode="collect",
                site_id=f"t{i}")
        for i in range(400)
    ]  # fmt: skip
    flown.commands = tuple(images)
    flown.fly(START + 401 * length)
    outcomes = [report.outcome for report in flown.reports]
    assert len(outcomes) == 400
    assert 0 < outcomes.count("taken") < 400
    assert flown.recorder < resources.recorder_max_fraction + 400 * 30 * resources.telemetry_per_s
    assert flown.battery >= resources.battery_min_fraction - 1e-9


def test_luck_hangs_on_what_happens_and_not_on_who_asks() -> None:
    luck = Luck(seed=3, days=7)
    starts = [START + timedelta(minutes=90 * i) for i in range(100)]
    fails = [luck.image_fails(0, f"t{i}", at) for i, at in enumerate(starts)]
    assert fails == [
        Luck(seed=3, days=7).image_fails(0, f"t{i}", at) for i, at in enumerate(starts)
    ]
    many = [luck.image_fails(i % 3, f"t{i}", starts[i % 100]) for i in range(3000)]
    assert np.mean(many) == pytest.approx(0.03, abs=0.01)
    lost = [luck.pass_is_lost(i, "svalbard", at) for i in range(20) for at in starts]
    assert np.mean(lost) == pytest.approx(0.10, abs=0.02)
    requests = luck.requests(600, 250)
    assert len(requests) == 600 + 7 * 250
    assert np.mean([request.is_urgent for request in requests]) == pytest.approx(0.08, abs=0.02)
    assert all(request.target.due > request.asked_at for request in requests if request.target.due)


def test_a_short_loop_makes_a_row_once(tmp_path: Path) -> None:
    table = tmp_path / "rolling.csv"
    # So many that the recorder fills: nothing else makes contacts necessary here.
    case = Case(policy="4", seed=1, days=1, num_first=300, num_a_day=50)
    run(table, "collected", case)
    run(table, "collected", case)
    (row,) = rows_of(table)
    assert row["policy"] == "4"
    assert int(row["replans"]) == 4
    assert 0 < int(row["images"]) <= 350
    assert float(row["worth"]) >= int(row["images"])
    assert math.isclose(sum(map(float, row["worth_by_day"].split())), float(row["worth"]))


def test_no_target_is_imaged_twice_and_nothing_is_flown_that_was_not_asked_for() -> None:
    loop = Loop(Case(policy="pass", seed=0, num_satellites=2, days=1, num_first=30, num_a_day=30))
    loop.run()
    asked = {request.target.id: request for request in loop.requests}
    taken: list[Report] = [r for f in loop.fleet for r in f.reports if r.outcome == "taken"]
    assert taken
    assert max(Counter(report.target_id for report in taken).values()) == 1
    for report in taken:
        request = asked[report.target_id]
        assert request.target.due is not None
        assert request.asked_at < report.at <= request.target.due
    # One pass per replan, except those that are lost.
    assert len(loop.cpu_s) > 30
    assert set(POLICIES) == {"1", "2", "4", "pass"}


def test_the_plot_compares_policies_that_have_flown_every_week(tmp_path: Path) -> None:
    table, picture = tmp_path / "rolling.csv", tmp_path / "rolling.png"
    table.write_text(
        "policy,seed,worth,urgent_down_in_time\n1,0,100,0.3\n1,1,90,0.2\n2,0,110,0.5\n"
        "pass,0,120,0.7\npass,1,110,0.6\n"
    )
    assert compared(rows_of(table)) == ["1", "pass"]
    draw(str(table), str(picture))
    assert picture.read_bytes().startswith(b"\x89PNG")
