"""The attitude at the start: first slews, the first visit to the sun, proofs."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sgp4.api import Satrec

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import (
    Agility,
    Attitude,
    GroundStation,
    Horizon,
    Resources,
    Scenario,
    State,
    Target,
)
from planner_core.errors import InvalidScenario
from planner_core.idling import sunlit_from
from planner_core.orbits.omm import omm_from_elements
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import Floats, Heading, Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.sun_turns import sun_turn_s
from planner_core.reasons.explain import explain
from planner_core.referee.replay import replay
from planner_core.referee.sight import turn_from_start
from planner_core.solvers.registry import SOLVERS, Rule
from tests import independent
from tests.examples import examples
from tests.geometry import hours, orbit, satellite
from tests.planner_core.brute_force import best_plan
from tests.planner_core.problems import Task, make_problem, random_problem, sunny_problem
from tests.planner_core.verdicts import encloses, require_accepted

SEEDS = st.integers(0, 10**6)


def _headed(seed: int, *, is_moving: bool = False, is_cut: bool = True) -> Problem:
    """Return a drawn problem of two satellites with a given attitude at the start."""
    rng = np.random.default_rng(seed)
    kind = int(rng.integers(3))
    if kind == 0:
        problem = random_problem(seed, num_satellites=2, use_resources=False, max_turn_deg=10.0)
    elif kind == 1:
        problem = random_problem(seed, num_satellites=2, has_rewards=True)
    else:
        problem = sunny_problem(seed, num_satellites=2, is_moving=is_moving)
    satellites = []
    for own in problem.satellites:
        angle = float(rng.uniform(0.0, 2.0 * np.pi))
        look = (float(np.cos(angle)), float(np.sin(angle)), 0.0)
        free_from_s = float(rng.choice([0.0, -20.0]))
        heading = Heading(
            free_from_s=free_from_s,
            line_of_sight=look,
            moving_deg_s=(0.0, 0.0, float(rng.uniform(-0.5, 0.5))),
        )
        if kind == 2 and rng.integers(2):
            heading = Heading(free_from_s=0.0)
        sun_s = 0.0
        if heading.line_of_sight is not None:
            sun_s = free_from_s + sun_turn_s(
                own.resources, own.agility, own.sun, look, free_from_s, heading.moving_deg_s
            )
        lit = sunlit_from(own.sunlight, max(0.0, sun_s)) if is_cut else own.sunlight
        satellites.append(replace(own, heading=heading, sunlight=lit))
    return replace(problem, satellites=tuple(satellites))


@examples(60)
@given(seed=SEEDS)
def test_no_plan_begins_too_soon_and_the_bound_is_never_below_the_best(seed: int) -> None:
    """The referee's best of all opportunities bounds planning with the remaining ones."""
    whole = _headed(seed)
    best = best_plan(whole)
    if best is None:
        return
    encloses(apply_pins(whole, Pinned()), replay(whole, best).reward, seed)


@examples(25)
@given(seed=SEEDS, is_moving=st.booleans())
def test_every_solver_turns_from_where_it_looks(seed: int, *, is_moving: bool) -> None:
    whole = _headed(seed, is_moving=is_moving)
    problem = apply_pins(whole, Pinned())
    for name, solver in SOLVERS.items():
        solution = solver().solve(problem, Budget(), seed)
        timeline = replay(problem, solution.plan)
        assert all(v.code != "slew" for v in timeline.violations), name
        if replay(problem, Plan()).is_valid:
            require_accepted(name, timeline)


@examples(100)
@given(seed=SEEDS, is_moving=st.booleans())
def test_the_referee_finds_the_first_visit_to_the_sun_itself(seed: int, *, is_moving: bool) -> None:
    """Even if the problem keeps the sunlight before that visit, which it normally leaves out."""
    cut, plain = (_headed(seed, is_moving=is_moving, is_cut=is_cut) for is_cut in (True, False))
    rng = np.random.default_rng(seed)
    rows = [row for row in range(len(cut.opportunities)) if rng.random() < 0.3]
    one, other = (replay(problem, Plan.of(problem, rows)) for problem in (cut, plain))
    for mine, own in zip(one.satellites, other.satellites, strict=True):
        if mine.resources is None or own.resources is None:
            continue
        at_s = np.linspace(0.0, cut.horizon_s, 400)
        assert np.interp(at_s, mine.resources.time_s, mine.resources.battery) == pytest.approx(
            np.interp(at_s, own.resources.time_s, own.resources.battery), abs=1e-6
        )


def _rotated(problem: Problem, axes: Floats) -> Problem:
    """Return the problem with lines of sight, their rates and the sun in rotated axes."""
    table, columns = (
        problem.opportunities,
        ("los_start", "los_end", "los_rate_start", "los_rate_end"),
    )
    satellites = []
    for own in problem.satellites:
        heading, sun = own.heading, own.sun
        assert heading is not None
        if heading.line_of_sight is not None:
            look, moving = (
                tuple((axes @ v).tolist()) for v in (heading.line_of_sight, heading.moving_deg_s)
            )
            heading = replace(heading, line_of_sight=look, moving_deg_s=moving)
        if sun is not None:
            sun = replace(sun, directions=sun.directions @ axes.T)
        satellites.append(replace(own, heading=heading, sun=sun))
    seen = {name: getattr(table, name) @ axes.T.astype(np.float32) for name in columns}
    return replace(problem, opportunities=replace(table, **seen), satellites=tuple(satellites))


@examples(50)
@given(seed=SEEDS)
def test_turns_take_as_long_in_whatever_axes_they_are_told(seed: int) -> None:
    """Small problems lie in one plane; here every axis matters."""
    axes, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    whole = _headed(seed, is_moving=True)
    other = _rotated(whole, axes * np.linalg.det(axes))
    for row, index in enumerate(whole.opportunities.satellite.tolist()):
        action = Plan.of(whole, [row]).actions[0]
        turn, turned = (turn_from_start(p, index, action) for p in (whole, other))
        assert turned == pytest.approx(turn, abs=2e-3)


@examples(50)
@given(seed=SEEDS)
def test_a_turn_takes_no_longer_where_there_is_more_time_for_it(seed: int) -> None:
    whole = _headed(seed, is_moving=True)
    satellites = []
    for own in whole.satellites:
        assert own.heading is not None
        satellites.append(replace(own, heading=replace(own.heading, free_from_s=-5000.0)))
    waiting = replace(whole, satellites=tuple(satellites))
    for row, index in enumerate(whole.opportunities.satellite.tolist()):
        action = Plan.of(whole, [row]).actions[0]
        turn, later = (turn_from_start(p, index, action) for p in (whole, waiting))
        assert later == pytest.approx(turn, abs=1e-4)


def test_the_turn_takes_what_it_takes() -> None:
    """60 deg at 1 deg/s and 5 s to settle: no task may begin before 65 s."""
    look = (float(np.cos(np.pi / 3.0)), float(np.sin(np.pi / 3.0)), 0.0)
    for start_s, is_fine in ((65.0, True), (64.99, False)):
        problem = make_problem(
            [Task(kind=0, site=0, start_s=start_s, end_s=start_s + 30.0)],
            num_targets=1,
            use_resources=False,
            agility=Agility(slew_rate_deg_s=1.0, settle_s=5.0),
        )
        heading = Heading(free_from_s=0.0, line_of_sight=look)
        whole = replace(problem, satellites=(replace(problem.satellites[0], heading=heading),))
        timeline = replay(whole, Plan.of(whole, [0]))
        assert timeline.is_valid == is_fine
        slew = timeline.satellites[0].actions[0].slew
        assert slew is not None
        assert slew.needed_s == pytest.approx(65.0)
        assert slew.angle_deg == pytest.approx(60.0)
        left = apply_pins(whole, Pinned())
        assert len(left.opportunities) == is_fine
        if not is_fine:
            (outcome,) = explain(left, Plan(), replay(left, Plan()))
            assert outcome.reason is not None
            assert (outcome.reason.code, outcome.reason.certainty) == ("slew_conflict", "proven")
            assert "initial attitude" in outcome.reason.detail
            with pytest.raises(InvalidScenario) as caught:
                apply_pins(whole, Pinned(kept=(Kept(row=0, pointer="/pins/keep/0"),)))
            assert caught.value.fault.code == "pins_conflict"
            assert "turn to it in time" in caught.value.fault.detail


_RATE_DEG_S = 0.1
"""So slow that the initial attitude still matters after half an hour."""


def _mission(horizon: Horizon, *states: State, **more: Any) -> Scenario:
    sites = np.random.default_rng(1).uniform((-70.0, -180.0), (70.0, 180.0), (300, 2)).tolist()
    own = satellite(orbit())
    agility = Agility(slew_rate_deg_s=_RATE_DEG_S)
    resources = replace(Resources.paper(5668.7), sun_pointing=more.pop("sun_pointing", "free"))
    return Scenario(
        horizon=horizon,
        satellites=(replace(own, agility=agility, resources=resources),),
        targets=tuple(
            Target(id=f"t{i}", lat_deg=lat, lon_deg=lon) for i, (lat, lon) in enumerate(sites)
        ),
        ground_stations=(
            GroundStation(id="sv", name="sv", lat_deg=78.2, lon_deg=15.4),
            GroundStation(id="tr", name="tr", lat_deg=-72.0, lon_deg=2.5),
        ),
        states=states,
        **more,
    )


def _built(scenario: Scenario) -> Problem:
    return build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())


def _independent_look(when: datetime, site: dict[str, float]) -> np.ndarray:
    document = {"omm": omm_from_elements(orbit())}
    record: Satrec = independent.record_of(document)
    look = independent.line_of_sight(record, site, when)
    return np.asarray(look / np.linalg.norm(look))


@pytest.mark.parametrize("before_s", [0.0, 400.0])
def test_what_is_tracked_is_found_as_others_find_it(before_s: float) -> None:
    """Lines of sight by python-sgp4: exactly the tasks within reach of a slow slew remain."""
    begin = hours(1).start
    horizon = Horizon(start=begin + timedelta(seconds=before_s), end=begin + timedelta(hours=1))
    own, plain = satellite(orbit()).id, _mission(horizon)
    table = compute_opportunities(plain, Budget()).opportunities
    station = {"lat_deg": 78.2, "lon_deg": 15.4}
    seen = _independent_look(begin, station)
    angle_deg = np.degrees(np.arccos(np.clip(table.los_start @ seen, -1.0, 1.0)))
    room_s = table.start_s + before_s - angle_deg / _RATE_DEG_S
    clear = np.abs(room_s) > 1.0  # an error of 0.01 deg is worth a tenth of a second
    row = int(np.flatnonzero(table.kind == 1)[0])
    site = ("sv", "tr")[int(table.site[row])]
    attitudes = [
        Attitude(station_id="sv"),
        Attitude(line_of_sight=tuple(float(x) for x in seen)),  # type: ignore[arg-type]
    ]
    if site == "sv":
        attitudes.append(Attitude(opportunity_id=f"o{row}"))
    for attitude in attitudes:
        state = State(satellite_id=own, at=begin, attitude=attitude)
        problem = _built(_mission(horizon, state))
        origin = problem.origin
        left = np.zeros(len(table), dtype=np.bool_)
        left[np.arange(len(table)) if origin is None else origin] = True
        assert left[clear].tolist() == (room_s > 0.0)[clear].tolist()
        assert 0 < left.sum() < len(table)


def test_after_a_long_wait_it_is_at_the_sun() -> None:
    """If charging needs slews: the first task needs the slew back, whatever the attitude was."""
    begin = hours(1).start
    horizon = Horizon(start=begin + timedelta(hours=2), end=begin + timedelta(hours=3))
    own = satellite(orbit()).id
    somewhere = State(
        satellite_id=own, at=begin, battery_fraction=0.5, attitude=Attitude(station_id="sv")
    )
    at_sun = State(satellite_id=own, at=horizon.start, attitude=Attitude(at_sun=True))
    one, other = (
        _built(_mission(horizon, state, sun_pointing="slew")) for state in (somewhere, at_sun)
    )
    assert one.origin is not None
    assert other.origin is not None
    assert one.origin.tolist() == other.origin.tolist()
    whole = _built(_mission(horizon, sun_pointing="slew")).satellites[0]
    needs_s = whole.turns.back_s[np.argsort(whole.rows)]
    assert one.origin.tolist() == np.flatnonzero(whole.start_s >= needs_s).tolist()
    free = _built(_mission(horizon, replace(at_sun), sun_pointing="free"))
    assert len(free.opportunities) == len(whole)


def test_accesses_open_once_they_can_be_turned_to() -> None:
    """With continuous starts: no earlier start is allowed, and the earliest one is offered."""
    begin = hours(1).start
    horizon = Horizon(start=begin, end=begin + timedelta(hours=1))
    own = satellite(orbit()).id
    state = State(satellite_id=own, at=begin, attitude=Attitude(line_of_sight=(1.0, 0.0, 0.0)))
    fast = replace(
        _mission(horizon, state, use_resources=False, continuous_starts=True),
        satellites=(replace(satellite(orbit()), agility=Agility(slew_rate_deg_s=0.3)),),
    )
    problem, plain = _built(fast), _built(replace(fast, states=()))
    opened = problem.opportunities.access_start_s > 1e-3 + plain.opportunities.access_start_s[
        [int(np.flatnonzero(plain.opportunities.access == a)[0])
         for a in problem.opportunities.access]
    ]  # fmt: skip
    assert opened.any()
    for row in np.flatnonzero(opened).tolist():
        first_s = float(problem.opportunities.access_start_s[row])
        action = Plan.of(problem, [row]).actions[0]
        length_s = action.end_s - action.start_s
        for early_s, is_fine in ((0.0, True), (0.002, False)):
            start_s = round(first_s - early_s, 3)
            moved = action._replace(start_s=start_s, end_s=round(start_s + length_s, 3))
            timeline = replay(problem, Plan((moved,)))
            assert timeline.is_valid == is_fine
            assert ("slew" in {v.code for v in timeline.violations}) != is_fine
    solution = Rule().solve(problem, Budget(), 0)
    assert replay(problem, solution.plan).is_valid


@pytest.mark.parametrize(
    ("attitude", "code", "field"),
    [
        (Attitude(), "value_out_of_range", ""),
        (Attitude(at_sun=True, target_id="t0"), "value_out_of_range", ""),
        (Attitude(target_id="none"), "unknown_target", "/target_id"),
        (Attitude(station_id="none"), "unknown_ground_station", "/station_id"),
        (Attitude(line_of_sight=(0.0, 0.0, 2.0)), "value_out_of_range", "/line_of_sight"),
        (Attitude(line_of_sight=(0.0, 0.0, float("nan"))), "value_out_of_range", "/line_of_sight"),
        (Attitude(opportunity_id="o999999"), "unknown_opportunity", "/opportunity_id"),
        (Attitude(opportunity_id="first"), "unknown_opportunity", "/opportunity_id"),
    ],
)
def test_impossible_attitudes_are_refused(attitude: Attitude, code: str, field: str) -> None:
    state = State(satellite_id=satellite(orbit()).id, at=hours(1).start, attitude=attitude)
    with pytest.raises(InvalidScenario) as caught:
        _built(_mission(hours(1), state))
    fault = caught.value.fault
    assert (fault.code, fault.pointer) == (code, f"/states/0/attitude{field}")
