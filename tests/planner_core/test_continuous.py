"""Continuous starts: plans the referee confirms, and bounds that no plan exceeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Termination
from planner_core.certified.driver import Effort, Search, Strategy
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.continuous_search import ContinuousSearch
from planner_core.certified.lns.insertion_with_resources import (
    filled_with_resources,
    replanned_window,
)
from planner_core.certified.proofs import documents as proofs
from planner_core.certified.proofs.bound import Bound, accessible
from planner_core.certified.proofs.continuous import ContinuousDual, continuous_value
from planner_core.certified.strategies import continuous
from planner_core.certified.strategies.continuous import with_own_starts
from planner_core.certified.strategies.every import solved
from planner_core.certified.tuning import TUNING
from planner_core.domain import Agility
from planner_core.precedence.earliest_starts import follows_at_s
from planner_core.precedence.time_windows import time_windows_of, view_of
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Blocked,
    Kept,
    Pinned,
    Problem,
)
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution
from planner_core.solvers.registry import SOLVERS, Certified, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward as best_of_table
from tests.planner_core.flat_earth import flat_problem

SEEDS = st.integers(0, 10**6)


def planned(problem: Problem, budget: Budget, seed: int, moves_per_task: float) -> Solution:
    """Return what all strategies find in this number of moves."""
    return solved(problem, budget, seed, 0.0, Effort(moves_per_task=moves_per_task))


AGILITIES = st.sampled_from(
    [Agility(), Agility(slew_rate_deg_s=3.0), Agility(slew_rate_deg_s=1.0, settle_s=5.0),
     Agility(slew_rate_deg_s=1.5, acceleration_deg_s2=0.3), Agility(slew_rate_deg_s=0.3)]
)  # fmt: skip


def best_reward(problem: Problem) -> float:
    """Return the best reward of one satellite with continuous starts, by trying every sequence.

    Its slews are faster than its lines of sight, so each task is best begun as early as possible.
    """
    spans, view = time_windows_of(problem, 0), view_of(problem, 0)
    reward = problem.best_worth
    best = 0.0

    def go_on(last: int, start_s: float, taken: frozenset[int]) -> None:
        nonlocal best
        best = max(best, float(sum(reward[target] for target in taken)))
        for task in range(len(spans.row)):
            target = int(spans.site[task])
            if target in taken:
                continue
            then_s = spans.open_s[task]
            if last >= 0:
                then_s = follows_at_s(spans, view, last, start_s, task)
            if np.isfinite(then_s):
                go_on(task, float(then_s), taken | {target})

    go_on(-1, 0.0, frozenset())
    return best


@examples(25)
@given(seed=SEEDS, agility=AGILITIES, num_satellites=st.integers(1, 3), has_rewards=st.booleans(),
       spacing_s=st.sampled_from([None, 40.0]))  # fmt: skip
def test_plans_are_valid_no_worse_than_they_began_and_below_the_bound(
    seed: int, agility: Agility, num_satellites: int, has_rewards: bool, spacing_s: float | None
) -> None:
    problem = flat_problem(
        seed, num_targets=12, horizon_s=900.0, agility=agility, has_rewards=has_rewards,
        num_satellites=num_satellites, spacing_s=spacing_s,
    )  # fmt: skip
    rule = Rule().solve(problem, Budget(), 0)
    solution = planned(problem, Budget(), seed, 20.0)
    timeline = replay(problem, solution.plan)
    assert not timeline.violations
    assert timeline.reward >= replay(problem, rule.plan).reward
    assert solution.bound is not None
    assert timeline.reward <= solution.bound + 1e-6
    assert solution.plan == planned(problem, Budget(), seed, 20.0).plan
    filled = with_own_starts(problem, rule, Budget())
    assert replay(problem, filled.plan).is_valid
    assert replay(problem, filled.plan).reward >= replay(problem, rule.plan).reward


@examples(40)
@given(
    seed=SEEDS, rate=st.sampled_from([1.0, 2.0]), settle_s=st.sampled_from([0.0, 6.0]),
    has_rewards=st.booleans(), width_s=st.sampled_from([2.5, 7.0, 25.0]),
)  # fmt: skip
def test_whatever_the_multipliers_the_bound_is_not_below_the_best_plan(
    seed: int, rate: float, settle_s: float, has_rewards: bool, width_s: float
) -> None:
    agility = Agility(slew_rate_deg_s=rate, settle_s=settle_s)
    problem = flat_problem(
        seed, num_targets=6, horizon_s=450.0, has_rewards=has_rewards, agility=agility
    )
    best = best_reward(problem)
    dual = ContinuousDual.of(problem, width_s)
    assert dual is not None
    rng = np.random.default_rng(seed)
    for share in (0.0, 0.3, 1.0):
        multipliers = problem.best_worth * np.clip(rng.normal(share, 0.3, 6), 0.0, 1.0)
        assert dual.at(multipliers)[0] >= best - 1e-9
    solution = planned(problem, Budget(), 0, 20.0)
    reward = replay(problem, solution.plan).reward
    assert reward <= best + 1e-9
    assert solution.bound is not None
    assert best <= solution.bound + 1e-9
    if solution.termination is Termination.OPTIMAL:
        assert reward == pytest.approx(best, abs=1e-5)


def test_small_problems_end_at_the_optimum_and_most_are_proven() -> None:
    reached = proven = 0
    for seed in range(25):
        problem = flat_problem(seed, num_targets=6, horizon_s=450.0)
        solution = planned(problem, Budget(), 0, 30.0)
        reached += replay(problem, solution.plan).reward == best_reward(problem)
        proven += solution.termination is Termination.OPTIMAL
    assert reached >= 23
    assert proven >= 15


@examples(15)
@given(seed=SEEDS, num_satellites=st.integers(1, 2))
def test_the_best_plan_on_a_grid_stays_below_the_bound(seed: int, num_satellites: int) -> None:
    problem = flat_problem(
        seed, num_targets=10, horizon_s=700.0, spacing_s=20.0, num_satellites=num_satellites
    )
    grid = replace(problem, continuous_starts=False, pointing=None)
    best = Certified().solve(grid, Budget(), 0)
    bound = planned(problem, Budget(), 0, 5.0).proven
    assert bound is not None
    assert replay(grid, best.plan).reward <= bound.value
    search = ContinuousSearch(problem, best.plan, Budget(), 0)
    assert search.reward == replay(grid, best.plan).reward
    search.fill()
    search.move(100)
    assert best.bound is not None
    assert search.reward >= replay(grid, best.plan).reward


def test_multipliers_that_prove_nothing_better_let_others_have_their_turn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = flat_problem(1, num_targets=8)
    high = replace(accessible(problem), value=100.0)
    told = [None, high, None, None, high]

    def ascend(*_: object) -> Iterator[Bound | None]:
        yield from told

    monkeypatch.setattr(continuous, "ascend_on_chains", ascend)
    best = Incumbent(problem, Budget(), 0.0, bound=accessible(problem), covers_starts=True)
    assert best.bound.value < 100.0
    assert len(list(continuous.chain_multipliers(Search(best, 0, ())))) == 2
    best.budget.cancel()
    assert len(list(continuous.chain_multipliers(Search(best, 0, ())))) == len(told)


def test_bounds_can_be_checked_and_false_ones_are_refused() -> None:
    problem = flat_problem(3, num_targets=14, horizon_s=700.0)
    bound = planned(problem, Budget(), 0, 10.0).proven
    assert bound is not None
    again = proofs.from_json(proofs.to_json(bound))
    assert proofs.is_proven(problem, again)
    assert not proofs.is_proven(problem, replace(again, value=bound.value - 1.0))
    every = accessible(problem)
    assert every.value == len(np.unique(problem.opportunities.site))
    assert proofs.is_proven(problem, every)


def test_what_bounds_fixed_starts_is_not_taken_for_free_ones() -> None:
    """A bound over the opportunities alone may lie below a plan with continuous starts."""
    problem = flat_problem(3, num_targets=14, horizon_s=700.0)
    grid = replace(problem, continuous_starts=False, pointing=None)
    bound = Certified().solve(grid, Budget(), 0).proven
    assert bound is not None
    assert proofs.is_proven(grid, bound)
    assert not proofs.is_proven(problem, bound)
    best = planned(problem, Budget(), 0, 10.0)
    assert replay(problem, best.plan).reward > bound.value
    for name in ("rule", "milp", "forward_search"):
        assert SOLVERS[name]().solve(problem, Budget(), 0).proven is None


def test_progress_with_resources_tells_no_bound_of_fixed_starts() -> None:
    problem = flat_problem(
        2, num_targets=14, num_contacts=2, horizon_s=900.0, use_resources=True, spacing_s=60.0
    )
    told: list[float] = []
    budget = Budget(report=lambda p: told.append(p.bound) if p.bound is not None else None)
    solution = Certified().solve(problem, budget, 0)
    assert solution.bound is not None
    assert min(told) >= solution.bound
    assert solution.bound >= replay(problem, solution.plan).reward


def test_what_fits_is_put_into_each_better_plan_with_fixed_starts_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Not into the first, which is the rule's; and windows continue from the best plan."""
    problem = flat_problem(
        2, num_targets=30, num_contacts=2, horizon_s=1500.0, use_resources=True, spacing_s=60.0
    )
    whole = Rule().solve(problem, Budget(), 0).plan
    plans = [Plan(whole.actions[:num]) for num in (2, 2, 4, 4, 6)]

    def offered(search: Search) -> Iterator[None]:
        for plan in plans:
            search.best.offer(plan)
            yield

    filled, begun = list[Plan](), list[Plan]()

    def fill(_: Problem, plan: Plan, __: Budget) -> Plan:
        filled.append(plan)
        return plan

    def replan(_: Problem, plan: Plan, *others: object) -> Plan:
        begun.append(plan)
        return plan

    monkeypatch.setattr(continuous, "filled_with_resources", fill)
    monkeypatch.setattr(continuous, "replanned_window", replan)
    offer = Strategy(name="offers", supports=lambda _: True, slices=offered)
    best = Incumbent(problem, Budget(), 0.0, bound=accessible(problem), covers_starts=True)
    search = Search(best, 0, [offer])
    assert len(list(continuous.fixed_starts(search))) == 3
    assert filled == [plans[2], plans[4]]
    windows = continuous.windows_with_resources(search)
    next(windows)
    best.offer(whole)
    next(windows)
    assert begun == [plans[4]] * TUNING.several + [whole] * TUNING.several


def test_windows_planned_anew_keep_what_must_be_and_often_better_the_plan() -> None:
    gained = 0.0
    for seed in range(6):
        problem = flat_problem(
            seed, num_targets=40, num_contacts=2, horizon_s=1500.0, use_resources=True,
            spacing_s=60.0, has_rewards=True,
        )  # fmt: skip
        plan = filled_with_resources(problem, Rule().solve(problem, Budget(), 0).plan, Budget())
        before = replay(problem, plan).reward
        contacts = {a for a in plan.actions if problem.opportunities.kind[a.opportunity] == CONTACT}
        image = next(a for a in plan.actions if a not in contacts)
        kept = Kept(row=image.opportunity, pointer="")
        problem = replace(problem, pinned=replace(problem.pinned, kept=(kept,)))
        rng, reward = np.random.default_rng(seed), before
        for _ in range(30):
            new = replanned_window(problem, plan, Budget(), rng)
            judged = replay(problem, new)
            assert judged.is_valid
            assert image.opportunity in {a.opportunity for a in new.actions}
            assert {a.opportunity for a in contacts} <= {a.opportunity for a in new.actions}
            if judged.reward >= reward:
                plan, reward = new, judged.reward
        gained += reward - before
    assert gained > 0.0


@examples(60)
@given(
    seed=SEEDS,
    rate=st.sampled_from([0.1, 0.3, 0.55]),
    acceleration=st.sampled_from([None, 0.1]),
    width_s=st.sampled_from([2.5, 7.0, 25.0]),
)
def test_a_satellite_slower_than_its_lines_of_sight_is_bounded_as_if_it_were_not(
    seed: int, rate: float, acceleration: float | None, width_s: float
) -> None:
    agility = Agility(slew_rate_deg_s=rate, acceleration_deg_s2=acceleration)
    problem = flat_problem(
        seed, num_targets=4, horizon_s=450.0, spacing_s=30.0, agility=agility, has_rewards=True
    )
    best = best_of_table(replace(problem, continuous_starts=False, pointing=None))
    rng = np.random.default_rng(seed)
    for share in (0.0, 0.3, 1.0):
        multipliers = problem.best_worth * np.clip(rng.normal(share, 0.3, 4), 0.0, 1.0)
        assert continuous_value(problem, multipliers, width_s) >= best - 1e-9


def test_its_bound_is_below_that_of_all_targets_where_they_are_crowded() -> None:
    slow = flat_problem(1, num_targets=40, agility=Agility(slew_rate_deg_s=0.2))
    solution = planned(slow, Budget(), 0, 5.0)
    assert replay(slow, solution.plan).is_valid
    assert solution.bound is not None
    assert solution.bound < accessible(slow).value
    assert solution.proven is not None
    assert proofs.is_proven(slow, solution.proven)


@examples(30)
@given(seed=SEEDS)
def test_pins_hold_and_blocked_intervals_stay_empty(seed: int) -> None:
    """An access that contains a blocked interval may be used on either side of it."""
    problem = flat_problem(seed, num_targets=12, horizon_s=900.0)
    rng = np.random.default_rng(seed)
    from_s = round(float(rng.uniform(100.0, 600.0)), 3)
    table = problem.opportunities
    clear = (table.end_s < from_s - 1.0) | (table.start_s > from_s + 61.0)
    rows = np.flatnonzero(clear & (table.kind == COLLECT))
    kept = int(rng.choice(rows))
    blocked = Blocked(satellite=0, start_s=from_s, end_s=from_s + 60.0,
                      kinds=frozenset({COLLECT}), pointer="/pins/block/0")  # fmt: skip
    pinned = replace(
        problem, pinned=Pinned(kept=(Kept(row=kept, pointer="/pins/keep/0"),), blocked=(blocked,))
    )
    start = Plan.of(pinned, [kept])
    search = ContinuousSearch(pinned, start, Budget(), seed)
    search.fill()
    search.move(200)
    timeline = replay(pinned, search.plan)
    assert not timeline.violations
    assert any(a.opportunity == kept for a in search.plan.actions)
    spans = time_windows_of(pinned, 0)
    is_before = spans.close_s + spans.length_s <= from_s + 1e-6
    assert (is_before | (spans.open_s >= from_s + 60.0 - 1e-6)).all()


@pytest.mark.parametrize("name", ["rule", "graph", "forward_search", "milp"])
def test_other_solvers_get_what_fits_between_their_tasks(name: str) -> None:
    gained = 0.0
    for seed in range(6):
        problem = flat_problem(seed, num_targets=14, horizon_s=900.0)
        solution = SOLVERS[name]().solve(problem, Budget(), 0)
        filled = with_own_starts(problem, solution, Budget())
        assert not replay(problem, filled.plan).violations
        gained += replay(problem, filled.plan).reward - replay(problem, solution.plan).reward
        assert filled.termination is not Termination.OPTIMAL
    assert gained > 0.0


def test_a_spent_budget_still_answers() -> None:
    problem = flat_problem(0, num_targets=12)
    budget = Budget()
    budget.cancel()
    solution = planned(problem, budget, 0, 30.0)
    assert replay(problem, solution.plan).is_valid
    assert solution.termination in (Termination.CANCELLED, Termination.OPTIMAL)
