"""A(s): the feasible actions match their definition, however fast they are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.domain import Dynamics
from planner_core.mdp.actions import next_action
from planner_core.mdp.resource_columns import take
from planner_core.mdp.track import Track, compile_track, is_safe
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Kept,
    Pinned,
    Problem,
    may_follow,
)
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.mcts_choices import Rules, expand, greedy_action, step_for
from planner_core.solvers.mcts_tree import empty_tree, new_node
from planner_core.solvers.registry import (
    ForwardSearch,
    Graph,
    Mcts,
    Rule,
)
from planner_core.solvers.walk import naive_select_action
from tests.examples import examples
from tests.planner_core.problems import ECLIPSES, TIGHT, Task, make_problem, random_problem

SEEDS = st.integers(0, 10**6)
GUIDANCE = ForwardSearch().guidance


def follows(track: Track, a: int, b: int) -> bool:
    return may_follow(track.transitions, a, b)


def may_pass(problem: Problem, track: Track, row: int, recorder: float) -> bool:
    """Return whether the recorder has room for what is written until the next usable contact."""
    satellite, m = problem.satellites[0], len(track.start_s)
    r = satellite.resources
    later = [b for b in range(row + 1, m) if track.is_contact[b] and not track.blocked[b]]
    wait_s = (track.start_s[later[0]] if later else problem.horizon_s) - track.start_s[row]
    access = problem.opportunities.access[satellite.rows]
    offered_s = sum(
        track.end_s[b] - track.start_s[b]
        for b in range(row, later[0] if later else m)
        if not track.is_contact[b] and access[b] not in access[:b]
    )
    duty = r.sunpoint_charge_per_s / (r.sunpoint_charge_per_s + r.collect_drain_per_s)
    image_s = min((track.end_s - track.start_s)[track.is_contact == 0])
    written_s = max(image_s, min(offered_s, duty * wait_s))
    written = r.collect_fill_per_s * written_s + r.telemetry_per_s * wait_s
    return bool(recorder + written < r.recorder_max_fraction)


@examples(200)
@given(
    seed=SEEDS,
    dynamics=st.sampled_from(["physical", "paper"]),
    use_resources=st.booleans(),
    is_hard=st.booleans(),
    unimaged_only=st.booleans(),
    contact_above=st.sampled_from([0.0, 0.2, 0.45]),
    num_kept=st.integers(0, 2),
)
def test_the_next_action_is_the_first_that_the_definition_allows(
    seed: int,
    dynamics: Dynamics,
    use_resources: bool,
    is_hard: bool,
    unimaged_only: bool,
    contact_above: float,
    num_kept: int,
) -> None:
    rng = np.random.default_rng(seed)
    problem = random_problem(
        seed, dynamics=dynamics, use_resources=use_resources, num_offers=3, num_contacts=4,
        sunlight=ECLIPSES if rng.integers(2) else None,
    )  # fmt: skip
    m = len(problem.opportunities)
    must = sorted(rng.choice(m, num_kept, replace=False).tolist())
    kept = tuple(Kept(row=row, pointer="") for row in must)
    problem = replace(problem, pinned=Pinned(kept=kept))
    blocked = (rng.random(m) < 0.1).astype(np.uint8)
    blocked[must] = 0
    track = compile_track(problem, problem.satellites[0], blocked)
    collected = (rng.random(len(problem.target_ids)) < 0.3).astype(np.uint8)
    last = int(rng.integers(-1, m))
    cursor = int(rng.integers(last, m))
    battery, recorder = float(rng.uniform(0.25, 1.0)), float(rng.uniform(0.0, 0.55))
    next_must = next((row for row in must if row > last), m)

    def allows(row: int) -> bool:
        if not follows(track, last, row):
            return False
        if row != next_must:
            is_contact = bool(track.is_contact[row])
            if track.blocked[row] or (next_must < m and not follows(track, row, next_must)):
                return False
            if unimaged_only and not is_contact and collected[track.site[row]]:
                return False
            if use_resources and is_contact and recorder < contact_above:
                is_spare = may_pass(problem, track, row, recorder)
                can_pass = not track.is_guarded or is_safe(track, last, row, battery, recorder)
                if is_spare and can_pass:
                    return False
        if use_resources and is_hard and (row != next_must or track.is_guarded):
            battery_after, recorder_after, is_within = take(
                track.resources, last, row, battery, recorder
            )
            if not is_within:
                return False
            return not track.is_guarded or is_safe(track, row, row, battery_after, recorder_after)
        return True

    expected = next((b for b in range(cursor + 1, min(m, next_must + 1)) if allows(b)), m)
    found = next_action(
        track, last, cursor + 1, battery, recorder, is_hard, collected, unimaged_only, contact_above
    )
    assert found == expected


@examples(60)
@given(seed=SEEDS, breadth=st.integers(1, 30), unimaged_only=st.booleans())
def test_what_may_follow_a_task_is_the_same_when_it_is_remembered(
    seed: int, breadth: int, unimaged_only: bool
) -> None:
    problem = random_problem(
        seed, num_collects=30, num_targets=15, num_offers=2, use_resources=False
    )
    satellite = problem.satellites[0]
    m = len(satellite)
    track = compile_track(problem, satellite, np.zeros(m, dtype=np.uint8))
    rng = np.random.default_rng(seed)
    rules = Rules(
        depth=1, breadth=breadth, exploration=1.0, is_hard=True, unimaged_only=unimaged_only,
        is_per_decision=False, is_literal=False, is_greedy=True, is_max_backup=True,
        contact_above=0.0,
    )  # fmt: skip
    nothing = np.zeros(len(problem.target_ids), dtype=np.uint8)
    remembered = step_for(track, rules, GUIDANCE, problem.worth[satellite.rows], nothing, 0)
    successors = remembered.successors
    for _ in range(40):
        # The plan takes targets now and then; a simulation takes some more of them.
        successors.imaged[rng.integers(len(successors.imaged))] = 1
        collected = successors.imaged | (rng.random(len(successors.imaged)) < 0.3)
        last = int(rng.integers(-1, m // 2))
        cursor = last if rng.integers(4) else int(rng.integers(last, m))
        step = remembered._replace(collected=collected)
        row, discount = greedy_action(step, cursor, last, 0.0, 0.0)
        assert row == naive_select_action(track, collected, True, True, 0.0, cursor, last, 0.0, 0.0)
        if discount != 0.0:
            since_s = track.start_s[last] if last >= 0 else 0.0
            assert discount == pytest.approx(GUIDANCE.gamma ** (track.start_s[row] - since_s))
        tree = empty_tree(1, breadth + 1)
        new_node(tree, cursor, last, 0.0, 0.0)
        expand(tree, step, 0)
        expected: list[int] = []
        seen: set[int] = set()
        for b in range(cursor + 1, m):
            is_open = not (unimaged_only and collected[track.site[b]])
            access = int(problem.opportunities.access[b])
            if is_open and access not in seen and follows(track, last, b):
                seen.add(access)
                expected.append(b)
        assert tree.action[: tree.num_edges[0]].tolist() == expected[:breadth]


CONTACT_SOLVERS: list[Solver] = [
    Rule(), Graph(), ForwardSearch(contact_reward_per_s=1.0),
    Mcts(num_simulations=50, depth=6, contact_reward_per_s=1.0),
]  # fmt: skip


@pytest.mark.parametrize("solver", CONTACT_SOLVERS, ids=lambda s: s.name)
def test_a_contact_passes_while_the_recorder_has_room_until_the_next(solver: Solver) -> None:
    """The first contact conflicts with an image; the second one comes early enough."""
    tasks = [
        Task(kind=CONTACT, site=0, start_s=90.0, end_s=150.0),
        Task(kind=COLLECT, site=0, start_s=100.0, end_s=130.0),
        Task(kind=CONTACT, site=0, start_s=200.0, end_s=260.0),
    ]
    problem = make_problem(tasks, num_targets=1)
    patient = replace(solver, contact_above_fraction=0.45)  # type: ignore[type-var]
    eager = replace(solver, contact_above_fraction=0.0)  # type: ignore[type-var]
    assert replay(problem, patient.solve(problem, Budget(), 0).plan).reward == 1.0
    assert replay(problem, eager.solve(problem, Budget(), 0).plan).reward == 0.0


@pytest.mark.parametrize("solver", CONTACT_SOLVERS, ids=lambda s: s.name)
def test_the_last_contact_before_many_images_is_taken(solver: Solver) -> None:
    """Without it the recorder holds only two of the three: 20 % full, 15 % each, limit 50 %."""
    strong = replace(
        TIGHT, initial_recorder_fraction=0.2, collect_drain_per_s=1e-6, telemetry_per_s=0.0
    )
    contact = Task(kind=CONTACT, site=0, start_s=20.0, end_s=80.0)
    images = [
        Task(kind=COLLECT, site=i, start_s=100.0 + 200.0 * i, end_s=130.0 + 200.0 * i)
        for i in range(3)
    ]
    problem = make_problem([contact, *images], num_targets=3, resources=strong)
    solver = replace(solver, contact_above_fraction=0.45)  # type: ignore[type-var]
    plan = solver.solve(problem, Budget(), 0).plan
    assert replay(problem, plan).reward == 3.0
    # For a single image the contact is not needed.
    fewer = make_problem([contact, *images[:1]], num_targets=1, resources=strong)
    assert len(solver.solve(fewer, Budget(), 0).plan.actions) == 1
