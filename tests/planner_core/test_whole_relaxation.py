"""The whole relaxation with a cost of data left on board, and exchanges of contacts."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.contact_exchange import ContactExchange
from planner_core.certified.mip.whole_relaxation import whole_relaxation
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.whole_program import (
    RowMultipliers,
    charges_for_data_left,
    program_to_relax,
    whole_program_value,
)
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.certified.strategies.relaxed import Relaxed
from planner_core.certified.strategies.resource_fleet import FleetAscent
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.resources import exchanged_contacts
from planner_core.certified.tuning import TUNING, tuned
from planner_core.domain import Agility, Dynamics, Objective, Resources
from planner_core.errors import InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.precedence.relation import is_transitive
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.pinned import Kept, Pinned
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.rule import Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import (
    TIGHT,
    Task,
    make_problem,
    random_problem,
    sunny_problem,
    varied_problem,
)

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
SHARES = st.sampled_from([0.1, 0.5, 0.9])
_HALF = Objective(collected_share=0.5)
_SLOW = Agility(slew_rate_deg_s=0.15)
_BARE = replace(
    Resources.limitless(),
    collect_fill_per_s=0.001,
    downlink_per_s=0.001,
    initial_recorder_fraction=0.0,
)


@examples(400)
@given(
    seed=SEEDS,
    dynamics=DYNAMICS,
    collected_share=SHARES,
    num_satellites=st.integers(1, 2),
    has_quality=st.booleans(),
    agility=st.sampled_from([Agility(), _SLOW]),
    num_kept=st.integers(0, 2),
    half_life_s=st.sampled_from([None, 300.0, 1800.0]),
)
def test_no_plan_beats_the_relaxation(
    seed: int,
    dynamics: Dynamics,
    collected_share: float,
    half_life_s: float | None,
    num_satellites: int,
    has_quality: bool,
    agility: Agility,
    num_kept: int,
) -> None:
    problem = random_problem(
        seed,
        dynamics=dynamics,
        num_satellites=num_satellites,
        has_quality=has_quality,
        agility=agility,
        max_turn_deg=60.0 if agility is _SLOW else 0.0,
        num_collects=6,
        num_targets=4,
    )
    objective = Objective(collected_share=collected_share, half_life_s=half_life_s)
    problem = with_objective(problem, objective)
    rows = np.random.default_rng(seed).permutation(len(problem.opportunities))[:num_kept]
    with suppress(InvalidScenario):
        problem = _keeping(problem, *rows.tolist())
    assume(replay(problem, Plan().with_kept(problem)).is_valid)
    bound = whole_relaxation(problem, Budget(), 0).bound
    assert bound.value >= best_reward(problem) - 1e-6
    assert_checkable(problem, bound)


def assert_checkable(problem: Problem, bound: Bound) -> None:
    read = from_json(to_json(bound))
    assert is_proven(problem, read)
    too_low = 0.999 * bound.value - problem.reward_unit - 1e-6
    assert not is_proven(problem, replace(read, value=too_low))


@examples(200)
@given(seed=SEEDS, scale=st.sampled_from([0.01, 1.0, 100.0]))
def test_no_plan_beats_any_multipliers_of_rows(seed: int, scale: float) -> None:
    problem = varied_problem(seed, "paper", 2, scarce=TIGHT, num_contacts=4)
    problem = with_objective(problem, _HALF)
    model, rng = program_to_relax(problem), np.random.default_rng(seed)
    drawn = rng.normal(scale=scale, size=model.program.num_rows)
    found = whole_relaxation(problem, Budget(), 0).bound.row_multipliers
    assert found is not None
    near = replace(found, of_rows=found.of_rows * rng.uniform(1.0 - scale, 1.0 + scale))
    every = np.arange(model.program.num_rows, dtype=np.int32)
    for multipliers in (RowMultipliers(rows=every, of_rows=drawn), near):
        assert whole_program_value(model, multipliers) >= best_reward(problem) - 1e-9


def test_multipliers_of_limits_that_rows_do_not_have_count_as_nothing() -> None:
    """At most 1 of x and 0.4 for each y above 0.5: y >= x - 0.5 costs less than x is worth."""
    program = Program()
    x = program.add_columns(np.ones(1))
    y = program.add_columns(np.array([-0.4]))
    program.add_rows(Rows.aligned((y, 1.0), (x, -1.0), lower=-0.5))
    for multiplier, bound in ((-0.4, 0.8), (-0.3, 0.85), (-0.5, 0.85), (0.3, 1.0)):
        assert program.dual_value(np.array([multiplier])) == pytest.approx(bound)


def test_sets_that_are_no_cliques_prove_nothing() -> None:
    problem = _two_images_and_a_contact_for_one()
    model = program_to_relax(problem)

    def value(clique: list[int], multiplier: float) -> float:
        none = RowMultipliers(rows=np.empty(0, np.int32), of_rows=np.empty(0))
        cliques, of_cliques = (np.array(clique, dtype=np.int32),), (multiplier,)
        return whole_program_value(model, replace(none, cliques=cliques, of_cliques=of_cliques))

    assert value([0], 0.5) == 2.0
    assert value([0, 1], 0.5) == np.inf, "both fit into a plan"
    assert value([0, 0], 0.5) == np.inf, "it would count twice"
    assert value([0], -0.5) == np.inf


@examples(200)
@given(seed=SEEDS, collected_share=SHARES, num_satellites=st.integers(1, 2))
def test_no_plan_with_turns_to_the_sun_beats_it(
    seed: int, collected_share: float, num_satellites: int
) -> None:
    problem = sunny_problem(seed, num_satellites=num_satellites, num_collects=6)
    problem = with_objective(problem, Objective(collected_share=collected_share))
    if replay(problem, Plan()).is_valid:
        bound = whole_relaxation(problem, Budget(), 0).bound
        assert bound.value >= best_reward(problem) - 1e-6
        assert_checkable(problem, bound)


def _keeping(problem: Problem, *rows: int) -> Problem:
    return apply_pins(problem, Pinned(kept=tuple(Kept(row=row, pointer="") for row in rows)))


def _two_images_and_a_contact_for_one() -> Problem:
    tasks = [
        Task(kind=COLLECT, site=0, start_s=100.0, end_s=130.0),
        Task(kind=COLLECT, site=1, start_s=200.0, end_s=230.0),
        Task(kind=CONTACT, site=0, start_s=400.0, end_s=430.0),
    ]
    return with_objective(make_problem(tasks, num_targets=2, resources=_BARE), _HALF)


def test_data_that_stays_on_board_has_its_cost() -> None:
    problem = _two_images_and_a_contact_for_one()
    assert charges_for_data_left(problem)
    assert best_reward(problem) == 1.5
    assert whole_relaxation(problem, Budget(), 0).bound.value == pytest.approx(1.5)


def test_images_that_may_earn_nothing_are_not_charged_for() -> None:
    problem = _two_images_and_a_contact_for_one()
    kept = _keeping(problem, 0)
    assert charges_for_data_left(kept), "it earns something"
    worthless = replace(kept, worth=np.where(kept.worth > 0.0, [0.0, 1.0, 0.0], 0.0))
    assert not charges_for_data_left(worthless)
    assert whole_relaxation(worthless, Budget(), 0).bound.value == pytest.approx(1.0)
    detours = next(
        problem
        for seed in range(100)
        if not is_transitive(problem := random_problem(seed, agility=_SLOW, max_turn_deg=60.0))
    )
    assert not charges_for_data_left(with_objective(detours, _HALF))


def test_a_budget_that_is_over_proves_next_to_nothing() -> None:
    spent = Budget()
    spent.cancel()
    problem = _two_images_and_a_contact_for_one()
    relaxation = whole_relaxation(problem, spent, 0)
    assert relaxation.bound.value == 2.0, "what all images earn"
    assert sorted(relaxation.order) == [0, 1, 2]
    relaxed = Relaxed(Incumbent(problem, spent, 0.0), 0)
    relaxed.solve()
    assert relaxed.is_known
    assert not relaxed.proves_more_than(2.0)


def _one_pass_for_two_satellites() -> Problem:
    """Return a problem in which the second satellite has three images to bring down, not one."""
    images = [(0, 100.0), (1, 150.0), (1, 250.0), (1, 350.0)]
    tasks = [
        *(
            Task(kind=COLLECT, site=i, satellite=s, start_s=at_s, end_s=at_s + 30.0)
            for i, (s, at_s) in enumerate(images)
        ),
        *(Task(kind=CONTACT, site=0, satellite=s, start_s=600.0, end_s=700.0) for s in (0, 1)),
    ]
    problem = make_problem(tasks, num_targets=4, num_satellites=2, resources=_BARE)
    return with_objective(problem, _HALF)


def test_a_pass_goes_to_the_satellite_that_has_more_to_bring_down() -> None:
    problem = _one_pass_for_two_satellites()
    table = problem.opportunities
    is_wrong = (table.kind == CONTACT) & (table.satellite == 1)
    plan = Plan.of(problem, np.flatnonzero(~is_wrong))
    best = Incumbent(problem, Budget(), 0.0, plan=plan)
    assert best.is_valid
    assert best.reward == 2.5
    exchange = ContactExchange(best, 0, np.ones(len(table), dtype=np.bool_))
    better = exchange.step()
    assert better is not None
    assert best.offer(better)
    assert best.reward == best_reward(problem) == 3.5
    assert exchange.step() is None, "nothing is left to try"


def test_exchanges_end_if_there_are_no_tasks_to_offer() -> None:
    """They waited for a relaxation that is never solved: without a time limit, for ever."""
    problem = _one_pass_for_two_satellites()
    search = Search(Incumbent(problem, Budget(), 0.0), 0, STRATEGIES)
    with tuned(most_columns=0, most_relaxed=0):
        slices = exchanged_contacts(search)
        next(slices)
        search.num_idle = TUNING.rounds
        assert next(slices, "ended") == "ended"


@examples(60)
@given(seed=SEEDS, dynamics=DYNAMICS, collected_share=SHARES)
def test_reduced_costs_limit_what_an_exchange_gains(
    seed: int, dynamics: Dynamics, collected_share: float
) -> None:
    problem = varied_problem(seed, dynamics, 2, scarce=TIGHT, num_contacts=4)
    problem = with_objective(problem, Objective(collected_share=collected_share))
    best = Incumbent(problem, Budget(), 0.0, plan=Rule().solve(problem, Budget(), 0).plan)
    exchange = ContactExchange(best, seed, np.ones(len(problem.opportunities), dtype=np.bool_))
    around = exchange._around(best.plan.contacts(problem))
    for most, contacts in around:
        exchange._program.fix(contacts)
        assert exchange._program.relaxed() <= most + 1e-6
    reward = best.reward
    while (plan := exchange.step()) is not None:
        assert best.offer(plan)
        assert best.reward > reward
        reward = best.reward
    assert reward <= best_reward(problem) + 1e-9


def test_exact_programmes_are_left_out_where_the_relaxation_proves_more() -> None:
    problem = _one_pass_for_two_satellites()
    best = Incumbent(problem, Budget(), 0.0)
    search = ResourceSearch(best, 0)
    # As if the plan were far from what batteries allow.
    with tuned(tight=-1e9):
        ascent = FleetAscent(search)
        while not ascent.is_settled:
            ascent.step()
    assert search.whole.proves_more_than(4.0)
    assert search.relaxation_suffices
    assert ascent.exact is None
    assert 3.5 <= best.bound.value < 4.0
