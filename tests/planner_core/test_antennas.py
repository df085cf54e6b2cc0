"""Multipliers of antennas that several satellites want at once: bounds hold and get tighter."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.antenna_multipliers import antenna_multipliers
from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.multipliers.resources import ResourceAscent
from planner_core.certified.proofs.bound import rounded_bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.latency import latency_value
from planner_core.certified.proofs.resource_bound import resource_value, whole_worth
from planner_core.certified.proofs.satellite_relaxation import relaxations
from planner_core.certified.solver import Certified
from planner_core.certified.strategies.resource_fleet import FleetAscent
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.tuning import tuned
from planner_core.domain import Dynamics, Objective, Resources
from planner_core.precedence.antennas import antenna_charges, antenna_groups, paid_for_antennas
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.rules import stations
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem, varied_problem

SEEDS = st.integers(0, 10**6)
_DELIVERED = Objective.delivered()
ROOMY = replace(Resources.limitless(), collect_fill_per_s=0.001, downlink_per_s=0.001)


def crowded(seed: int, dynamics: Dynamics, objective: Objective, antennas: int = 1) -> Problem:
    """Return three satellites over one station."""
    problem = varied_problem(seed, dynamics, 3, scarce=ROOMY, num_collects=6, num_contacts=4)
    problem = replace(problem, station_antennas=np.array([antennas], dtype=np.int32))
    return with_objective(problem, objective)


def shared_pass(num_satellites: int = 2, objective: Objective = _DELIVERED) -> Problem:
    """Return satellites with two images each and one pass at the same time."""
    tasks = [
        Task(kind=CONTACT, site=0, satellite=s, start_s=800.0, end_s=900.0)
        for s in range(num_satellites)
    ]
    tasks += [
        Task(kind=COLLECT, site=2 * s + i, satellite=s, start_s=at_s, end_s=at_s + 30.0)
        for s in range(num_satellites)
        for i, at_s in enumerate((100.0 + s, 400.0 + s))
    ]
    problem = make_problem(
        tasks, num_targets=2 * num_satellites, num_satellites=num_satellites, resources=ROOMY
    )
    return with_objective(problem, objective)


@examples(100)
@given(seed=SEEDS, antennas=st.integers(1, 2))
def test_groups_say_what_the_referee_says_of_stations(seed: int, antennas: int) -> None:
    problem = random_problem(seed, num_satellites=3, num_collects=1, num_contacts=7, num_stations=2)
    problem = replace(problem, station_antennas=np.full(2, antennas, dtype=np.int32))
    groups = antenna_groups(problem)
    table = problem.opportunities
    contacts = np.flatnonzero(table.kind == CONTACT).tolist()
    for size in (2, 3):
        for rows in combinations(contacts, size):
            if len(set(table.satellite[list(rows)].tolist())) < size:
                continue  # one satellite's contacts exclude each other anyway
            is_crowded = any(np.isin(group.rows, rows).sum() > group.limit for group in groups)
            assert is_crowded == bool(stations(problem, Plan.of(problem, rows)))
    sets = [set(group.rows.tolist()) for group in groups]
    assert not any(one < other for one in sets for other in sets)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(300)
@given(
    seed=SEEDS,
    collected_share=st.sampled_from([0.0, 0.5, 1.0]),
    half_life_s=st.sampled_from([None, 300.0]),
    antennas=st.integers(1, 2),
)
def test_no_plan_beats_any_multipliers_of_antennas(
    dynamics: Dynamics,
    seed: int,
    collected_share: float,
    half_life_s: float | None,
    antennas: int,
) -> None:
    if collected_share == 1.0:
        half_life_s = None
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    problem = crowded(seed, dynamics, objective, antennas)
    best = best_reward(problem)
    rng = np.random.default_rng(seed)
    num_contacts = int((problem.opportunities.kind == CONTACT).sum())
    for _ in range(2):
        multipliers = rng.uniform(0.0, 1.0, len(problem.target_ids)) * problem.best_worth
        antenna = rng.uniform(-0.5, 3.0, len(antenna_groups(problem)))
        if half_life_s is None:
            for unit in (1.0, 0.1):
                assert resource_value(problem, multipliers, unit, antenna) >= best - 1e-9
        else:
            charges = rng.uniform(0.0, 10.0, num_contacts)
            assert latency_value(problem, multipliers, charges, antenna) >= best - 1e-9


def test_multipliers_tell_that_one_of_two_satellites_is_served() -> None:
    problem = shared_pass()
    assert best_reward(problem) == 2.0
    search = ResourceAscent(problem, 4.0, np.zeros(4), np.zeros(1, dtype=np.uint8))
    search.step(2.0)
    assert search.value == pytest.approx(4.0)
    assert search.wants_antennas
    search.count_in(search.unit, moves_antennas=True)
    for _ in range(80):
        search.step(2.0)
    bound = search.bound()
    assert bound.value == pytest.approx(2.0)
    assert bound.antenna_multipliers is not None
    assert is_proven(problem, from_json(to_json(bound)))
    assert not is_proven(problem, replace(bound, antenna_multipliers=None))


@pytest.mark.parametrize("collected_share", [0.0, 0.5])
def test_contacts_pay_for_all_that_they_bring_down(collected_share: float) -> None:
    problem = shared_pass(2, Objective(collected_share=collected_share))
    everything = np.ones(len(problem.opportunities), dtype=np.bool_)
    paid = antenna_multipliers(problem, relaxations(problem), [everything], Budget(), 0)
    assert paid is not None
    assert paid.of_groups == pytest.approx([2.0 * (1.0 - collected_share)])
    assert paid.share == pytest.approx(np.full(4, collected_share))
    search = ResourceAscent(problem, 4.0, np.zeros(4), np.zeros(1, dtype=np.uint8))
    search.restart(paid.share, paid.of_groups)
    search.step(0.0)
    assert search.value == pytest.approx(best_reward(problem), rel=0.02)  # in whole units


def test_a_contact_pays_for_no_more_than_was_recorded_before_it() -> None:
    problem = shared_pass()
    table = problem.opportunities
    first = (table.kind == CONTACT) | (table.site % 2 == 0)
    paid = antenna_multipliers(problem, relaxations(problem), [first], Budget(), 0)
    assert paid is not None
    assert paid.of_groups == pytest.approx([1.0])


def test_images_of_a_satellite_with_an_antenna_of_its_own_pay_nothing() -> None:
    """The third satellite passes later; its image of the same target after that stays on board."""
    tasks = [
        Task(kind=CONTACT, site=0, satellite=s, start_s=at_s, end_s=at_s + 100.0)
        for s, at_s in enumerate((800.0, 800.0, 1200.0))
    ]
    tasks += [
        Task(kind=COLLECT, site=site, satellite=s, start_s=at_s, end_s=at_s + 30.0)
        for site, (s, at_s) in enumerate([(0, 100.0), (1, 101.0), (2, 102.0), (2, 1500.0)])
    ]
    problem = make_problem(tasks, num_targets=4, num_satellites=3, resources=ROOMY)
    problem = with_objective(problem, Objective(collected_share=0.5))
    everything = np.ones(len(problem.opportunities), dtype=np.bool_)
    paid = antenna_multipliers(problem, relaxations(problem), [everything], Budget(), 0)
    assert paid is not None
    assert paid.share[:3] == pytest.approx([0.5, 0.5, 1.0])
    assert problem.best_worth[3] == 0.5  # no contact follows


def test_what_all_comes_down_pays_for_nothing() -> None:
    problem = shared_pass()
    alone = problem.opportunities.satellite == 0
    assert antenna_multipliers(problem, relaxations(problem), [alone], Budget(), 0) is None
    roomy = replace(problem, station_antennas=np.array([2], dtype=np.int32))
    everything = np.ones(len(problem.opportunities), dtype=np.bool_)
    assert antenna_multipliers(roomy, relaxations(roomy), [everything], Budget(), 0) is None


@pytest.mark.parametrize("collected_share", [0.0, 0.5])
def test_a_fleet_over_one_station_is_bounded_by_what_it_brings_down(
    collected_share: float,
) -> None:
    problem = shared_pass(6, Objective(collected_share=collected_share))
    search = ResourceSearch(Incumbent(problem, Budget(), 0.0), 0)
    contacts = np.flatnonzero(problem.opportunities.kind == CONTACT)
    search.offer(Plan.of(problem, np.setdiff1d(np.arange(18), contacts[1:])))
    # As if the fleet were too large for the relaxation of the whole program.
    with tuned(several=1, most_relaxed=0):
        ascent = FleetAscent(search)
        while not ascent.is_settled:
            ascent.step()
    bound = search.best.bound
    most = 12.0 * collected_share + 2.0 * (1.0 - collected_share)
    assert bound.value == pytest.approx(most, rel=0.02)  # in whole units
    assert is_proven(problem, bound)
    assert bound.antenna_multipliers is not None


def _crowded_fleet(seed: int) -> Problem:
    problem = random_problem(
        seed, num_satellites=3, num_collects=60, num_targets=30, num_contacts=8, span_s=6000.0,
        resources=TIGHT,
    )  # fmt: skip
    return with_objective(problem, Objective.delivered())


def test_more_levels_of_the_recorder_lower_the_bound_of_the_same_multipliers() -> None:
    resources = replace(ROOMY, collect_fill_per_s=0.0037, downlink_per_s=0.0013)
    roughly, finely = list[float](), list[float]()
    for seed in range(8):
        problem = random_problem(
            seed, num_satellites=3, num_collects=150, num_targets=100, num_contacts=6,
            span_s=6000.0, resources=replace(resources, initial_recorder_fraction=0.0),
        )  # fmt: skip
        problem = with_objective(problem, Objective.delivered())
        search = ResourceAscent(problem, 8.0, np.zeros(100), np.zeros(1, dtype=np.uint8))
        search.step(0.0)
        roughly.append(search.value)
        search.count_finely(Plan())
        search.step(0.0)
        finely.append(search.value)
        assert finely[-1] <= roughly[-1]
        assert is_proven(problem, search.bound())
    assert sum(finely) < 0.9 * sum(roughly)


def test_multipliers_of_antennas_that_prove_nothing_are_given_up() -> None:
    """The final bound is no higher than without those multipliers."""
    num_crowded = 0
    for seed in range(12):
        problem = _crowded_fleet(seed)
        search = ResourceSearch(Incumbent(problem, Budget(), 0.0), seed)
        with tuned(worth_a_step=1.0):
            ascent = FleetAscent(search)
            while ascent.exact is None:
                ascent.step()
            first = search.best.bound.value
            while not ascent.is_settled:
                ascent.step()
        num_crowded += ascent.exact.wants_antennas
        assert not ascent.knows_antennas
        assert rounded_bound(problem, ascent.exact.value, 0.0) <= first
    assert num_crowded > 1


def test_multipliers_tell_so_where_images_age() -> None:
    problem = with_objective(shared_pass(), Objective(collected_share=0.0, half_life_s=3600.0))
    best = best_reward(problem)
    ascent = LatencyAscent(problem, np.zeros(4))
    ascent.improve(100, best, np.zeros(1, dtype=np.uint8))
    bound = ascent.bound()
    assert best <= bound.value < 1.3 * best
    assert latency_value(problem, ascent.multipliers, ascent.contact_multipliers) > 1.5 * best
    assert is_proven(problem, from_json(to_json(bound)))


def test_with_two_antennas_nothing_is_crowded() -> None:
    problem = replace(shared_pass(), station_antennas=np.array([2], dtype=np.int32))
    assert antenna_groups(problem) == ()
    assert replay(problem, Certified().solve(problem, Budget(), 0).plan).reward == 4.0


def test_a_path_pays_for_its_contacts() -> None:
    """Three whole units for two images, less one for the contact that downlinks them."""
    problem = shared_pass()
    multipliers, antenna = np.full(4, 0.5), np.array([0.25])
    worth = whole_worth(problem, multipliers, 0.25, antenna)
    stop = np.zeros(1, dtype=np.uint8)
    for one in relaxations(problem):
        most, path = one.most(worth, 0.25, 0, stop, keeps_path=True)
        assert path is not None
        assert most == 3 == worth[one.satellite.rows[path]].sum()
        assert len(path) == 3
    assert paid_for_antennas(problem, antenna) == 0.25
    assert antenna_charges(problem, antenna).sum() == 0.5
    assert resource_value(problem, multipliers, 0.25, antenna) == pytest.approx(2.0 + 0.25 + 1.5)


def test_a_contact_that_costs_more_than_all_it_brings_down_is_not_taken() -> None:
    problem = shared_pass()
    worth = whole_worth(problem, np.zeros(4), 1.0, np.array([3.0]))
    for one in relaxations(problem):
        most, path = one.most(worth, 1.0, 0, np.zeros(1, dtype=np.uint8), keeps_path=True)
        assert most == 0
        assert path is not None
        assert worth[one.satellite.rows[path]].sum() == 0
