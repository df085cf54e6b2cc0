"""Every solver on generated problems: valid, deterministic, never above brute force."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Progress, Termination
from planner_core.domain import Dynamics
from planner_core.mdp.model import WAIT, Model
from planner_core.mdp.resource_columns import take
from planner_core.mdp.track import NO_TASK, compile_track
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import plan_sha256, replay
from planner_core.solvers.base import Solver
from planner_core.solvers.forward_search import NOTHING, select_action
from planner_core.solvers.registry import (
    SOLVERS,
    ForwardSearch,
    Graph,
    Mcts,
    Rule,
)
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
PAPER_MCTS = Mcts(
    num_simulations=50,
    depth=5,
    exploration=3.0,
    breadth=3,
    backup="mean",
    gamma=0.995,
    rollout="random",
    keep_incumbent=False,
    unimaged_only=False,
    contact_reward_per_s=0.1,
)
VARIANTS: list[Solver] = [
    *(cls() for cls in SOLVERS.values() if cls is not Mcts),
    Mcts(num_simulations=30, depth=8),
    ForwardSearch(unimaged_only=False),
    ForwardSearch(depth=5, breadth=2, gamma=0.999),
    ForwardSearch(contact_above_fraction=0.0),
    Mcts(num_simulations=30, depth=8, contact_above_fraction=0.0),
    Rule(contact_above_fraction=0.0),
    Graph(path="longest"),
    Mcts(num_simulations=30, depth=4, backup="mean", discount="per_decision"),
    PAPER_MCTS,
    Rule(unimaged_only=False),
]


def problems(seed: int, dynamics: Dynamics, use_resources: bool, **more: Any) -> Problem:
    return random_problem(seed, dynamics=dynamics, use_resources=use_resources, **more)


@pytest.mark.parametrize("solver", VARIANTS, ids=repr)
@examples(60)
@given(seed=SEEDS, dynamics=DYNAMICS, use_resources=st.booleans(), num_satellites=st.integers(1, 3))
def test_plans_are_valid_and_the_same_every_time(
    solver: Solver, seed: int, dynamics: Dynamics, use_resources: bool, num_satellites: int
) -> None:
    problem = problems(
        seed, dynamics, use_resources, num_satellites=num_satellites,
        num_collects=25, num_targets=12, num_contacts=8,
    )  # fmt: skip
    solution = solver.solve(problem, Budget(), seed=0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations
    assert solution.termination is (
        Termination.OPTIMAL if solver.exact else Termination.HORIZON_COMPLETE
    )
    again = solver.solve(problem, Budget(), seed=0)
    assert plan_sha256(problem, again.plan) == plan_sha256(problem, solution.plan)


@examples(60)
@given(seed=SEEDS, dynamics=DYNAMICS, telemetry_per_s=st.sampled_from([2e-4, 4e-4, 8e-4]))
def test_hard_plans_look_ahead_so_that_telemetry_never_fills_the_recorder(
    seed: int, dynamics: Dynamics, telemetry_per_s: float
) -> None:
    """If contacts alone can keep the limits, every solver's plan keeps them."""
    resources = replace(TIGHT, telemetry_per_s=telemetry_per_s)
    problem = problems(
        seed, dynamics, True, num_collects=25, num_targets=20, num_contacts=8, resources=resources
    )
    contacts_only = Rule(unimaged_only=True)
    no_images = replace(problem, worth=problem.worth * 0)
    for satellite in no_images.satellites:
        track = compile_track(no_images, satellite, (satellite.kind == 0).astype("uint8"))
        if not track.is_guarded:
            return
    for solver in (contacts_only, Rule(contact_above_fraction=0.4), ForwardSearch()):
        assert replay(problem, solver.solve(problem, Budget(), 0).plan).is_valid


@examples(40)
@given(seed=SEEDS, dynamics=DYNAMICS, use_resources=st.booleans(), has_rewards=st.booleans())
def test_nobody_exceeds_brute_force(
    seed: int, dynamics: Dynamics, use_resources: bool, has_rewards: bool
) -> None:
    problem = problems(seed, dynamics, use_resources, has_rewards=has_rewards, num_satellites=2)
    best = best_reward(problem)
    for solver in VARIANTS:
        plan = solver.solve(problem, Budget(), 0).plan
        assert replay(problem, plan).reward <= best + 1e-9


@examples(40)
@given(seed=SEEDS, dynamics=DYNAMICS, use_resources=st.booleans(), has_rewards=st.booleans())
def test_forward_search_at_full_depth_and_breadth_equals_brute_force(
    seed: int, dynamics: Dynamics, use_resources: bool, has_rewards: bool
) -> None:
    problem = problems(seed, dynamics, use_resources, has_rewards=has_rewards, num_collects=6)
    n = len(problem.opportunities)
    solver = ForwardSearch(
        depth=n, breadth=n, gamma=1.0, contact_reward_per_s=0.0, sunpoint_reward_per_s=0.0,
        contact_above_fraction=0.0,
    )  # fmt: skip
    timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
    assert timeline.reward == pytest.approx(best_reward(problem))


@examples(60)
@given(
    seed=SEEDS,
    dynamics=DYNAMICS,
    use_resources=st.booleans(),
    feasibility=st.sampled_from(["hard", "penalty"]),
    unimaged_only=st.booleans(),
    depth=st.integers(1, 4),
    breadth=st.integers(1, 3),
    discount=st.sampled_from(["action", "next_action"]),
    contact_counts=st.sampled_from(["duration", "wait"]),
    image_needs=st.sampled_from(["nothing", "limits", "room"]),
    num_offers=st.integers(1, 3),
    contact_above=st.sampled_from([0.0, 0.25, 0.45]),
)
def test_the_compiled_forward_search_plans_what_the_listing_plans(
    seed: int,
    dynamics: Dynamics,
    use_resources: bool,
    feasibility: Any,
    unimaged_only: bool,
    depth: int,
    breadth: int,
    discount: Any,
    contact_counts: Any,
    image_needs: Any,
    num_offers: int,
    contact_above: float,
) -> None:
    problem = problems(
        seed, dynamics, use_resources, num_collects=14, num_contacts=4, num_offers=num_offers
    )
    solver = ForwardSearch(
        depth=depth, breadth=breadth, feasibility=feasibility, unimaged_only=unimaged_only,
        window_moves_per_task=0.0,
        gamma=0.99, discount=discount, contact_counts=contact_counts, image_needs=image_needs,
        contact_above_fraction=contact_above,
    )  # fmt: skip
    satellite = problem.satellites[0]
    model = Model(
        track=compile_track(problem, satellite, (satellite.rows * 0).astype("uint8")),
        worth=problem.worth,
        guidance=solver.guidance,
        is_hard=feasibility == "hard",
        unimaged_only=unimaged_only,
        contact_above=contact_above,
    )
    state = model.initial_state()
    rows = []
    while (action := select_action(model, state, depth, breadth, discount)[0]) != NOTHING:
        state = model.step(state, action, model.actions(state, breadth)[0]).state
        if action != WAIT:
            rows.append(int(satellite.rows[action]))
    expected = Plan.of(problem, rows)
    assert solver.solve(problem, Budget(), 0).plan == expected


@examples(80)
@given(seed=SEEDS, dynamics=DYNAMICS)
def test_a_step_of_the_model_agrees_with_the_referees_integral(
    seed: int, dynamics: Dynamics
) -> None:
    problem = problems(seed, dynamics, True, num_collects=20, num_targets=20, num_contacts=6)
    plan = Rule().solve(problem, Budget(), 0).plan
    satellite = problem.satellites[0]
    track = compile_track(problem, satellite, (satellite.rows * 0).astype("uint8"))
    judged = [a for a in replay(problem, plan).satellites[0].actions if a.mode != "sunpoint"]
    last, battery, recorder = NO_TASK, track.resources.battery_start, track.resources.recorder_start
    for action, expected in zip(plan.actions, judged, strict=True):
        row = int(problem.local_row[action.opportunity])
        battery, recorder, is_within = take(track.resources, last, row, battery, recorder)
        last = row
        assert is_within
        assert battery == pytest.approx(expected.battery_end, abs=1e-9)
        assert recorder == pytest.approx(expected.recorder_end, abs=1e-9)


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_a_cancelled_budget_answers_at_once_with_a_plan(name: str) -> None:
    problem = random_problem(1, num_collects=25, num_targets=20)
    budget = Budget()
    budget.cancel()
    solution = SOLVERS[name]().solve(problem, budget, 0)
    assert solution.termination is Termination.CANCELLED
    assert replay(problem, solution.plan).is_valid


@pytest.mark.parametrize("use_resources", [True, False])
@pytest.mark.parametrize("solver", [ForwardSearch(), Mcts()], ids=lambda s: s.name)
def test_a_search_that_is_cut_short_is_finished_by_the_rule(
    solver: Solver, use_resources: bool
) -> None:
    problem = random_problem(
        2, num_collects=60, num_targets=50, num_contacts=6, num_satellites=2,
        use_resources=use_resources,
    )  # fmt: skip
    budget = Budget()
    budget.cancel()
    assert solver.solve(problem, budget, 0).plan == Rule().solve(problem, Budget(), 0).plan

    seen: list[float] = []

    def stop_after_three(progress: Progress) -> None:
        seen.append(progress.fraction)
        if len(seen) == 3:
            half_way.cancel()

    half_way = Budget(report=stop_after_three)
    cut = solver.solve(problem, half_way, 0).plan
    whole = solver.solve(problem, Budget(), 0).plan
    assert len(cut.actions) >= len(whole.actions) // 2
    assert replay(problem, cut).is_valid


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_an_empty_problem_has_an_empty_plan(name: str) -> None:
    problem = random_problem(1, num_collects=0, num_contacts=0)
    solution = SOLVERS[name]().solve(problem, Budget(), 0)
    assert solution.plan == Plan()
    assert replay(problem, solution.plan).is_valid


def test_penalty_plans_may_break_limits_and_the_referee_says_so() -> None:
    broken = 0
    for seed in range(20):
        problem = random_problem(seed, num_collects=25, num_targets=25, num_contacts=0)
        solver = ForwardSearch(feasibility="penalty", penalty=0.0)
        timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
        broken += not timeline.is_valid
        assert timeline.reward <= len(timeline.collected)
    assert broken > 0


def test_mcts_follows_its_seed_and_nothing_else() -> None:
    plans = []
    problem = random_problem(5, num_collects=40, num_targets=30, num_contacts=4)
    for seed in (0, 0, 1, 2, 3):
        plans.append(PAPER_MCTS.solve(problem, Budget(), seed).plan)
    assert plans[0] == plans[1]
    assert len(set(plans)) > 1


def test_an_action_without_its_own_reward_loses_images() -> None:
    """Line 14 of Alg. 2 taken literally omits the reward of the first action."""
    literal = replace(PAPER_MCTS, returns="literal", num_simulations=200, window_moves_per_task=0.0)
    whole = replace(literal, returns="with_reward")
    totals = {literal: 0.0, whole: 0.0}
    for seed in range(12):
        problem = random_problem(
            seed, num_collects=60, num_targets=40, use_resources=False, has_rewards=True
        )
        for solver in totals:
            totals[solver] += replay(problem, solver.solve(problem, Budget(), 0).plan).reward
    assert totals[literal] < totals[whole]


def test_mcts_with_many_samples_finds_the_best_plan_of_small_problems() -> None:
    found = missed = 0
    for seed in range(12):
        problem = random_problem(seed, use_resources=False, has_rewards=True)
        solver = Mcts(num_simulations=2000, depth=8, breadth=8, gamma=1.0)
        reward = replay(problem, solver.solve(problem, Budget(), 0).plan).reward
        found += reward == best_reward(problem)
        missed += reward < best_reward(problem)
    assert (found, missed) == (12, 0)
