"""Replans: no frozen action differs, no promise is bumped, and bounds hold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.domain import Stability
from planner_core.errors import InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import COLLECT, CONTACT, Blocked, Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.replanning import days
from planner_core.replanning.known import KnownMultipliers, bound_at, multipliers_of
from planner_core.replanning.programs import fewest_changes
from planner_core.replanning.question import Question
from planner_core.replanning.replan import first_plan, improved, solve_replan
from planner_core.replanning.undo import parts_of, value, within_share, without
from planner_core.solvers.registry import Certified, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_plan
from tests.planner_core.problems import random_problem

SEEDS = st.integers(0, 10**6)
BETA = Stability()


@dataclass(frozen=True, kw_only=True)
class Event:
    """A plan in force, a change that affects it, and the question what to do now."""

    whole: Problem
    base: Plan
    frozen: frozenset[int]
    question: Question

    def rows(self, plan: Plan) -> set[int]:
        """Return a plan's actions as rows of the whole table."""
        return {self.question.problem.scenario_row(a.opportunity) for a in plan.actions}


def event_at_random(
    seed: int,
    *,
    use_resources: bool,
    size: int = 1,
    stability: Stability = BETA,
    is_exact: bool = True,
) -> Event | None:
    """Return a plan with an outage, an instant up to which it is frozen, and promises.

    If not ``is_exact``, it is the rule's plan instead of the best one.
    """
    rng = np.random.default_rng(seed)
    whole = random_problem(
        seed, use_resources=use_resources, num_satellites=2, num_targets=5 * size,
        num_collects=8 * size, num_contacts=3, num_stations=1,
    )  # fmt: skip
    base = (Certified() if is_exact else Rule()).solve(whole, Budget(), 0).plan
    if not base.actions or not replay(whole, base).is_valid:
        return None
    table = whole.opportunities
    frozen_until_s = float(rng.uniform(0, 500))
    from_s = float(rng.uniform(frozen_until_s, 900))
    lost = Blocked(
        satellite=int(rng.integers(2)) if rng.random() < 0.6 else None, station=0, start_s=from_s,
        end_s=from_s + float(rng.uniform(20, 300)), kinds=frozenset({COLLECT, CONTACT}),
        pointer="/outages/0",
    )  # fmt: skip
    lost = replace(lost, station=None if lost.satellite is not None else 0)
    taken = [action.opportunity for action in base.actions]
    frozen = [row for row in taken if table.start_s[row] < frozen_until_s - 1e-3]
    pinned = Pinned(
        kept=tuple(Kept(row=row, pointer=f"/replan/base/{i}") for i, row in enumerate(frozen)),
        blocked=(lost,),
        frozen_until_s=frozen_until_s,
    )
    try:
        problem = apply_pins(whole, pinned)
    except InvalidScenario:
        return None  # a frozen action lies in the outage, or the limits can no longer be kept
    assert problem.origin is not None
    still = np.flatnonzero(np.isin(problem.origin, taken))
    imaged = problem.opportunities.site[still[problem.opportunities.kind[still] == COLLECT]]
    promised = rng.permutation(np.unique(imaged))[: rng.integers(3)]
    question = Question(
        problem=problem, base=still.astype(np.int32), num_base=len(taken) - len(frozen),
        promised=tuple(promised.tolist()), stability=stability,
    )  # fmt: skip
    return Event(whole=whole, base=base, frozen=frozenset(frozen), question=question)


@examples(200)
@given(seed=SEEDS, use_resources=st.booleans(), is_exact=st.booleans())
def test_nothing_frozen_differs_and_nothing_promised_is_bumped(
    seed: int, use_resources: bool, is_exact: bool
) -> None:
    happened = event_at_random(seed, use_resources=use_resources)
    if happened is None:
        return
    question = happened.question
    try:
        solution = solve_replan(question, Certified() if is_exact else Rule(), Budget(), 0)
    except InvalidScenario as error:
        # A target the plan imaged and can still image is dropped only because of limits.
        is_refusal = use_resources and error.fault.code == "promise_not_kept"
        if not is_refusal:
            raise
        event("refused")
        return
    problem = question.problem
    rows = happened.rows(solution.plan)
    start_s = happened.whole.opportunities.start_s
    assert {r for r in rows if problem.pinned.is_frozen(start_s[r])} == happened.frozen
    assert not question.missing(solution.plan)
    codes = {v.code for v in replay(problem, solution.plan).violations}
    assert not codes & {"frozen", "outage", "slew", "station", "overlap"}
    event(f"changed: {question.changed(solution.plan)}")


@examples(100)
@given(seed=SEEDS, use_resources=st.booleans())
def test_no_plan_exceeds_the_bounds(seed: int, use_resources: bool) -> None:
    """Brute force over the remaining tasks, for the reward and for the sum with the changes."""
    happened = event_at_random(seed, use_resources=use_resources)
    if happened is None:
        return
    question = replace(happened.question, promised=())
    problem = question.problem
    solution = solve_replan(question, Certified(), Budget(), 0)
    timeline = replay(problem, solution.plan)
    best = best_plan(problem)
    if best is None:
        return
    assert timeline.is_valid
    assert solution.bound is not None
    assert solution.bound >= replay(problem, best).reward - 1e-6
    summed = solution.statistics["stability_bound"]
    assert summed >= value(question, solution.plan) - 1e-6
    assert summed >= value(question, best) - 1e-6
    searched = best_plan(question.searched)
    assert searched is not None
    assert summed >= value(question, searched) - 1e-6
    # It earns what a plan from scratch earns, less at most what changes would cost.
    slack = float(question.bonus.sum())
    assert timeline.reward >= replay(problem, best).reward - slack - 1e-6


@examples(60)
@given(seed=SEEDS, use_resources=st.booleans())
def test_where_nothing_happens_nothing_changes(seed: int, use_resources: bool) -> None:
    whole = random_problem(
        seed, use_resources=use_resources, num_satellites=2, num_targets=10, num_collects=16,
        num_contacts=4,
    )  # fmt: skip
    base = Certified().solve(whole, Budget(), 0).plan
    if not replay(whole, base).is_valid:
        return
    rows = np.array(sorted(a.opportunity for a in base.actions), dtype=np.int32)
    question = Question(
        problem=whole, base=rows, num_base=len(rows), promised=(), stability=Stability()
    )
    plan = solve_replan(question, Certified(), Budget(), 1).plan
    assert plan == base


@examples(60)
@given(seed=SEEDS, use_resources=st.booleans())
def test_no_part_of_the_difference_gains_nothing(seed: int, use_resources: bool) -> None:
    happened = event_at_random(seed, use_resources=use_resources, size=2)
    if happened is None:
        return
    question = replace(happened.question, promised=())
    plan = solve_replan(question, Rule(), Budget(), 0).plan
    if not replay(question.problem, plan).is_valid:
        return
    for part in parts_of(question, plan):
        trial = without(question, plan, part)
        assert trial is None or value(question, trial) < value(question, plan)


@examples(60)
@given(seed=SEEDS, use_resources=st.booleans())
def test_what_is_not_asked_of_the_referee_could_not_be_worth_enough(
    seed: int, use_resources: bool
) -> None:
    happened = event_at_random(seed, use_resources=use_resources, size=2)
    if happened is None:
        return
    question = replace(happened.question, promised=())
    plan = Rule().solve(question.problem, Budget(), 0).plan
    least = value(question, plan)
    for part in parts_of(question, plan):
        trial = without(question, plan, part)
        asked = without(question, plan, part, least)
        assert asked in (trial, None)
        if trial is not None and asked is None:
            assert value(question, trial) < least
            event("not asked")


def test_a_whole_day_finds_what_moves_near_the_plan_do_not() -> None:
    """One of 60 small plans; in operation most of them (``replanning.days``)."""
    happened = event_at_random(22, use_resources=True, size=6)
    assert happened is not None
    question = replace(happened.question, promised=())
    problem = question.problem
    near = improved(question, first_plan(question, Budget()), Budget(), 0)
    # The rule finds no better plan.
    found = solve_replan(question, Rule(), Budget(), 0).plan
    assert replay(problem, found).is_valid
    assert replay(problem, found).reward > replay(problem, near).reward
    assert value(question, found) > value(question, near)


def test_where_all_is_too_much_a_day_is_replanned_beside_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    num_better = 0
    for seed in range(40):
        whole = random_problem(
            seed, use_resources=True, num_satellites=2, num_targets=30, num_collects=48,
            num_contacts=3, num_stations=1,
        )  # fmt: skip
        monkeypatch.setattr(days, "_MOST_TASKS", len(whole.opportunities) - 1)
        best = Incumbent(whole, Budget(), 0.0, Rule().solve(whole, Budget(), 0).plan)
        if not best.is_valid:
            continue
        found = days.with_days_replanned(best, [1], Budget(), 0)
        timeline = replay(whole, found)
        assert timeline.is_valid
        assert timeline.reward >= best.reward
        first, second = (
            {a.opportunity for a in p.actions if whole.opportunities.satellite[a.opportunity] == 0}
            for p in (best.plan, found)
        )
        assert first == second
        assert days.with_days_replanned(best, [], Budget(), 0) == best.plan
        num_better += timeline.reward > best.reward
    assert num_better > 5


@pytest.mark.parametrize("seed", range(8))
def test_changes_stay_within_their_share_where_they_can(seed: int) -> None:
    free = event_at_random(seed, use_resources=False, size=3)
    assert free is not None
    question = replace(
        free.question, promised=(), stability=Stability(weight=0.0, max_changed_share=0.0)
    )
    plan = solve_replan(question, Certified(), Budget(), 0).plan
    lost = question.num_base - sum(
        not question.problem.pinned.is_frozen(question.problem.opportunities.start_s[row])
        for row in question.base
    )
    assert question.changed(plan) == lost


def test_the_share_of_changes_holds_when_the_time_is_over() -> None:
    num_taken_back = 0
    for seed in range(8):
        free = event_at_random(seed, use_resources=False, size=3)
        assert free is not None
        strict = Stability(weight=0.0, max_changed_share=0.0)
        question = replace(free.question, promised=(), stability=strict)
        plan = Rule().solve(question.problem, Budget(), 0).plan
        stable = within_share(question, plan, Budget(0.0))
        lost = question.num_base - sum(
            not question.problem.pinned.is_frozen(question.problem.opportunities.start_s[row])
            for row in question.base
        )
        assert question.changed(stable) == lost
        num_taken_back += question.changed(plan) - lost
    assert num_taken_back


def test_a_target_worth_more_than_the_changes_is_taken_and_one_worth_less_is_not() -> None:
    def left_by(plan: Plan) -> list[int]:
        imaged = {int(whole.opportunities.site[a.opportunity]) for a in plan.actions}
        return [t for t in range(12) if t not in imaged and len(whole.collects_of(t))]

    for seed in range(50):
        whole = random_problem(
            seed, use_resources=False, num_targets=12, num_collects=14, num_contacts=0
        )
        base = Certified().solve(whole, Budget(), 0).plan
        if left := left_by(base):
            break
    assert left
    rows = np.array(sorted(a.opportunity for a in base.actions), dtype=np.int32)
    for factor, is_taken in ((0.5, False), (50.0, True)):
        worth = np.where(np.isin(whole.opportunities.site, left), factor, whole.worth)
        question = Question(
            problem=replace(whole, worth=worth), base=rows, num_base=len(rows), promised=(),
            stability=Stability(),
        )  # fmt: skip
        plan = solve_replan(question, Certified(), Budget(), 0).plan
        assert bool(set(left) - set(left_by(plan))) == is_taken
        assert (plan == base) == (not is_taken)


def test_a_promise_that_nothing_can_image_is_refused() -> None:
    happened = next(
        found
        for seed in range(50)
        if (found := event_at_random(seed, use_resources=False)) is not None
        and (np.diff(found.question.problem.target_opportunities[1]) == 0).any()
    )
    problem = happened.question.problem
    gone = int(np.flatnonzero(np.diff(problem.target_opportunities[1]) == 0)[0])
    question = replace(happened.question, promised=(gone,))
    with pytest.raises(InvalidScenario) as caught:
        solve_replan(question, Certified(), Budget(), 0)
    assert caught.value.fault.code == "promise_not_kept"
    assert caught.value.fault.pointer == "/replan/promises/0"


@examples(60)
@given(seed=SEEDS)
def test_the_fewest_changes_are_what_brute_force_finds(seed: int) -> None:
    happened = event_at_random(seed, use_resources=True)
    if happened is None:
        return
    question = replace(happened.question, promised=())
    problem = question.problem
    everyone = range(len(problem.satellites))
    found = fewest_changes(question, everyone, Budget())
    is_base = np.zeros(len(problem.opportunities), dtype=np.bool_)
    is_base[question.base] = True
    is_image = problem.opportunities.kind == COLLECT
    counting = replace(problem, worth=np.where(is_base & is_image, 1.0, 0.0))
    best = best_plan(counting)
    if best is None or found is None or not found.is_proven:
        event("not proven")
        return
    timeline = replay(problem, found.plan)
    assert timeline.is_valid
    assert found.num_kept == round(replay(counting, best).reward)
    event(f"shed: {int((is_base & is_image).sum()) - found.num_kept}")


@pytest.mark.parametrize("seed", [31, 75, 110, 140, 162, 176, 185, 196, 223, 317, 351, 368])
def test_where_the_plan_breaks_a_limit_no_plan_counts_more(seed: int) -> None:
    """Earned and kept worth, by brute force; keeping contacts counts nothing here."""
    stability = replace(BETA, contact_weight=0.0)
    happened = event_at_random(seed, use_resources=True, stability=stability)
    assert happened is not None
    question = replace(happened.question, promised=())
    assert question.judged(Plan.of(question.problem, question.base.tolist())).violations
    best = best_plan(question.searched)
    assert best is not None
    plan = solve_replan(question, Certified(), Budget(), 0).plan
    assert value(question, plan) == pytest.approx(value(question, best), abs=1e-6)


@examples(60)
@given(seed=SEEDS, use_resources=st.booleans(), has_multipliers=st.booleans())
def test_the_multipliers_of_the_plan_before_prove_a_bound(
    seed: int, use_resources: bool, has_multipliers: bool
) -> None:
    happened = event_at_random(seed, use_resources=use_resources)
    if happened is None:
        return
    question = replace(happened.question, promised=())
    problem, whole = question.problem, happened.whole
    rng = np.random.default_rng(seed)
    # Any values will do: targets may be unknown, and known values may be far off.
    ids = [name for name in whole.target_ids if rng.random() < 0.7]
    proof = quick_bound(whole, 0.0)
    some = rng.uniform(0.0, 2.0, len(ids))
    if (
        has_multipliers
        and proof.multipliers is not None
        and len(proof.multipliers) == len(whole.target_ids)
    ):
        some = proof.multipliers[[whole.target_ids.index(name) for name in ids]]
    unit = 0.5 if use_resources else None
    known = KnownMultipliers(
        bound=Bound(value=0.0, proof="dp", multipliers=some, unit=unit), target_ids=tuple(ids)
    )
    multipliers = known.on(problem)
    best = best_plan(problem)
    assert multipliers is not None
    if best is None:
        return
    reward = replay(problem, best).reward
    assert bound_at(problem, multipliers, 0.0).value >= reward - 1e-6
    solution = solve_replan(question, Certified(), Budget(), 0, known)
    assert solution.bound is not None
    assert solution.bound >= reward - 1e-6


def test_multipliers_without_multipliers_are_nothing_known() -> None:
    whole = random_problem(0, use_resources=False)
    assert multipliers_of(None, whole.target_ids) is None
    assert multipliers_of(Bound(value=1.0, proof="milp"), whole.target_ids) is None
    of_fewer = KnownMultipliers(
        bound=Bound(value=1.0, proof="lagrangian", multipliers=np.zeros(1)), target_ids=("a", "b")
    )
    assert of_fewer.on(whole) is None


@pytest.mark.parametrize("use_resources", [True, False])
def test_what_comes_in_has_the_multiplier_of_its_like_where_energy_is_short(
    use_resources: bool,
) -> None:
    whole = random_problem(0, use_resources=use_resources, num_targets=9, num_collects=12)
    usual = whole.typical_worth
    is_last = whole.opportunities.site == 8
    dear = replace(
        whole, worth=np.where(is_last & (whole.opportunities.kind == COLLECT), 3 * usual, usual)
    )
    known = KnownMultipliers(
        bound=Bound(
            value=1.0, proof="dp", multipliers=np.array([0.0, 0.1, 0.7]) * usual, unit=usual
        ),
        target_ids=whole.target_ids[:3],
    )
    found = known.on(dear)
    assert found is not None
    assert found.multipliers is not None
    left = np.maximum(0.0, dear.best_worth - 0.5 * dear.typical_worth)
    expected = np.array([0.0, 0.1 * usual, 0.7 * usual, *left[3:]])
    if use_resources:
        expected[3:8] = np.minimum(0.1 * usual, left[3:8])
    assert expected[8] > 2 * usual
    assert found.multipliers == pytest.approx(np.minimum(expected, dear.best_worth))


def test_replans_one_after_the_other_do_not_count_in_ever_smaller_units() -> None:
    """Each with one more target: if the unit halved each time, labels would double each time."""
    whole = random_problem(0, num_targets=9, num_collects=12)
    unit = 1.0
    for number in range(3, 9):
        known = KnownMultipliers(
            bound=Bound(value=1.0, proof="dp", multipliers=np.zeros(number), unit=unit),
            target_ids=whole.target_ids[:number],
        )
        found = known.on(whole)
        assert found is not None
        assert found.unit is not None
        unit = found.unit
    assert unit == 0.5
