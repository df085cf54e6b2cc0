"""States before the horizon: carried to its start as by the referee, and planned from there."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Horizon, Resources, Scenario, State, SunPointing, Target
from planner_core.errors import InvalidScenario
from planner_core.idling import battery_after
from planner_core.problem import Problem, Sunlight
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.resource_profile import integrate
from planner_core.solvers.registry import Certified, Rule
from tests.examples import examples
from tests.geometry import hours, orbit, satellite

IDLE = replace(
    Resources.paper(5668.7), idle_drain_per_s=5e-5, telemetry_per_s=2e-6, eclipse_aware=True,
    sunpoint_charge_per_s=1.2e-4, initial_battery_fraction=0.9, initial_recorder_fraction=0.1,
)  # fmt: skip


def _mission(resources: Resources, horizon: Horizon, *states: State) -> Scenario:
    sites = np.random.default_rng(0).uniform((-60.0, -180.0), (60.0, 180.0), (40, 2)).tolist()
    return Scenario(
        horizon=horizon,
        satellites=(replace(satellite(orbit()), resources=resources),),
        targets=tuple(
            Target(id=f"t{i}", lat_deg=lat, lon_deg=lon) for i, (lat, lon) in enumerate(sites)
        ),
        states=states,
    )


def _built(scenario: Scenario) -> Problem:
    return build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())


def _later(before_s: float, duration_h: float = 3.0) -> Horizon:
    start = hours(1).start + timedelta(seconds=before_s)
    return Horizon(start=start, end=start + timedelta(hours=duration_h))


@pytest.mark.parametrize("is_eclipse_aware", [False, True])
@pytest.mark.parametrize("sun_pointing", ["free", "slew"])
@pytest.mark.parametrize("before_s", [0.0, 600.0, 20_000.0])
def test_a_state_is_carried_as_the_referee_lets_a_satellite_idle(
    before_s: float, sun_pointing: SunPointing, *, is_eclipse_aware: bool
) -> None:
    """An idle satellite is followed from the state on, past the start of the later horizon."""
    known = replace(
        IDLE, initial_battery_fraction=0.4, initial_recorder_fraction=0.5,
        sun_pointing=sun_pointing, eclipse_aware=is_eclipse_aware,
    )  # fmt: skip
    begin = hours(1).start
    whole = _built(_mission(known, Horizon(start=begin, end=_later(before_s).end)))
    curve = integrate(whole, whole.satellites[0], Plan()).curve
    own = whole.satellites[0].id
    state = State(satellite_id=own, at=begin, battery_fraction=0.4, recorder_fraction=0.5)
    given = replace(known, initial_battery_fraction=1.0, initial_recorder_fraction=0.0)
    r = _built(_mission(given, _later(before_s), state)).satellites[0].resources
    assert r.initial_battery_fraction == pytest.approx(
        np.interp(before_s, curve.time_s, curve.battery), abs=2e-6
    )
    assert r.initial_recorder_fraction == pytest.approx(
        np.interp(before_s, curve.time_s, curve.recorder), abs=1e-9
    )


def test_what_a_state_does_not_say_the_resources_say() -> None:
    own = satellite(orbit()).id
    begin = hours(1).start
    alone = State(satellite_id=own, at=begin, recorder_fraction=0.3)
    r = _built(_mission(IDLE, _later(7200.0), alone)).satellites[0].resources
    assert r.initial_battery_fraction == IDLE.initial_battery_fraction
    assert r.initial_recorder_fraction == pytest.approx(0.3 + 7200.0 * IDLE.telemetry_per_s)
    free = replace(_mission(IDLE, _later(7200.0), alone), use_resources=False)
    assert _built(free).satellites[0].resources == IDLE


@examples(200)
@given(
    battery=st.floats(0.0, 1.0),
    charge_per_s=st.floats(0.0, 4e-4),
    idle_per_s=st.floats(0.0, 4e-4),
    edges_s=st.lists(st.integers(0, 9000), max_size=8, unique=True),
)
def test_a_battery_stops_where_it_is_full_or_empty(
    battery: float, charge_per_s: float, idle_per_s: float, edges_s: list[int]
) -> None:
    """Compared with steps of one second, on which all sunlight edges lie."""
    edges = np.sort(np.array(edges_s[: len(edges_s) // 2 * 2], dtype=np.float64))
    lit = Sunlight(enter_s=edges[::2], exit_s=edges[1::2])
    resources = replace(IDLE, sunpoint_charge_per_s=charge_per_s, idle_drain_per_s=idle_per_s)
    stepped = battery
    second = np.arange(9000)[:, None]
    in_each = (lit.enter_s <= second) & (second < lit.exit_s)
    for is_lit in in_each.sum(axis=1).tolist():
        stepped = min(1.0, max(0.0, stepped + charge_per_s * is_lit - idle_per_s))
    assert battery_after(resources, battery, lit, 9000.0) == pytest.approx(stepped, abs=1e-9)


@pytest.mark.parametrize("battery", [0.1, 0.32, 0.6])
def test_plans_begin_with_what_is_there(battery: float) -> None:
    """For the paper's satellite, which may do less the emptier its battery is; proofs too."""
    paper = Resources.paper(5668.7)
    begin = hours(1).start
    rewards = []
    for level in (battery, 1.0):
        state = State(satellite_id=satellite(orbit()).id, at=begin, battery_fraction=level)
        problem = _built(_mission(paper, _later(0.0), state))
        for solver in (Rule(), Certified()):
            solution = solver.solve(problem, Budget(20.0), 0)
            timeline = replay(problem, solution.plan)
            assert timeline.is_valid or all(v.inherited for v in timeline.violations)
        assert solution.bound is not None
        assert solution.bound >= timeline.reward
        rewards.append(timeline.reward)
    assert rewards[0] <= rewards[1]
    low = State(satellite_id=satellite(orbit()).id, at=begin, battery_fraction=battery)
    idle = replay(_built(_mission(paper, _later(0.0), low)), Plan())
    assert [v.inherited for v in idle.violations] == [True] * (battery < paper.battery_min_fraction)


@pytest.mark.parametrize(
    ("changes", "code", "field"),
    [
        ({"satellite_id": "none"}, "unknown_satellite", "satellite_id"),
        ({"at": _later(1.0).start}, "value_out_of_range", "at"),
        ({"at": hours(1).start - timedelta(days=8)}, "value_out_of_range", "at"),
        ({"battery_fraction": 1.2}, "value_out_of_range", "battery_fraction"),
        ({"recorder_fraction": float("nan")}, "value_out_of_range", "recorder_fraction"),
    ],
)
def test_impossible_states_are_refused(changes: dict[str, object], code: str, field: str) -> None:
    fine = State(satellite_id=satellite(orbit()).id, at=hours(1).start, battery_fraction=0.5)
    with pytest.raises(InvalidScenario) as caught:
        _mission(IDLE, hours(3), replace(fine, **changes))  # type: ignore[arg-type]
    assert (caught.value.fault.code, caught.value.fault.pointer) == (code, f"/states/0/{field}")


def test_two_states_of_a_satellite_are_refused() -> None:
    one = State(satellite_id=satellite(orbit()).id, at=hours(1).start, battery_fraction=0.5)
    with pytest.raises(InvalidScenario) as caught:
        _mission(IDLE, hours(3), one, replace(one, at=one.at - timedelta(hours=1)))
    assert caught.value.fault.code == "duplicate_state"
    assert caught.value.fault.pointer == "/states/1/satellite_id"
