"""The certified solver: the optimum by brute force, true bounds, and proofs that check out."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.certificate import (
    Certificate,
    Cut,
    Multipliers,
    Refutation,
    is_refuted,
)
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.tolerances import SAME
from planner_core.domain import Agility
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution
from planner_core.solvers.registry import Certified, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import Task, make_problem, random_problem, with_rewards
from tests.planner_core.verdicts import certified

SEEDS = st.integers(0, 10**6)
SLOW = Agility(slew_rate_deg_s=0.3)
SETTLING = Agility(settle_s=12.0)
AGILITY = st.sampled_from([Agility(), SLOW, SETTLING])
SPREADS = st.sampled_from(["one", "whole", "tenfold", "odd"])


def with_spread(problem: Problem, seed: int, spread: str) -> Problem:
    """Return the problem with rewards all 1, whole, orders of magnitude apart, or arbitrary."""
    rng = np.random.default_rng(seed)
    n = len(problem.target_ids)
    rewards = {
        "one": np.ones(n),
        "whole": rng.integers(0, 9, n).astype(np.float64),
        "tenfold": 10.0 ** rng.integers(0, 6, n),
        "odd": np.exp(rng.uniform(-7.0, 7.0, n)),
    }[spread]
    return with_rewards(problem, rewards)


def wide_problem(seed: int, *, num_collects: int, num_targets: int, span_s: float) -> Problem:
    """Return a problem too large for brute force."""
    problem = random_problem(
        seed, use_resources=False, num_collects=num_collects, num_targets=num_targets, span_s=span_s
    )
    return replace(problem, horizon_s=span_s + 60.0)


def assert_proven(problem: Problem, solution: Solution, best: float) -> None:
    """Reward <= brute-force optimum <= bound; equal where optimal is claimed; proofs hold."""
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations
    assert solution.bound is not None
    assert solution.proven is not None
    slack = 1e-9 * max(1.0, best)
    assert timeline.reward <= best + slack
    assert solution.bound >= best - slack
    if solution.termination is Termination.OPTIMAL:
        assert timeline.reward >= best * (1.0 - SAME) - slack
    if solution.proven.is_elementary:
        assert is_proven(problem, solution.proven)
    elif solution.proven.certificate is not None:
        assert is_refuted(problem, solution.proven.certificate)
        assert solution.proven.certificate.amount > best
    elif solution.proven.proof == "lagrangian":
        assert is_proven(problem, solution.proven)
    else:
        assert solution.proven.log


@examples(1500)
@given(
    seed=SEEDS, spread=SPREADS, num_satellites=st.integers(1, 3), agility=AGILITY,
    max_turn_deg=st.sampled_from([0.0, 25.0]), num_targets=st.integers(2, 6),
)  # fmt: skip
def test_it_equals_brute_force(
    seed: int,
    spread: str,
    num_satellites: int,
    agility: Agility,
    max_turn_deg: float,
    num_targets: int,
) -> None:
    problem = random_problem(
        seed, use_resources=False, num_satellites=num_satellites, num_collects=11,
        num_targets=num_targets, span_s=400.0, agility=agility, max_turn_deg=max_turn_deg,
    )  # fmt: skip
    problem = with_spread(problem, seed, spread)
    solution = certified(problem, seed)
    assert solution.termination is Termination.OPTIMAL
    assert_proven(problem, solution, best_reward(problem))


@examples(200)
@given(
    seed=SEEDS, spread=SPREADS, num_satellites=st.integers(1, 2), agility=AGILITY,
    max_turn_deg=st.sampled_from([0.0, 25.0]), num_offers=st.integers(2, 4),
)  # fmt: skip
def test_with_a_choice_of_starts_it_equals_brute_force(
    seed: int,
    spread: str,
    num_satellites: int,
    agility: Agility,
    max_turn_deg: float,
    num_offers: int,
) -> None:
    problem = random_problem(
        seed, use_resources=False, num_satellites=num_satellites, num_collects=12 // num_offers,
        num_offers=num_offers, num_targets=4, span_s=250.0, agility=agility,
        max_turn_deg=max_turn_deg,
    )  # fmt: skip
    problem = with_spread(problem, seed, spread)
    solution = certified(problem, seed)
    assert solution.termination is Termination.OPTIMAL
    assert_proven(problem, solution, best_reward(problem))


@examples(500)
@given(
    seed=SEEDS, num_satellites=st.integers(1, 3), agility=AGILITY, has_rewards=st.booleans(),
    max_turn_deg=st.sampled_from([0.0, 25.0]), num_offers=st.sampled_from([1, 1, 3]),
)  # fmt: skip
def test_with_a_worth_of_each_collect_it_equals_brute_force(
    seed: int,
    num_satellites: int,
    agility: Agility,
    has_rewards: bool,
    max_turn_deg: float,
    num_offers: int,
) -> None:
    problem = random_problem(
        seed, use_resources=False, num_satellites=num_satellites, num_collects=11 // num_offers,
        num_offers=num_offers, num_targets=4, span_s=300.0, agility=agility,
        max_turn_deg=max_turn_deg, has_rewards=has_rewards, has_quality=True,
    )  # fmt: skip
    solution = certified(problem, seed)
    assert solution.termination is Termination.OPTIMAL
    assert_proven(problem, solution, best_reward(problem))


@pytest.mark.parametrize("seed", range(3))
def test_crowded_starts_are_planned_within_a_true_bound(seed: int) -> None:
    """Too large to be solved: the bound from multipliers of passes is verified for any plan."""
    problem = random_problem(
        seed, use_resources=False, num_collects=300, num_offers=8, num_targets=150, span_s=5000.0,
        has_rewards=seed == 2,
    )  # fmt: skip
    problem = replace(problem, horizon_s=5200.0)
    solution = Certified(moves_per_task=1.0, gap=0.06).solve(problem, Budget(), seed)
    reward = replay(problem, solution.plan).reward
    assert_proven(problem, solution, reward)
    assert solution.bound is not None
    assert solution.bound - reward <= 0.1 * solution.bound
    again = Certified(moves_per_task=1.0, gap=0.06).solve(problem, Budget(), seed)
    assert (again.plan, again.bound) == (solution.plan, solution.bound)


@examples(60)
@example(seed=1940, spread="odd", num_satellites=2, gap=0.0)  # tasks struck out were forgotten
@given(
    seed=SEEDS, spread=SPREADS, num_satellites=st.integers(1, 2), gap=st.sampled_from([0.0, 0.05])
)
def test_crowded_problems_are_proven_and_the_proof_checks_out(
    seed: int, spread: str, num_satellites: int, gap: float
) -> None:
    """Too large for brute force: the proof is checked instead, by code that does not search."""
    problem = random_problem(
        seed, use_resources=False, num_satellites=num_satellites, num_collects=120,
        num_targets=30,
    )  # fmt: skip
    problem = with_spread(problem, seed, spread)
    solution = Certified(gap=gap).solve(problem, Budget(), seed)
    reward = replay(problem, solution.plan).reward
    assert solution.bound is not None
    assert solution.bound - reward <= max(gap, SAME) * solution.bound + 1e-9
    assert solution.termination in {Termination.OPTIMAL, Termination.GAP_REACHED}
    assert_proven(problem, solution, reward)


@examples(40)
@given(seed=SEEDS, agility=AGILITY)
def test_a_certificate_that_claims_less_than_a_plan_earns_is_never_sound(
    seed: int, agility: Agility
) -> None:
    """Random multipliers and cuts of true sets: no such certificate refutes the optimum."""
    problem = random_problem(
        seed, use_resources=False, num_collects=10, num_targets=4, span_s=300.0,
        agility=agility, max_turn_deg=25.0,
    )  # fmt: skip
    best = best_reward(problem)
    rng = np.random.default_rng(seed)
    proven = Certified().solve(problem, Budget(), 0).proven
    proof = proven.certificate if proven else None
    cuts = [c for step in proof.refutation.steps for c in step.cuts] if proof else []
    rows = [problem.collects_of(target) for target in range(4)]
    cuts += [Cut(sets=(row,)) for row in rows if len(row)]
    steps = tuple(
        Multipliers(
            of_targets=rng.uniform(0.0, 1.2, 4),
            cuts=tuple(cuts),
            of_cuts=tuple(rng.uniform(0.0, 0.8, len(cuts))),
        )
        for _ in range(4)
    )
    branch = (0, Refutation(steps=steps), Refutation(steps=steps))
    for amount in (best, best - 0.5):
        certificate = Certificate(amount=amount, refutation=Refutation(steps=steps, branch=branch))
        assert not is_refuted(problem, certificate)


def test_sets_that_a_plan_may_take_two_of_prove_nothing() -> None:
    tasks = [Task(kind=COLLECT, site=i, start_s=200.0 * i, end_s=200.0 * i + 30) for i in range(2)]
    problem = make_problem(tasks, num_targets=2, use_resources=False)
    wrong = Multipliers(
        of_targets=np.zeros(2), cuts=(Cut(sets=(np.array([0, 1]),)),), of_cuts=(1.0,)
    )
    certificate = Certificate(amount=2.0, refutation=Refutation(steps=(wrong,)))
    assert not is_refuted(problem, certificate)


def _either_or() -> Problem:
    """Return two targets of which a plan can image one: their collects overlap."""
    tasks = [Task(kind=COLLECT, site=i, start_s=10.0 * i, end_s=10.0 * i + 30) for i in range(2)]
    return make_problem(tasks, num_targets=2, use_resources=False)


def _refutes(amount: float, *steps: Multipliers, problem: Problem | None = None) -> bool:
    certificate = Certificate(amount=amount, refutation=Refutation(steps=steps))
    return is_refuted(problem or _either_or(), certificate)


def test_a_certificate_proves_what_is_above_its_bound_and_not_what_a_plan_earns() -> None:
    free = Multipliers(of_targets=np.zeros(2))
    assert _refutes(1.00001, free)
    assert not _refutes(1.0, free)
    # Closer than the sums are exact, nothing is proven.
    assert not _refutes(1.0 + 1e-10, free)
    assert not _refutes(1.00001), "no multipliers, no proof"
    # With these multipliers the targets keep all worth: the bound is 2.
    assert not _refutes(1.5, Multipliers(of_targets=np.ones(2)))


def test_multipliers_below_zero_prove_nothing() -> None:
    apart = [Task(kind=COLLECT, site=i, start_s=200.0 * i, end_s=200.0 * i + 30) for i in range(2)]
    problem = make_problem(apart, num_targets=2, use_resources=False)
    assert not _refutes(1.5, Multipliers(of_targets=np.array([-5.0, 0.0])), problem=problem)
    cut = Cut(sets=(np.array([0]),))
    below = Multipliers(of_targets=np.ones(2), cuts=(cut,), of_cuts=(-1.0,))
    assert not _refutes(1.5, below, problem=problem)
    assert _refutes(2.5, Multipliers(of_targets=np.ones(2)), problem=problem)


def test_a_cut_of_three_sets_takes_one_of_what_lies_in_two_of_them() -> None:
    three = Cut(sets=(np.array([0, 1, 3]), np.array([1, 2]), np.array([0, 2])))
    rows, weights = three.weights()
    assert (three.limit, rows.tolist(), weights.tolist()) == (1, [0, 1, 2], [1, 1, 1])
    assert Cut(sets=three.sets + (np.array([3, 4]),) * 2).limit == 2
    single = Cut(sets=(np.array([4, 7]),))
    rows, weights = single.weights()
    assert (single.limit, rows.tolist(), weights.tolist()) == (1, [4, 7], [1, 1])


@pytest.mark.parametrize("sets", [[[0, 1], [0, 1]], [[0, 0]]], ids=["even", "twice"])
def test_cuts_of_an_even_number_of_sets_or_of_one_task_twice_prove_nothing(
    sets: list[list[int]],
) -> None:
    cut = Cut(sets=tuple(np.array(rows) for rows in sets))
    assert not _refutes(1.5, Multipliers(of_targets=np.zeros(2), cuts=(cut,), of_cuts=(0.0,)))
    sound = Cut(sets=(np.array([0, 1]),))
    assert _refutes(1.5, Multipliers(of_targets=np.zeros(2), cuts=(sound,), of_cuts=(0.5,)))


def test_a_contact_excludes_what_it_overlaps() -> None:
    """Contacts were no part of cuts to the check, though cliques of fleets' programs hold some."""
    tasks = [Task(kind=COLLECT, site=i, start_s=10.0 * i, end_s=10.0 * i + 30) for i in range(2)]
    tasks.append(Task(kind=CONTACT, site=1, start_s=5.0, end_s=100.0))
    tasks.append(Task(kind=CONTACT, site=1, start_s=200.0, end_s=300.0))
    problem = make_problem(tasks, num_targets=2, num_stations=2)
    for clique, is_sound in (([0, 1, 2], True), ([0, 1, 2, 3], False)):
        cut = Cut(sets=(np.array(clique),))
        step = Multipliers(of_targets=np.zeros(2), cuts=(cut,), of_cuts=(0.5,))
        assert _refutes(1.5, step, problem=problem) == is_sound
    same_number = Cut(sets=(np.array([1, 3]),))
    step = Multipliers(of_targets=np.zeros(2), cuts=(same_number,), of_cuts=(0.0,))
    assert not _refutes(5.0, step, problem=problem), "a station may be contacted twice"


def test_a_branch_needs_both_of_its_sides() -> None:
    free = Multipliers(of_targets=np.zeros(2))
    done, open_ = Refutation(steps=(free,)), Refutation(steps=())
    for taken, leaving in ((done, done), (done, open_), (open_, done)):
        refutation = Refutation(steps=(), branch=(0, taken, leaving))
        certificate = Certificate(amount=1.5, refutation=refutation)
        assert is_refuted(_either_or(), certificate) == (open_ not in (taken, leaving))


def test_a_branch_takes_its_task_and_leaves_what_that_excludes() -> None:
    free = Refutation(steps=(Multipliers(of_targets=np.zeros(2)),))
    certificate = Certificate(amount=1.5, refutation=Refutation(steps=(), branch=(0, free, free)))
    apart = [Task(kind=COLLECT, site=i, start_s=200.0 * i, end_s=200.0 * i + 30) for i in range(2)]
    problem = make_problem(apart, num_targets=2, use_resources=False)
    assert not is_refuted(problem, certificate), "a plan takes both"
    rivals = [Task(kind=COLLECT, site=0, start_s=0.0, end_s=30.0, satellite=i) for i in range(2)]
    problem = make_problem(rivals, num_targets=2, num_satellites=2, use_resources=False)
    assert not is_refuted(problem, Certificate(amount=1.5, refutation=free))
    assert is_refuted(problem, certificate)
    either = Cut(sets=(np.array([0, 1]),))
    priced = Multipliers(of_targets=np.zeros(2), cuts=(either,), of_cuts=(1.0,))
    assert _refutes(1.5, priced, problem=problem), "a cut says the same as the branch"


def test_both_plan_and_bound_are_reported_and_close_in() -> None:
    problem = wide_problem(5, num_collects=400, num_targets=150, span_s=20_000.0)
    seen: list[Progress] = []
    solution = Certified().solve(problem, Budget(report=seen.append), 0)
    rewards = [p.reward for p in seen if p.reward is not None]
    bounds = [p.bound for p in seen if p.bound is not None]
    assert len(rewards) == len(bounds) == len(seen) > 0
    assert rewards == sorted(rewards)
    assert bounds == sorted(bounds, reverse=True)
    assert solution.bound is not None
    assert bounds[-1] >= solution.bound


@pytest.mark.parametrize("is_cancelled", [True, False])
def test_a_spent_budget_keeps_plan_and_bound(is_cancelled: bool) -> None:
    problem = wide_problem(5, num_collects=400, num_targets=150, span_s=8_000.0)
    budget = Budget(None if is_cancelled else 0.0)
    if is_cancelled:
        budget.cancel()
    solution = Certified().solve(problem, budget, 0)
    timeline = replay(problem, solution.plan)
    rule = replay(problem, Rule().solve(problem, Budget(), 0).plan).reward
    assert timeline.is_valid
    assert timeline.reward >= rule
    assert solution.termination in {Termination.CANCELLED, Termination.TIME_LIMIT}
    assert_proven(problem, solution, timeline.reward)


def test_cancelling_from_another_thread_ends_it() -> None:
    problem = wide_problem(7, num_collects=3000, num_targets=900, span_s=60_000.0)
    budget = Budget()
    timer = threading.Timer(0.5, budget.cancel)
    timer.start()
    solution = Certified().solve(problem, budget, 0)
    timer.cancel()
    assert_proven(problem, solution, replay(problem, solution.plan).reward)


def test_the_same_seed_gives_the_same_plan_and_bound() -> None:
    problem = wide_problem(11, num_collects=300, num_targets=100, span_s=15_000.0)
    first, again = (Certified().solve(problem, Budget(), 3) for _ in range(2))
    assert first.plan == again.plan
    assert first.bound == again.bound


@pytest.mark.parametrize("num_collects", [0, 1])
def test_problems_without_a_choice(num_collects: int) -> None:
    problem = random_problem(0, use_resources=False, num_collects=num_collects)
    solution = Certified().solve(problem, Budget(), 0)
    assert solution.bound == float(num_collects)
    assert solution.termination is Termination.OPTIMAL


def test_a_proof_survives_being_written_down() -> None:
    problem = random_problem(3, use_resources=False, num_collects=120, num_targets=30)
    solution = Certified().solve(problem, Budget(), 0)
    assert solution.bound is not None
    assert solution.proven is not None
    assert solution.proven.certificate is not None
    bound = Bound(value=solution.bound, proof="lagrangian", certificate=solution.proven.certificate)
    again = from_json(to_json(bound))
    assert again.value == bound.value
    assert is_proven(problem, again)
    assert not is_proven(problem, replace(again, value=again.value - 1.0))
