"""The searches' options: by the paper's text, by the authors' code, and by A(s)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Dynamics
from planner_core.mdp.model import WAIT, Model
from planner_core.mdp.track import Track, compile_track
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.mcts_choices import Rules, expand, step_for
from planner_core.solvers.mcts_tree import empty_tree, new_node
from planner_core.solvers.registry import ForwardSearch, Mcts, Rule
from tests.examples import examples
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem


def rows_of(problem: Problem, solver: Solver) -> list[int]:
    return [a.opportunity for a in solver.solve(problem, Budget(), 0).plan.actions]


def track_of(problem: Problem) -> Track:
    satellite = problem.satellites[0]
    return compile_track(problem, satellite, np.zeros(len(satellite), dtype=np.uint8))


@examples(60)
@given(
    seed=st.integers(0, 10**6),
    dynamics=st.sampled_from(["physical", "paper"]),
    use_resources=st.booleans(),
    is_hard=st.booleans(),
    unimaged_only=st.booleans(),
    breadth=st.integers(1, 5),
    contact_above=st.sampled_from([0.0, 0.3]),
)
def test_the_actions_of_a_state_are_of_different_accesses_in_model_and_tree(
    seed: int,
    dynamics: Dynamics,
    use_resources: bool,
    is_hard: bool,
    unimaged_only: bool,
    breadth: int,
    contact_above: float,
) -> None:
    problem = random_problem(seed, dynamics=dynamics, use_resources=use_resources, num_offers=4)
    track = track_of(problem)
    model = Model(
        track=track, worth=problem.worth, guidance=ForwardSearch().guidance,
        is_hard=is_hard, unimaged_only=unimaged_only, contact_above=contact_above,
    )  # fmt: skip
    state = model.initial_state()
    rules = Rules(
        depth=1, breadth=breadth, exploration=1.0, is_hard=is_hard, unimaged_only=unimaged_only,
        is_per_decision=False, is_literal=False, is_greedy=False, is_max_backup=False,
        contact_above=contact_above,
    )  # fmt: skip
    imaged = np.zeros(len(problem.target_ids), dtype=np.uint8)
    step = step_for(track, rules, model.guidance, problem.worth, imaged, 0)
    while actions := model.actions(state, breadth):
        tasks = [row for row in actions if row != WAIT]
        accesses = problem.opportunities.access[problem.satellites[0].rows[tasks]]
        assert len(set(accesses.tolist())) == len(tasks)
        collected = np.zeros(len(problem.target_ids), dtype=np.uint8)
        collected[list(state.collected)] = 1
        tree = empty_tree(1, breadth + 1)
        new_node(tree, state.cursor, state.last, state.battery, state.recorder)
        expand(tree, step._replace(collected=collected), 0)
        assert tree.action[: tree.num_edges[0]].tolist() == actions
        state = model.step(state, tasks[-1], tasks[0]).state


def test_breadth_counts_targets_and_not_the_collects_that_one_access_offers() -> None:
    """Three offers of a poor target precede a rich one that they exclude."""
    offers = [
        Task(kind=COLLECT, site=0, start_s=100.0 + k, end_s=130.0 + k, access=0) for k in range(3)
    ]
    rich = Task(kind=COLLECT, site=1, start_s=110.0, end_s=140.0)
    problem = make_problem([*offers, rich], num_targets=2, rewards=[1.0, 5.0], use_resources=False)
    for solver in (ForwardSearch(depth=1, breadth=2), Mcts(num_simulations=20, breadth=2)):
        assert replay(problem, solver.solve(problem, Budget(), 0).plan).reward == 5.0


def test_the_codes_rule_collects_until_the_recorder_is_half_full_and_no_further() -> None:
    """The text stops before crossing its limit of half full; the code crosses it once."""
    tasks = [Task(kind=COLLECT, site=i, start_s=100.0 * i, end_s=100.0 * i + 30) for i in range(6)]
    problem = make_problem(tasks, num_targets=6)
    text = Rule(feasibility="penalty")
    assert rows_of(problem, text) == [0, 1]
    assert rows_of(problem, replace(text, thresholds="code")) == [0, 1, 2]
    # The plan model's limits also apply unless they are only a penalty.
    assert rows_of(problem, Rule(thresholds="code")) == [0, 1]


@pytest.mark.parametrize("solver", [ForwardSearch(), Mcts(num_simulations=20, depth=4)])
def test_one_more_task_is_breadth_plus_one(solver: ForwardSearch | Mcts) -> None:
    differs = 0
    for seed in range(10):
        problem = random_problem(seed, num_collects=40, num_targets=30, has_rewards=True)
        stated, wider = replace(solver, breadth=1), replace(solver, breadth=2)
        one_more = rows_of(problem, replace(stated, breadth_counts="one_more"))
        assert one_more == rows_of(problem, wider)
        differs += one_more != rows_of(problem, stated)
    assert differs > 0


def test_the_codes_discount_reaches_to_the_next_action() -> None:
    """A late second image counts less, so that a rich first one beats two.

    Value of 0 then 2: 0.9**10 (1 + x), with x = 0.9**40 to 2's start by the code and 1 by the
    paper, each times 2's own R = 0.9**40 * 50; value of 1, which excludes 2: 0.9**20 * 3.
    """
    tasks = [
        Task(kind=COLLECT, site=0, start_s=10.0, end_s=40.0),
        Task(kind=COLLECT, site=1, start_s=20.0, end_s=50.0, angle_deg=40.0),
        Task(kind=COLLECT, site=2, start_s=50.0, end_s=80.0),
    ]
    problem = make_problem(tasks, num_targets=3, rewards=[1.0, 3.0, 50.0], use_resources=False)
    paper = ForwardSearch(depth=2, breadth=3, gamma=0.9, window_moves_per_task=0.0)
    assert rows_of(problem, paper) == [0, 2]
    assert rows_of(problem, replace(paper, discount="next_action")) == [1]


@pytest.mark.parametrize("worthless", ["take", "sunpoint"])
def test_a_tree_that_is_full_goes_on_by_rollouts(
    monkeypatch: pytest.MonkeyPatch, worthless: Any
) -> None:
    solver = Mcts(num_simulations=200, depth=10, breadth=4, worthless=worthless)
    earned = {10_000_000: 0.0, 100: 0.0, 1: 0.0}
    for most in earned:
        monkeypatch.setattr("planner_core.solvers.mcts.MAX_ACTIONS", most)
        for seed in range(10):
            problem = random_problem(
                seed, num_collects=40, num_targets=30, num_contacts=6, use_resources=seed % 2 == 0
            )
            timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
            assert timeline.is_valid
            earned[most] += timeline.reward
    assert earned[1] > 0.8 * earned[10_000_000]


def test_the_code_sunpoints_rather_than_image_a_target_again() -> None:
    paper = Mcts(
        num_simulations=20, depth=3, rollout="random", unimaged_only=False,
        window_moves_per_task=0.0,
    )  # fmt: skip
    again = {"take": 0, "sunpoint": 0}
    for seed in range(20):
        problem = random_problem(seed, num_collects=30, num_targets=8, use_resources=seed % 2 == 0)
        for worthless in ("take", "sunpoint"):
            rows = rows_of(problem, replace(paper, worthless=worthless))
            table = problem.opportunities
            images = [int(table.site[row]) for row in rows if table.kind[row] == COLLECT]
            again[worthless] += len(images) - len(set(images))
    assert again["take"] > 0
    assert again["sunpoint"] == 0


@pytest.mark.parametrize("make", [ForwardSearch, Mcts], ids=["forward_search", "mcts"])
def test_a_contact_may_count_by_the_wait_for_it(make: Any) -> None:
    """A long contact soon or a short one later, which exclude each other."""
    soon = Task(kind=CONTACT, site=0, start_s=10.0, end_s=310.0)
    late = Task(kind=CONTACT, site=0, start_s=300.0, end_s=360.0)
    problem = make_problem([soon, late], num_targets=0)
    weights = {
        "contact_reward_per_s": 1.0, "sunpoint_reward_per_s": 0.0, "gamma": 1.0, "depth": 2,
        "contact_above_fraction": 0.0,
    }  # fmt: skip
    assert rows_of(problem, make(**weights)) == [0]
    assert rows_of(problem, make(contact_counts="wait", **weights)) == [1]


@pytest.mark.parametrize("make", [ForwardSearch, Mcts], ids=["forward_search", "mcts"])
def test_an_image_may_need_limits_to_count_as_made(make: Any) -> None:
    """The battery is exhausted: by the text the target is still unimaged, and is taken again."""
    flat = replace(TIGHT, initial_battery_fraction=0.31, sunpoint_charge_per_s=0.0)
    tasks = [Task(kind=COLLECT, site=0, start_s=t, end_s=t + 30.0) for t in (100.0, 300.0)]
    problem = make_problem(tasks, num_targets=1, resources=flat)
    soft = {"feasibility": "penalty", "penalty": 0.0, "depth": 2}
    assert rows_of(problem, make(**soft)) == [0]
    assert rows_of(problem, make(image_needs="room", **soft)) == [0]
    assert rows_of(problem, make(image_needs="limits", **soft)) == [0, 1]
