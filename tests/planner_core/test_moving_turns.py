"""Slews between moving lines of sight: their time, and that every method obeys it."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.certified.proofs.resource_bound import quick_bound, resource_value
from planner_core.domain import Agility, Horizon, Scenario, Target
from planner_core.errors import InvalidScenario
from planner_core.precedence.relation import is_transitive_on
from planner_core.problem import may_follow
from planner_core.problem.moving import longest_turn_s, moving_turn_s, rotation_deg, turns_in
from planner_core.problem.plan import Columns, Plan
from planner_core.problem.slew import slew_s
from planner_core.problem.sun_turns import sun_turns
from planner_core.referee.idle_time import idle_spans
from planner_core.referee.replay import replay
from planner_core.solvers.registry import SOLVERS, Certified, Milp
from tests.examples import examples
from tests.geometry import YEAR_2019, orbit, satellite
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import sunny_problem

SEEDS = st.integers(0, 10**6)
REST = (0.0, 0.0, 0.0)
MOVING = Agility(slew_rate_deg_s=2.0, acceleration_deg_s2=0.2, settle_s=1.0, slew_model="moving")


@examples(100)
@given(angle=st.floats(0.01, 180.0), rate=st.floats(0.3, 5.0), acceleration=st.floats(0.02, 2.0))
def test_from_rest_to_rest_it_is_the_plain_slew(
    angle: float, rate: float, acceleration: float
) -> None:
    took = moving_turn_s((0.0, angle, 0.0), REST, REST, rate, acceleration)
    assert took == pytest.approx(slew_s(angle, rate, acceleration), rel=1e-3, abs=1e-3)


def _drawn(rng: np.random.Generator, length: float) -> tuple[float, float, float]:
    """Return a vector of this length in any direction."""
    v = rng.normal(size=3)
    x, y, z = (v * length / np.linalg.norm(v)).tolist()
    return x, y, z


@examples(200)
@given(seed=SEEDS)
def test_a_turn_can_be_flown_and_never_beats_the_rate_alone(seed: int) -> None:
    """Simulate burst, coast and burst: they cover the rotation within both limits."""
    rng = np.random.default_rng(seed)
    rate, acceleration = float(rng.uniform(0.5, 3.0)), float(rng.uniform(0.05, 1.0))

    turn = _drawn(rng, float(rng.uniform(0.1, 120.0)))
    before, after = (
        _drawn(rng, float(rng.uniform(0.0, rate))),
        _drawn(rng, float(rng.uniform(0.0, rate))),
    )
    took = moving_turn_s(turn, before, after, rate, acceleration)
    assert took >= np.linalg.norm(turn) / rate - 1e-6
    longest = longest_turn_s(rate, acceleration)
    assert took < longest
    assert turns_in(longest, turn, before, after, rate, acceleration)
    a, b, cruise = np.array(before), np.array(after), np.array(turn) / took
    first = last = 0.0
    for _ in range(60):
        first = float(np.linalg.norm(cruise - a)) / acceleration
        last = float(np.linalg.norm(cruise - b)) / acceleration
        left = np.array(turn) - 0.5 * (first * a + last * b)
        cruise = left / (took - 0.5 * (first + last))
    assert np.linalg.norm(cruise) <= rate + 1e-6
    assert first + last <= took + 1e-6
    flown = 0.5 * (a + cruise) * first + cruise * (took - first - last) + 0.5 * (cruise + b) * last
    assert flown == pytest.approx(np.array(turn), abs=1e-4)


@examples(200)
@given(seed=SEEDS)
def test_a_turn_takes_no_longer_than_halving_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rate, acceleration = float(rng.uniform(0.3, 3.0)), float(rng.uniform(0.02, 1.0))

    turn = _drawn(rng, float(rng.uniform(0.1, 180.0)))
    ends = _drawn(rng, float(rng.uniform(0.0, rate))), _drawn(rng, float(rng.uniform(0.0, rate)))
    low_s, high_s = 0.0, longest_turn_s(rate, acceleration)
    while high_s - low_s > 1e-7:
        middle_s = 0.5 * (low_s + high_s)
        if turns_in(middle_s, turn, *ends, rate, acceleration):
            high_s = middle_s
        else:
            low_s = middle_s
    took_s = moving_turn_s(turn, *ends, rate, acceleration)
    assert turns_in(took_s, turn, *ends, rate, acceleration)
    assert took_s <= high_s + 5e-6


def test_rotations_bring_one_line_of_sight_to_the_other() -> None:
    assert rotation_deg((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) == pytest.approx((0.0, 0.0, 90.0))
    assert rotation_deg((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)) == (0.0, 0.0, 0.0)


@examples(150)
@given(seed=SEEDS)
def test_pairs_and_referee_agree(seed: int) -> None:
    problem = sunny_problem(seed, is_moving=True, use_resources=False)
    own = problem.satellites[0]
    for a in range(len(own)):
        for b in range(a + 1, len(own)):
            timeline = replay(problem, Plan.of(problem, (int(own.rows[a]), int(own.rows[b]))))
            fits = all(v.code not in ("slew", "overlap") for v in timeline.violations)
            assert fits == bool(may_follow(own.transitions, a, b))


@examples(50)
@given(seed=SEEDS)
def test_turns_to_the_sun_and_back_are_those_of_the_referee(seed: int) -> None:
    """Lines of sight move in any direction here: the slew back meets them in motion."""
    problem = sunny_problem(seed, is_moving=True, num_contacts=0)
    rng = np.random.default_rng(seed)
    shape = len(problem.opportunities), 3
    table = replace(
        problem.opportunities,
        los_rate_start=rng.uniform(-0.5, 0.5, shape).astype(np.float32),
        los_rate_end=rng.uniform(-0.5, 0.5, shape).astype(np.float32),
    )
    own = problem.satellites[0]
    turns = sun_turns(
        own.resources, own.agility, own.sun, start_s=own.start_s, end_s=own.end_s,
        looks=table.los_start[own.rows], looked=table.los_end[own.rows],
        moves=table.los_rate_start[own.rows].astype(np.float64),
        moved=table.los_rate_end[own.rows].astype(np.float64),
    )  # fmt: skip
    problem = replace(problem, opportunities=table)
    for k, row in enumerate(own.rows.tolist()):
        spans = idle_spans(problem, own, Columns.of(Plan.of(problem, (row,)).actions))
        before = spans.turn_back_s[spans.end_s <= own.start_s[k]].tolist()
        after = spans.turn_to_s[spans.start_s >= own.end_s[k]].tolist()
        assert before == pytest.approx([turns.back_s[k]] * len(before))
        assert after == pytest.approx([turns.out_s[k]] * len(after))
        assert after


@pytest.mark.parametrize("name", SOLVERS)
@examples(30)
@given(seed=SEEDS, use_resources=st.booleans())
def test_every_solver_turns_in_time(name: str, seed: int, use_resources: bool) -> None:
    problem = sunny_problem(seed, is_moving=True, use_resources=use_resources)
    if not replay(problem, Plan(())).is_valid:
        return
    timeline = replay(problem, SOLVERS[name]().solve(problem, Budget(), seed).plan)
    unknown = ("battery", "recorder") if name == "graph" else ()
    assert all(v.code in ("duplicate", *unknown) for v in timeline.violations)


@pytest.mark.parametrize("solver", [Milp(), Certified()])
@examples(60)
@given(seed=SEEDS, use_resources=st.booleans())
@example(seed=1621, use_resources=True)  # even an idle day drains the battery too far
def test_exact_solvers_find_the_best_plan(
    solver: Milp | Certified, seed: int, use_resources: bool
) -> None:
    problem = sunny_problem(seed, is_moving=True, use_resources=use_resources)
    best = best_reward(problem)
    solution = solver.solve(problem, Budget(), seed)
    if solution.proven is None:
        # HiGHS finds that there is no plan, and proves no bound.
        assert isinstance(solver, Milp)
        assert not replay(problem, Plan(())).is_valid
        return
    assert solution.proven.value >= best - 1e-6
    if replay(problem, Plan(())).is_valid and is_transitive_on(problem.satellites[0]):
        assert replay(problem, solution.plan).reward == pytest.approx(best)


@examples(150)
@given(seed=SEEDS, use_resources=st.booleans())
def test_no_plan_beats_the_bounds(seed: int, use_resources: bool) -> None:
    problem = sunny_problem(seed, is_moving=True, use_resources=use_resources)
    best = best_reward(problem)
    assert quick_bound(problem, 0.0).value >= best - 1e-6
    assert resource_value(problem, np.zeros(len(problem.target_ids)), 1.0) >= best - 1e-6


def _scenario(agility: Agility) -> Scenario:
    return Scenario(
        horizon=Horizon(start=YEAR_2019, end=YEAR_2019 + timedelta(hours=3)),
        satellites=(replace(satellite(orbit()), agility=agility),),
        targets=tuple(
            Target(id=f"t{k}", lat_deg=-80.0 + 8.0 * (k % 20), lon_deg=25.0 * (k % 13))
            for k in range(60)
        ),
        use_resources=False,
    )


def test_rates_are_those_of_the_lines_of_sight() -> None:
    scenario = _scenario(MOVING)
    table = compute_opportunities(scenario, Budget()).opportunities
    assert len(table) > 0
    rate = np.linalg.norm(table.los_rate_start, axis=1)
    assert 0.05 < rate.max() < 1.5
    # During a collect of 30 s the line of sight turns at about the mean of both rates.
    turned = np.degrees(np.arccos(np.clip(np.sum(table.los_start * table.los_end, axis=1), -1, 1)))
    mean = 0.5 * (rate + np.linalg.norm(table.los_rate_end, axis=1))
    assert turned == pytest.approx(30.0 * mean, rel=0.1, abs=0.5)
    assert np.abs(np.sum(table.los_rate_start * table.los_start, axis=1)).max() < 0.01
    plain = compute_opportunities(_scenario(Agility()), Budget()).opportunities
    assert not plain.los_rate_start.any()
    problem = build_problem(scenario, compute_opportunities(scenario, Budget()), Budget())
    assert problem.turns_in_motion
    assert len(problem.satellites[0].transitions.moves) == len(table)


def test_turns_in_motion_need_an_acceleration_and_starts_that_are_known() -> None:
    with pytest.raises(InvalidScenario, match="needs an acceleration"):
        Agility(slew_model="moving")
    with pytest.raises(InvalidScenario, match="collect_spacing_s") as refused:
        replace(_scenario(MOVING), continuous_starts=True)
    assert refused.value.fault.pointer == "/continuous_starts"


def test_whole_numbers_of_an_agility_are_real_ones() -> None:
    agility = Agility(slew_rate_deg_s=2, acceleration_deg_s2=1, settle_s=5, slew_model="moving")
    for name in ("slew_rate_deg_s", "acceleration_deg_s2", "settle_s"):
        assert isinstance(getattr(agility, name), float)
    assert Agility(slew_rate_deg_s=1).acceleration_deg_s2 is None
