"""Pins: all solvers honour them, exact ones optimally; impossible pins are refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import event, example, given
from hypothesis import strategies as st

from planner_core.budget import Budget, Termination
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.lns.queue_plans import plan_with_queues
from planner_core.domain import Agility, Dynamics, Objective
from planner_core.errors import Fault, InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.pinning.limits import _keep_best
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Blocked,
    Kept,
    Pinned,
    Problem,
)
from planner_core.problem.delivery import with_objective
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import (
    Certified,
    ForwardSearch,
    Graph,
    Mcts,
    Milp,
    Rule,
)
from tests.examples import examples
from tests.planner_core.brute_force import best_plan, has_plan
from tests.planner_core.problems import ECLIPSES, TIGHT, Task, make_problem, random_problem

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
HEURISTICS: list[Solver] = [
    Rule(),
    Rule(feasibility="penalty", contact_above_fraction=0.0),
    Graph(),
    Graph(path="longest", feasibility="penalty"),
    ForwardSearch(),
    ForwardSearch(depth=2, breadth=2, feasibility="penalty", unimaged_only=False),
    Mcts(num_simulations=30, depth=8),
    Mcts(num_simulations=20, depth=4, rollout="random", worthless="sunpoint"),
]
EXACT: list[Solver] = [Milp(), Milp(formulation="pairwise"), Certified()]


def pinned_at_random(problem: Problem, seed: int, num_kept: int) -> Pinned:
    """Return pins on rows of the whole table, possible or not."""
    rng = np.random.default_rng(seed)
    table = problem.opportunities
    kept = rng.choice(len(table), size=min(num_kept, len(table)), replace=False)
    start_s = float(rng.uniform(0, 900))
    blocked = Blocked(
        satellite=0,
        start_s=start_s,
        end_s=start_s + float(rng.uniform(10, 200)),
        kinds=[frozenset({COLLECT}), frozenset({CONTACT}), frozenset({COLLECT, CONTACT})][
            rng.integers(3)
        ],
        pointer="/pins/block/0",
    )
    forbidden = frozenset([int(rng.integers(len(problem.target_ids)))] * int(rng.integers(2)))
    return Pinned(
        kept=tuple(Kept(row=int(row), pointer=f"/pins/keep/{i}") for i, row in enumerate(kept)),
        skipped=dict.fromkeys(
            rng.choice(len(table), size=int(rng.integers(2))).tolist(), "/pins/skip/0"
        ),
        blocked=(blocked,) * int(rng.integers(2)),
        forbidden=forbidden,
    )


def pinned_or_refused(whole: Problem, pinned: Pinned) -> tuple[Problem, Fault | None]:
    """Return the problem with its pins, and the fault if they are refused."""
    try:
        return apply_pins(whole, pinned), None
    except InvalidScenario as error:
        return whole, error.fault


def drawn(seed: int, **more: Any) -> Problem:
    rng = np.random.default_rng(seed)
    return random_problem(
        seed,
        has_rewards=bool(rng.integers(2)),
        sunlight=ECLIPSES if rng.integers(2) else None,
        num_contacts=3,
        num_targets=6,
        **more,
    )


@examples(150)
@given(
    seed=SEEDS,
    dynamics=DYNAMICS,
    use_resources=st.booleans(),
    num_satellites=st.integers(1, 2),
    num_kept=st.integers(0, 3),
)
@example(seed=1825, dynamics="physical", use_resources=True, num_satellites=1, num_kept=3)
@example(seed=1825, dynamics="paper", use_resources=True, num_satellites=1, num_kept=3)
def test_plans_with_pins_are_the_best_that_honour_them(
    seed: int, dynamics: Dynamics, use_resources: bool, num_satellites: int, num_kept: int
) -> None:
    """Brute force searches the whole table and knows the pins from the referee alone."""
    whole = drawn(
        seed, dynamics=dynamics, use_resources=use_resources, num_satellites=num_satellites
    )
    pinned = pinned_at_random(whole, seed, num_kept)
    best = best_plan(replace(whole, pinned=pinned))
    problem, fault = pinned_or_refused(whole, pinned)
    if fault is not None:
        # A second image of a target breaks nothing, but no plan has one.
        assert best is None or "another image" in fault.detail
        assert (fault.pointer or "").startswith(("/pins/keep/", "/pins/skip/", "/pins/block/"))
        return
    if best is None:
        # Two satellites may need the same antenna, which only a search can find out.
        assert use_resources
        assert num_satellites > 1 or not has_plan(whole)
        return
    reward = replay(whole, best).reward
    for solver in EXACT:
        solution = solver.solve(problem, Budget(), 0)
        timeline = replay(problem, solution.plan)
        assert timeline.is_valid, (solver, timeline.violations)
        assert timeline.reward == pytest.approx(reward), solver
        assert solution.termination is Termination.OPTIMAL
        assert solution.bound is not None
        assert solution.bound == pytest.approx(reward, abs=1e-4)
    for solver in HEURISTICS:
        timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
        assert timeline.reward <= reward + 1e-9 or not timeline.is_valid
        assert not [v for v in timeline.violations if v.code == "pin"], solver
        if num_satellites == 1 and getattr(solver, "feasibility", "hard") == "hard":
            assert timeline.is_valid, (solver, timeline.violations)


@examples(60)
@given(seed=SEEDS, dynamics=DYNAMICS, num_kept=st.integers(1, 5), use_resources=st.booleans())
def test_crowded_plans_keep_what_is_pinned(
    seed: int, dynamics: Dynamics, num_kept: int, use_resources: bool
) -> None:
    """Also if the budget is spent at once, so that the rule makes the whole plan."""
    whole = random_problem(
        seed, dynamics=dynamics, use_resources=use_resources, num_satellites=2,
        num_targets=20, num_collects=40, num_contacts=8, num_stations=2,
    )  # fmt: skip
    problem, fault = pinned_or_refused(whole, pinned_at_random(whole, seed, num_kept))
    if fault is not None:
        return
    spent = Budget()
    spent.cancel()
    for solver in (*HEURISTICS, Certified()):
        for budget in (Budget(), spent):
            timeline = replay(problem, solver.solve(problem, budget, 0).plan)
            assert not [v for v in timeline.violations if v.code == "pin"], solver


@examples(60)
@given(seed=SEEDS, num_kept=st.integers(1, 2), use_resources=st.booleans())
def test_a_satellite_that_turns_slower_than_it_tracks_honours_pins_too(
    seed: int, num_kept: int, use_resources: bool
) -> None:
    whole = drawn(
        seed,
        use_resources=use_resources,
        agility=Agility(slew_rate_deg_s=0.3),
        max_turn_deg=40.0,
    )
    pinned = pinned_at_random(whole, seed, num_kept)
    problem, fault = pinned_or_refused(whole, pinned)
    if fault is not None:
        return  # kept actions must be able to follow each other directly; brute force ignores that
    best = best_plan(problem)
    if best is None:
        return
    for solver in EXACT:
        timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
        assert timeline.is_valid, (solver, timeline.violations)
        assert timeline.reward == pytest.approx(replay(problem, best).reward)
    for solver in HEURISTICS:
        timeline = replay(problem, solver.solve(problem, Budget(), 0).plan)
        assert not [v for v in timeline.violations if v.code == "pin"], solver


@examples(150)
@given(seed=SEEDS, dynamics=DYNAMICS)
def test_contacts_ruled_out_are_refused_exactly_where_no_plan_is_left(
    seed: int, dynamics: Dynamics
) -> None:
    rng = np.random.default_rng(seed)
    chatty = replace(TIGHT, telemetry_per_s=float(rng.uniform(3e-4, 1.2e-3)))
    whole = random_problem(
        seed, dynamics=dynamics, resources=chatty, num_collects=3, num_contacts=5
    )
    contacts = np.flatnonzero(whole.opportunities.kind == CONTACT)
    names = [f"/pins/skip/{i}" for i in range(3)]
    skipped = dict(zip(rng.choice(contacts, 3, replace=False).tolist(), names, strict=True))
    block = Blocked(
        satellite=0, start_s=600.0, end_s=1000.0, kinds=frozenset({CONTACT}),
        pointer="/pins/block/0",
    )  # fmt: skip
    steps = [
        Pinned(skipped=dict(list(skipped.items())[:number]), blocked=blocked)
        for number, blocked in ((0, ()), (1, ()), (2, ()), (3, ()), (3, (block,)))
    ]
    is_borne = [has_plan(replace(whole, pinned=pinned)) for pinned in steps]
    _, fault = pinned_or_refused(whole, steps[-1])
    event("refused" if fault else "borne" if is_borne[-1] else "hopeless before")
    if all(is_borne) or not is_borne[0]:
        assert fault is None
    else:
        assert fault is not None
        assert fault.code == "pin_breaks_limits"
        assert fault.pointer == [*names, block.pointer][is_borne.index(False) - 1]


@examples(150)
@given(seed=SEEDS, dynamics=DYNAMICS, num_kept=st.integers(0, 3))
def test_pins_are_refused_exactly_where_no_plan_honours_them(
    seed: int, dynamics: Dynamics, num_kept: int
) -> None:
    """Kept actions may exclude a contact without which the recorder overflows."""
    rng = np.random.default_rng(seed)
    chatty = replace(TIGHT, telemetry_per_s=float(rng.uniform(3e-4, 1.2e-3)))
    whole = random_problem(
        seed, dynamics=dynamics, resources=chatty, num_collects=4, num_contacts=4, num_targets=4
    )
    pinned = pinned_at_random(whole, seed, num_kept)
    _, fault = pinned_or_refused(whole, pinned)
    is_borne = has_plan(replace(whole, pinned=pinned))
    event(fault.code if fault else "borne" if is_borne else "hopeless before")
    if fault is None:
        assert is_borne or not has_plan(whole)
    else:
        assert not is_borne or "another image" in fault.detail


def test_states_that_count_as_one_are_no_worse_than_each() -> None:
    rng = np.random.default_rng(3)
    found = rng.uniform(size=(5000, 2))
    found = np.concatenate([found, np.column_stack([found[:, 0], found[:, 0]])])
    battery, recorder = np.full(200, np.nan), np.full(200, np.nan)
    num_states = _keep_best(found.copy(), battery, recorder)
    assert 0 < num_states <= 200
    for left, filled in found:
        assert ((battery[:num_states] >= left) & (recorder[:num_states] <= filled)).any()


def test_two_images_of_a_target_that_must_be_taken_stay() -> None:
    """A scenario file cannot require that, but a problem can."""
    tasks = [
        Task(kind=COLLECT, site=site, start_s=start_s, end_s=start_s + 30.0)
        for site, start_s in ((0, 100.0), (1, 200.0), (0, 300.0), (1, 400.0), (2, 500.0))
    ]
    tasks.append(Task(kind=CONTACT, site=0, start_s=800.0, end_s=900.0))
    roomy = replace(TIGHT, initial_battery_fraction=1.0, initial_recorder_fraction=0.0)
    problem = make_problem(tasks, num_targets=3, resources=roomy)
    twice = tuple(Kept(row=row, pointer=f"/pins/keep/{row}") for row in (0, 2))
    problem = replace(problem, pinned=Pinned(kept=twice))
    stop = np.zeros(1, dtype=np.uint8)
    choices = ChoiceSearch(with_objective(problem, Objective.delivered()), 1.0, 0, stop)
    choices.start(np.zeros(len(tasks), dtype=np.bool_), 0.95)
    ageing = with_objective(problem, Objective(collected_share=0.0, half_life_s=600.0))
    by_queues = plan_with_queues(ageing, np.zeros(3), np.random.default_rng(0), stop, 12)
    assert by_queues is not None
    for plan in (choices.plan, by_queues):
        assert {0, 2} <= {action.opportunity for action in plan.actions}
