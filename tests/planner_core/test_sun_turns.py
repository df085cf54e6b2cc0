"""Turns to the sun: how much they charge, that all methods agree, and that bounds hold."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.dp.energy_labels import energy_levels, most_by_energy
from planner_core.certified.dp.resource_network import network_of
from planner_core.certified.mip.whole_relaxation import whole_relaxation
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound, resource_value
from planner_core.domain import Agility, Horizon, Resources, Scenario
from planner_core.errors import InvalidScenario
from planner_core.mdp.resource_columns import STRICT, take
from planner_core.mdp.track import NO_TASK, compile_track
from planner_core.orbits.sun import sun_direction_teme, sun_path
from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.slew import slew_s
from planner_core.problem.sun_turns import SunPath, sun_turn_s
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.solvers.priced import better_of, energy_of, is_priced, with_choices
from planner_core.solvers.registry import SOLVERS, Certified, Milp
from planner_core.solvers.sequential import Subproblem
from tests.examples import examples
from tests.geometry import orbit, satellite
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem, sunny_problem
from tests.planner_core.verdicts import require_accepted

SEEDS = st.integers(0, 10**6)
SOUTH = SunPath(step_s=1000.0, directions=np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]]))
MARCH = Horizon(start=datetime(2026, 3, 20, tzinfo=UTC), end=datetime(2026, 4, 19, tzinfo=UTC))
SLEWING = replace(TIGHT, sun_pointing="slew")


def _drawn_plan(problem: Problem, seed: int) -> Plan:
    """Return a plan in which all slews fit, ignoring batteries."""
    rng = np.random.default_rng(seed)
    chosen: list[int] = []
    for own in problem.satellites:
        last = -1
        for row in range(len(own)):
            if own.transitions.allows(last, row) and rng.random() < 0.5:
                chosen.append(int(own.rows[row]))
                last = row
    return Plan.of(problem, sorted(chosen))


def _second_by_second(problem: Problem, timeline: Timeline, step_s: float) -> np.ndarray:
    """Return the battery at every step, from the modes that the timeline states."""
    satellite = problem.satellites[0]
    r, light = satellite.resources, satellite.sunlight
    num_steps = round(problem.horizon_s / step_s)
    power = np.full(num_steps, -r.idle_drain_per_s)
    middle_s = (np.arange(num_steps) + 0.5) * step_s
    is_lit = np.zeros(num_steps, dtype=np.bool_)
    for enter_s, exit_s in zip(light.enter_s, light.exit_s, strict=True):
        is_lit |= (middle_s >= enter_s) & (middle_s < exit_s)
    drawn = {"collect": r.collect_drain_per_s, "contact": r.contact_drain_per_s, "hold": 0.0}
    for action in timeline.satellites[0].actions:
        does = (middle_s >= action.start_s) & (middle_s < action.end_s)
        if action.mode == "sunpoint":
            power[does & is_lit] += r.sunpoint_charge_per_s
        else:
            power[does] -= drawn[action.mode]
    battery = np.empty(num_steps + 1)
    battery[0] = r.initial_battery_fraction
    for k in range(num_steps):
        battery[k + 1] = min(1.0, max(0.0, battery[k] + power[k] * step_s))
    return battery


@examples(60)
@given(seed=SEEDS)
def test_the_referee_agrees_with_an_integration_step_by_step(seed: int) -> None:
    problem = sunny_problem(seed)
    timeline = replay(problem, _drawn_plan(problem, seed))
    step_s = 0.05
    battery = _second_by_second(problem, timeline, step_s)
    line = timeline.satellites[0].resources
    assert line is not None
    known = np.interp(np.arange(len(battery)) * step_s, line.time_s, line.battery)
    # A mode changes within a step at most once at each of some 40 edges.
    assert np.abs(known - battery).max() < 40 * step_s * (1 / 200 + 1 / 300)
    by_mode = [a for a in timeline.satellites[0].actions if a.mode == "sunpoint"]
    for action in by_mode:
        assert action.turn_to_s is not None
        assert action.turn_back_s is not None


@examples(150)
@given(seed=SEEDS)
def test_steps_and_referee_agree_on_levels_and_limits(seed: int) -> None:
    problem = sunny_problem(seed)
    satellite = problem.satellites[0]
    plan = _drawn_plan(problem, seed)
    track = compile_track(problem, satellite, np.zeros(len(satellite), dtype=np.uint8))
    resources = track.resources
    timeline = replay(problem, plan)
    judged = [a for a in timeline.satellites[0].actions if a.opportunity is not None]
    last, battery, recorder = NO_TASK, resources.battery_start, resources.recorder_start
    stays_within = battery > resources.battery_min + resources.reserve_start + STRICT
    for action in judged:
        assert action.opportunity is not None
        row = int(problem.local_row[action.opportunity])
        battery, recorder, is_within = take(track.resources, last, row, battery, recorder)
        stays_within = stays_within and is_within
        last = row
        if battery > 0.0 and all(v.code != "battery" for v in timeline.violations):
            assert battery == pytest.approx(action.battery_end, abs=1e-8)
    telemetry = resources.telemetry_per_s * (
        resources.data_end_s - (resources.data_from_s[last] if last >= 0 else 0.0)
    )
    if stays_within and recorder + telemetry < resources.recorder_max - STRICT:
        assert timeline.is_valid
    if any(v.code == "battery" for v in timeline.violations):
        assert not stays_within


def test_a_gap_too_short_for_both_turns_charges_nothing() -> None:
    """Lines of sight in the plane, the sun below it: 90 s there and 90 s back at 1 deg/s."""

    def timeline(gap_s: float) -> Timeline:
        tasks = [
            Task(kind=COLLECT, site=0, start_s=100.0, end_s=130.0),
            Task(kind=COLLECT, site=1, start_s=130.0 + gap_s, end_s=160.0 + gap_s),
        ]
        problem = make_problem(tasks, num_targets=2, resources=SLEWING, sun=SOUTH)
        return replay(problem, Plan.of(problem, (0, 1)))

    short = timeline(179.0).satellites[0].actions
    assert [a.mode for a in short] == ["sunpoint", "collect", "hold", "collect", "sunpoint"]
    assert short[2].battery_end == pytest.approx(short[1].battery_end)
    assert (short[0].start_s, short[0].end_s) == pytest.approx((0.0, 10.0))
    assert (short[0].turn_to_s, short[0].turn_back_s) == pytest.approx((0.0, 90.0))
    assert (short[4].turn_to_s, short[4].turn_back_s) == pytest.approx((90.0, 0.0))
    long = timeline(190.0).satellites[0].actions
    assert [a.mode for a in long] == ["sunpoint", "collect", "sunpoint", "collect", "sunpoint"]
    assert (long[2].start_s, long[2].end_s) == pytest.approx((220.0, 230.0))
    assert long[2].battery_end is not None
    assert long[1].battery_end is not None
    charged = long[2].battery_end - long[1].battery_end
    assert charged == pytest.approx(10.0 * TIGHT.sunpoint_charge_per_s)


def test_panels_beside_the_boresight_need_a_smaller_turn() -> None:
    agility = Agility(slew_rate_deg_s=2.0, settle_s=3.0)
    resources = replace(SLEWING, panel_angle_deg=90.0)
    assert sun_turn_s(resources, agility, SOUTH, (1.0, 0.0, 0.0), 5.0) == pytest.approx(3.0)
    assert sun_turn_s(resources, agility, SOUTH, (0.0, 0.0, 1.0), 5.0) == pytest.approx(48.0)
    resources = replace(SLEWING, panel_angle_deg=180.0)
    assert sun_turn_s(resources, agility, SOUTH, (0.0, 0.0, 1.0), 5.0) == pytest.approx(3.0)
    with pytest.raises(ValueError, match="where it is"):
        sun_turn_s(resources, agility, None, (0.0, 0.0, 1.0), 5.0)


def test_a_load_at_all_times_empties_the_battery_in_shadow() -> None:
    drawn = replace(TIGHT, idle_drain_per_s=1e-3, initial_battery_fraction=0.55)
    light = make_problem([], num_targets=1, resources=drawn)
    assert replay(light, Plan(())).battery_min == pytest.approx(0.0)
    # The net rate is 1/2500 - 1e-3 per second, so the 0.25 above the limit last 0.25 / 0.0006 s.
    broken = replay(light, Plan(())).violations
    assert [v.code for v in broken] == ["battery"]
    assert broken[0].at_s == pytest.approx(0.25 / (1e-3 - 1 / 2500))


# The slew to an image left out would begin after the slew to the next one.
@example(seed=248, num_satellites=1)
@examples(300)
@given(seed=SEEDS, num_satellites=st.integers(1, 3))
def test_no_plan_beats_the_bounds(seed: int, num_satellites: int) -> None:
    problem = sunny_problem(seed, num_satellites=num_satellites, is_plain=bool(seed % 2))
    best = best_reward(problem)
    rng = np.random.default_rng(seed)
    prices = rng.uniform(0.0, 1.0, len(problem.target_ids)) * problem.best_worth
    assert quick_bound(problem, 0.0).value >= best - 1e-6
    assert lagrangian_bound(problem, 0.0).value >= best - 1e-6
    assert resource_value(problem, prices, 0.05) >= best - 1e-6
    assert resource_value(problem, np.zeros(len(prices)), 1.0) >= best - 1e-6
    if replay(problem, Plan(())).is_valid:
        # If the idle load alone empties the battery HiGHS has no plan to bound.
        assert whole_relaxation(problem, Budget(), 0).bound.value >= best - 1e-6


@examples(300)
@given(seed=SEEDS, per_collect=st.sampled_from([1, 3, 24]))
def test_levels_of_energy_are_never_too_low(seed: int, per_collect: int) -> None:
    problem = sunny_problem(seed)
    network = network_of(problem, problem.satellites[0])
    levels = energy_levels(network, per_collect)
    m = len(network.site)
    own, num_own = np.empty((m, levels.width)), np.zeros(m, dtype=np.int64)
    rng = np.random.default_rng(seed)
    prices = rng.uniform(0.0, 0.6, len(problem.target_ids)) * problem.best_worth
    is_contact = network.is_contact == 1
    price = np.where(is_contact, 0.0, prices[np.where(is_contact, 0, network.site)])
    weight = problem.worth - price
    most, path = most_by_energy(network, levels, weight, own, num_own)
    assert weight[path].sum() == pytest.approx(most)
    assert prices.sum() + most >= best_reward(problem) - 1e-6


@pytest.mark.parametrize("name", SOLVERS)
@examples(40)
@given(seed=SEEDS, num_satellites=st.integers(1, 2))
def test_every_solver_plans_what_the_referee_accepts(
    name: str, seed: int, num_satellites: int
) -> None:
    problem = sunny_problem(seed, num_satellites=num_satellites)
    if not replay(problem, Plan(())).is_valid:
        return
    timeline = replay(problem, SOLVERS[name]().solve(problem, Budget(), seed).plan)
    require_accepted(name, timeline)


@pytest.mark.parametrize("solver", [Milp(), Milp(formulation="pairwise"), Certified()])
@examples(60)
@given(seed=SEEDS, num_satellites=st.integers(1, 3))
def test_exact_solvers_find_the_best_plan(
    solver: Milp | Certified, seed: int, num_satellites: int
) -> None:
    problem = sunny_problem(seed, num_satellites=num_satellites)
    best = best_reward(problem)
    solution = solver.solve(problem, Budget(), seed)
    is_possible = replay(problem, Plan(())).is_valid
    # If the idle load alone empties the battery no plan is valid, and HiGHS has none to bound.
    assert solution.proven is not None or not is_possible
    assert solution.proven is None or solution.proven.value >= best - 1e-6
    if is_possible:
        assert replay(problem, solution.plan).reward == pytest.approx(best)


def test_paper_dynamics_know_neither_turns_to_the_sun_nor_a_base_load() -> None:
    plain = Resources.paper(5700.0)
    for resources in (
        replace(plain, sun_pointing="slew"),
        replace(plain, idle_drain_per_s=1e-6),
    ):
        flown = replace(satellite(orbit()), resources=resources)
        asked = Scenario(horizon=MARCH, satellites=(flown,), targets=())
        with pytest.raises(InvalidScenario, match="neither turns to the sun"):
            replace(asked, dynamics="paper")
        replace(asked, dynamics="paper", use_resources=False)


def test_the_sun_moves_along_its_path() -> None:
    path = sun_path(MARCH)
    t_s = 12.3 * 86400.0
    exact = sun_direction_teme(2461119.5, np.array([12.3]))[0]
    resources = replace(SLEWING, panel_angle_deg=0.0)
    away = sun_turn_s(resources, Agility(), path, tuple(exact.tolist()), t_s)
    assert away < 1e-4
    start = sun_direction_teme(2461119.5, np.array([0.0]))[0]
    turn_deg = sun_turn_s(resources, Agility(), path, tuple(start.tolist()), t_s)
    assert 11.5 < turn_deg < 12.8


def test_turns_take_acceleration_and_settling() -> None:
    agility = Agility(slew_rate_deg_s=2.0, acceleration_deg_s2=0.1, settle_s=4.0)
    turn_s = sun_turn_s(SLEWING, agility, SOUTH, (1.0, 0.0, 0.0), 0.0)
    assert turn_s == pytest.approx(slew_s(90.0, 2.0, 0.1) + 4.0)


@examples(100)
@given(seed=SEEDS)
def test_energy_paid_for_is_what_the_satellite_lacks_back_at_the_sun(seed: int) -> None:
    """Two tasks with a stay at the sun against the first task with that stay, far from full."""
    problem = sunny_problem(seed)
    own = problem.satellites[0]
    track = compile_track(problem, own, np.zeros(len(own), dtype=np.uint8))
    resources = track.resources
    first, second = resources.charge_from_s, resources.charge_to_s
    for i in range(len(own)):
        for j in range(i + 1, len(own)):
            if not own.transitions.allows(i, j):
                continue
            charged_s = max(0.0, second[j] - first[i])
            with_it = charged_s * resources.charge_per_s - resources.battery_cost[j]
            without = (first[j] - first[i]) * resources.charge_per_s
            assert energy_of(track, i, j) == pytest.approx(without - with_it, abs=1e-12)


def _batches() -> Problem:
    """Return four passes over three images each; the battery suffices for every other pass."""
    tasks = [
        Task(kind=COLLECT, site=3 * p + k, start_s=1000.0 * p + 300 + 60 * k,
             end_s=1000.0 * p + 330 + 60 * k)
        for p in range(4) for k in range(3)
    ]  # fmt: skip
    resources = replace(
        SLEWING, initial_battery_fraction=0.65, collect_drain_per_s=1 / 300,
        sunpoint_charge_per_s=1 / 4000, recorder_max_fraction=1.0, collect_fill_per_s=1e-4,
    )  # fmt: skip
    return make_problem(
        tasks, num_targets=12, horizon_s=4000.0, resources=resources,
        sun=replace(SOUTH, step_s=4000.0),
    )  # fmt: skip


def test_a_price_of_energy_batches_images_between_visits_to_the_sun() -> None:
    problem = _batches()
    best = replay(problem, Certified().solve(problem, Budget(), 0).plan).reward
    for name in ("rule", "forward_search", "mcts"):
        timeline = replay(problem, SOLVERS[name]().solve(problem, Budget(), 0).plan)
        assert timeline.is_valid
        assert timeline.reward >= best - 1.0
    assert replay(problem, SOLVERS["mcts"]().solve(problem, Budget(), 0).plan).reward == best


def test_missions_that_charge_in_all_idle_time_are_planned_as_ever() -> None:
    problem = random_problem(7)
    turn = Subproblem(
        satellite=problem.satellites[0],
        track=compile_track(problem, problem.satellites[0], np.zeros(10, dtype=np.uint8)),
        collected=np.zeros(5, dtype=np.uint8),
        report=lambda _fraction, _reward: None,
    )
    assert not is_priced(problem, turn)
    assert better_of(problem, turn, [2, 3], looks_ahead=True) == [2, 3]
    solution = SOLVERS["rule"]().solve(problem, Budget(), 0)
    assert with_choices(problem, solution, Budget(), 0) is solution
