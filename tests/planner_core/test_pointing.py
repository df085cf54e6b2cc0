"""Lines of sight at any instant, and the earliest and latest starts that follow from them."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.domain import Agility, Scenario, mean_elements
from planner_core.orbits.ephemeris import propagate
from planner_core.orbits.sites import Sites, line_of_sight_teme
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Opportunities,
    Problem,
    line_of_sight,
)
from planner_core.problem.plan import Action, Plan
from planner_core.problem.pointing import (
    agile_of,
    earliest_start_s,
    latest_start_s,
    needed_s,
    sight,
    sights,
)
from planner_core.problem.retimed import offered, retimed, with_starts
from planner_core.referee.replay import replay
from tests.examples import examples
from tests.geometry import SkyfieldPath, angle_deg, satellite
from tests.geometry import orbit as paper_orbit
from tests.planner_core.flat_earth import flat_problem
from tests.planner_core.test_build import STATIONS, targets, two_satellites
from tests.planner_core.test_build import scenario as built_scenario

SEEDS = st.integers(0, 10**6)


def scenario(**flags: Any) -> Scenario:
    return replace(
        built_scenario(satellites=two_satellites(), span_h=6.0), continuous_starts=True, **flags
    )


@pytest.fixture(scope="module")
def problem() -> Problem:
    return built(scenario())


def built(asked: Scenario) -> Problem:
    return build_problem(asked, compute_opportunities(asked, Budget()), Budget())


def test_lines_of_sight_are_those_of_the_orbit_code(problem: Problem) -> None:
    """To far below the 1e-4 deg that could affect a plan, both at nodes and between them."""
    pointing = problem.pointing
    assert pointing is not None
    rng = np.random.default_rng(0)
    for one, path in zip(scenario().satellites, pointing.paths, strict=True):
        orbit = propagate(one, scenario().horizon)
        for points, sites in (
            (targets(60), pointing.targets_m), (STATIONS, pointing.stations_m),
        ):  # fmt: skip
            site = rng.integers(len(points), size=300).astype(np.int32)
            t_s = rng.uniform(0.0, problem.horizon_s, 300)
            known = line_of_sight_teme(orbit, Sites.of(points).at(site), t_s)
            assert np.degrees(np.abs(sights(path, sites, site, t_s) - known)).max() < 1e-9


def test_they_are_those_of_the_table_at_its_own_instants(problem: Problem) -> None:
    table = problem.opportunities
    for row in range(0, len(table), 17):
        for t_s, known in (
            (table.start_s[row], table.los_start[row]), (table.end_s[row], table.los_end[row]),
        ):  # fmt: skip
            assert np.allclose(line_of_sight(problem, row, float(t_s)), known, atol=1e-11)


def test_they_agree_with_skyfield() -> None:
    asked = replace(scenario(), satellites=(satellite(paper_orbit()),))
    pointing = built(asked).pointing
    assert pointing is not None
    t_s = np.linspace(1.0, 21_000.0, 50)
    site = np.arange(50, dtype=np.int32)
    path = SkyfieldPath(mean_elements(asked.satellites[0].orbit), asked.horizon)
    orbit = propagate(asked.satellites[0], asked.horizon)
    away = pointing.targets_m[site] - path.position_m(t_s)
    known = orbit.to_teme(away / np.linalg.norm(away, axis=1)[:, None], t_s)
    found = sights(pointing.paths[0], pointing.targets_m, site, t_s)
    assert angle_deg(found, known).max() < 3e-3


def test_only_a_problem_with_the_flag_carries_them() -> None:
    plain = replace(scenario(), continuous_starts=False)
    assert built(plain).pointing is None
    events = replace(scenario(), dynamics="paper")
    found = compute_opportunities(events, Budget())
    assert any("continuous_starts" in warning for warning in found.warnings)
    problem = build_problem(events, found, Budget())
    assert problem.pointing is None
    assert not problem.continuous_starts


@examples(60)
@given(
    seed=SEEDS, rate=st.sampled_from([1.0, 2.5]), settle_s=st.sampled_from([0.0, 4.0]),
    acceleration=st.sampled_from([None, 0.5]),
)  # fmt: skip
def test_earliest_and_latest_starts_suffice_and_a_moment_less_does_not(
    seed: int, rate: float, settle_s: float, acceleration: float | None
) -> None:
    rng = np.random.default_rng(seed)
    problem = flat_problem(seed, num_targets=6)
    pointing = problem.pointing
    assert pointing is not None
    path, sites = pointing.paths[0], pointing.targets_m
    agile = agile_of(rate, acceleration, settle_s)
    a, b = rng.choice(6, 2, replace=False)
    end_s = round(float(rng.uniform(0.0, 300.0)), 3)
    looked = sight(path, sites, int(a), end_s)
    start = earliest_start_s(agile, end_s, looked, path, sites, int(b), 0.0, 590.0)
    need = needed_s(agile, looked, sight(path, sites, int(b), start))
    assert start - end_s >= need - 1e-6
    assert round(start, 3) == pytest.approx(start, abs=1e-9)
    if acceleration is None:
        sooner = start - 0.005
        assert sooner - end_s < needed_s(agile, looked, sight(path, sites, int(b), sooner))
    looks = sight(path, sites, int(b), 400.0)
    late = latest_start_s(agile, 400.0, looks, path, sites, int(a), 30.0, 0.0, 590.0)
    need = needed_s(agile, sight(path, sites, int(a), late + 30.0), looks)
    assert 400.0 - late - 30.0 >= need - 1e-6
    if acceleration is None:
        later = late + 0.005
        assert 370.0 - later < needed_s(agile, sight(path, sites, int(a), later + 30.0), looks)


def test_the_referee_looks_where_a_moved_collect_looks(problem: Problem) -> None:
    """With the table's line of sight it could accept a late slew or blame a good one."""
    table, pointing = problem.opportunities, problem.pointing
    assert pointing is not None
    checked = 0
    collects = np.flatnonzero((table.kind == COLLECT) & (table.satellite == 0))
    for a, b in zip(collects[:-1].tolist(), collects[1:].tolist(), strict=True):
        start_s = float(np.ceil(table.access_start_s[b] * 1e3) / 1e3)
        first = Action(float(table.start_s[a]), float(table.end_s[a]), a)
        moved = Action(start_s, start_s + 30.0, b)
        if moved.start_s < first.end_s or table.site[a] == table.site[b]:
            continue
        action = replay(problem, Plan((first, moved))).satellites[0].actions
        (slew,) = [one.slew for one in action if one.slew is not None]
        looks = sights(pointing.paths[0], pointing.targets_m, table.site[[b]], np.array([start_s]))
        assert slew.angle_deg == pytest.approx(angle_deg(table.los_end[[a]], looks)[0], abs=1e-6)
        checked += abs(angle_deg(table.los_end[[a]], table.los_start[[b]])[0] - slew.angle_deg) > 1
    assert checked > 3


def _accesses(table: Opportunities) -> list[tuple[float, ...]]:
    # A pass may have several contacts, which do not move.
    fixed_s = np.where(table.kind == CONTACT, table.start_s, 0.0)
    columns = (table.satellite, table.kind, table.site, table.access_start_s, fixed_s)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def test_a_problem_with_other_starts_is_the_one_that_has_them_by_itself() -> None:
    """Fixed opportunities moved to a spacing's starts equal those that the spacing offers."""
    fixed = built(scenario())
    spaced = built(scenario(collect_spacing_s=20.0))
    table, wanted = fixed.opportunities, spaced.opportunities
    # Accesses are numbered in the order of the table.
    by_access = {one: row for row, one in enumerate(_accesses(table))}
    rows = np.array([by_access[one] for one in _accesses(wanted)], dtype=np.int32)
    made = retimed(fixed, rows, wanted.start_s)
    numbers = set(zip(made.problem.opportunities.access, wanted.access, strict=True))
    assert len(numbers) == len(set(table.access.tolist()))
    for field in fields(Opportunities):
        if field.name.startswith("los"):
            close = np.abs(
                getattr(made.problem.opportunities, field.name) - getattr(wanted, field.name)
            )
            assert close.max() < 1e-12
        elif field.name in ("start_s", "end_s", "access_start_s", "satellite", "site", "kind"):
            assert np.array_equal(
                getattr(made.problem.opportunities, field.name), getattr(wanted, field.name)
            )


@examples(25)
@given(seed=SEEDS)
def test_a_plan_in_the_rows_of_its_own_starts_is_judged_the_same(seed: int) -> None:
    problem = flat_problem(seed, num_satellites=2, num_targets=8, num_contacts=1, horizon_s=900.0,
                           use_resources=True)  # fmt: skip
    rng = np.random.default_rng(seed)
    table = problem.opportunities
    actions = []
    for row in rng.choice(len(table), min(6, len(table)), replace=False).tolist():
        length_s = float(table.end_s[row] - table.start_s[row])
        room_s = float(table.access_end_s[row] - table.access_start_s[row]) - length_s
        start_s = round(float(table.access_start_s[row]) + rng.uniform() * room_s, 3)
        if table.kind[row] != COLLECT:
            start_s = float(table.start_s[row])
        actions.append(Action(start_s, start_s + length_s, row))
    plan = Plan(tuple(sorted(actions)))
    made = with_starts(
        problem,
        np.array([a.opportunity for a in plan.actions], dtype=np.int32),
        np.array([a.start_s for a in plan.actions]),
    )
    flown = offered(made, problem, plan)
    assert [int(made.source[a.opportunity]) for a in flown.actions] == [
        a.opportunity for a in plan.actions
    ]
    own, other = replay(problem, plan), replay(made.problem, flown)
    assert other.reward == own.reward
    assert [(v.code, v.at_s, v.blamed) for v in other.violations] == [
        (v.code, v.at_s, v.blamed) for v in own.violations
    ]
    at_own = [
        made.problem.opportunities.start_s[a.opportunity] == pytest.approx(a.start_s, abs=1e-9)
        for a in flown.actions
    ]
    assert all(at_own)


def test_agility_without_acceleration_is_instant() -> None:
    agility = Agility(slew_rate_deg_s=2.0)
    agile = agile_of(agility.slew_rate_deg_s, agility.acceleration_deg_s2, agility.settle_s)
    assert needed_s(agile, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) == pytest.approx(45.0)
