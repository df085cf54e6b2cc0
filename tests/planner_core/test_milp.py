"""The MILP: the brute-force optimum in every setting, and true bounds throughout."""

from __future__ import annotations

import os
import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Progress, Termination
from planner_core.certified.mip.highs import Engine, Outcome
from planner_core.certified.mip.whole_relaxation import whole_relaxation
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.program.model import plan_program
from planner_core.certified.proofs.documents import is_proven
from planner_core.certified.strategies import whole_program
from planner_core.certified.strategies.whole_program import WholeProgram
from planner_core.domain import Agility, Dynamics, Objective
from planner_core.precedence.relation import is_transitive
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Problem,
    Sunlight,
)
from planner_core.problem.delivery import with_objective
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Milp
from planner_core.solvers.rule import Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.budgets import bounds_told, expiring
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem, varied_problem
from tests.planner_core.test_delivery import ROOMY, contact
from tests.planner_core.test_delivery import collect as images

SEEDS = st.integers(0, 10**6)
DYNAMICS = st.sampled_from(["physical", "paper"])
FORMULATIONS = st.sampled_from(["antichain", "pairwise"])
SLOW = Agility(slew_rate_deg_s=0.3)


def assert_equals_brute_force(problem: Problem, formulation: Any) -> None:
    best = best_reward(problem)
    solution = Milp(formulation=formulation).solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations
    assert timeline.reward == pytest.approx(best)
    assert solution.bound is not None
    assert solution.proven is not None
    assert solution.bound == pytest.approx(best, abs=1e-4)
    assert solution.bound >= best - 1e-9
    # Multipliers may suffice; then they are the proof.
    if problem.use_resources or formulation == "pairwise":
        assert solution.proven.proof == "milp"
    assert is_proven(problem, solution.proven) is not False
    assert solution.termination is Termination.OPTIMAL


@examples(50)
@given(
    seed=SEEDS,
    dynamics=DYNAMICS,
    use_resources=st.booleans(),
    has_rewards=st.booleans(),
    num_satellites=st.integers(1, 3),
    formulation=FORMULATIONS,
)
def test_it_equals_brute_force(
    seed: int,
    dynamics: Dynamics,
    use_resources: bool,
    has_rewards: bool,
    num_satellites: int,
    formulation: str,
) -> None:
    problem = random_problem(
        seed, dynamics=dynamics, use_resources=use_resources, has_rewards=has_rewards,
        num_satellites=num_satellites, num_contacts=3, span_s=600.0,
    )  # fmt: skip
    assert_equals_brute_force(problem, formulation)


@examples(30)
@given(seed=SEEDS, dynamics=DYNAMICS, telemetry_per_s=st.sampled_from([0.0, 3e-4, 8e-4]))
def test_tight_resources_and_the_eclipse_are_exact(
    seed: int, dynamics: Dynamics, telemetry_per_s: float
) -> None:
    """Little energy, a filling recorder, contacts that overlap tasks, partly in eclipse."""
    resources = replace(
        TIGHT, initial_battery_fraction=0.55, telemetry_per_s=telemetry_per_s, eclipse_aware=True,
        sunpoint_charge_per_s=1 / 900, initial_recorder_fraction=0.3,
    )  # fmt: skip
    sunlight = Sunlight(enter_s=np.array([0.0, 610.0]), exit_s=np.array([205.0, 830.0]))
    problem = random_problem(
        seed, dynamics=dynamics, resources=resources, num_contacts=4, num_collects=7,
        num_stations=2, sunlight=sunlight,
    )  # fmt: skip
    if best_reward(problem) == 0.0:
        return
    assert_equals_brute_force(problem, "antichain")


@examples(30)
@given(
    seed=SEEDS,
    use_resources=st.booleans(),
    has_rewards=st.booleans(),
    formulation=FORMULATIONS,
    max_turn_deg=st.sampled_from([0.0, 25.0]),
)
def test_a_satellite_that_turns_more_slowly_than_it_tracks_is_exact(
    seed: int, use_resources: bool, has_rewards: bool, formulation: str, max_turn_deg: float
) -> None:
    problem = random_problem(
        seed, use_resources=use_resources, has_rewards=has_rewards, agility=SLOW,
        max_turn_deg=max_turn_deg, num_targets=4, num_contacts=1,
    )  # fmt: skip
    assert_equals_brute_force(problem, formulation)


@examples(40)
@given(seed=SEEDS, dynamics=DYNAMICS, num_satellites=st.integers(1, 2), has_quality=st.booleans())
def test_no_plan_beats_the_relaxation(
    seed: int, dynamics: Dynamics, num_satellites: int, has_quality: bool
) -> None:
    problem = varied_problem(seed, dynamics, num_satellites, scarce=TIGHT, has_quality=has_quality)
    best = best_reward(problem)
    bound = whole_relaxation(problem, Budget(), 0).bound
    assert best - 1e-6 <= bound.value < np.inf
    assert not problem.has_better_images or has_quality


def test_a_target_already_collected_may_be_the_way_to_another() -> None:
    """Only a second image of t0 gets from t0 to t1, as the satellite turns during it."""
    tasks = [
        Task(kind=COLLECT, site=0, start_s=0.0, end_s=30.0),
        Task(kind=COLLECT, site=0, start_s=40.0, end_s=70.0, turn_deg=50.0),
        Task(kind=COLLECT, site=1, start_s=75.0, end_s=105.0, angle_deg=50.0),
        Task(kind=COLLECT, site=2, start_s=0.5, end_s=31.0, angle_deg=3.0),
    ]
    problem = make_problem(tasks, num_targets=3, use_resources=False, agility=SLOW)
    assert not is_transitive(problem)
    solution = Milp().solve(problem, Budget(), 0)
    assert replay(problem, solution.plan).reward == best_reward(problem) == 2.0


def test_two_satellites_share_a_station_up_to_its_antennas() -> None:
    """Both must downlink over the one station at the same time."""
    tasks = []
    for satellite in (0, 1):
        tasks += [
            Task(kind=CONTACT, site=0, satellite=satellite, start_s=300.0, end_s=400.0),
            *(
                Task(kind=COLLECT, site=3 * satellite + i, satellite=satellite,
                     start_s=start_s, end_s=start_s + 30.0)
                for i, start_s in enumerate((100.0, 200.0, 600.0))
            ),
        ]  # fmt: skip
    for antennas, best in ((1, 5.0), (2, 6.0)):
        problem = make_problem(tasks, num_targets=6, num_satellites=2, antennas=antennas)
        assert best_reward(problem) == best
        assert_equals_brute_force(problem, "antichain")


@examples(30)
@given(seed=SEEDS, dynamics=DYNAMICS, use_resources=st.booleans())
def test_however_early_it_stops_the_plan_is_valid_and_the_bound_true(
    seed: int, dynamics: Dynamics, use_resources: bool
) -> None:
    problem = random_problem(seed, dynamics=dynamics, use_resources=use_resources)
    best = best_reward(problem)
    for time_s in (0.0, 0.002, 0.01):
        solution = Milp().solve(problem, Budget(time_s), 0)
        assert replay(problem, solution.plan).is_valid
        assert solution.bound is None or solution.bound >= best - 1e-9
        assert solution.termination in (Termination.OPTIMAL, Termination.TIME_LIMIT)
        if solution.termination is Termination.OPTIMAL:
            assert replay(problem, solution.plan).reward == pytest.approx(best)


def test_a_plan_that_touches_a_limit_is_not_taken() -> None:
    """Two images fill the recorder exactly to its limit: the bound may count both, no plan may."""
    resources = replace(
        TIGHT, initial_recorder_fraction=0.0, collect_fill_per_s=0.25 / 30, telemetry_per_s=0.0,
        recorder_max_fraction=0.5, initial_battery_fraction=1.0,
    )  # fmt: skip
    tasks = [
        Task(kind=COLLECT, site=i, start_s=100.0 * i, end_s=100.0 * i + 30.0) for i in range(3)
    ]
    problem = make_problem(tasks, num_targets=3, resources=resources)
    solution = Milp().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert timeline.reward == best_reward(problem) == 1.0
    assert solution.bound == 2.0
    assert solution.termination is Termination.HORIZON_COMPLETE


def test_where_nothing_keeps_the_limits_nothing_is_claimed() -> None:
    resources = replace(TIGHT, initial_recorder_fraction=0.49, telemetry_per_s=1e-3)
    problem = random_problem(3, resources=resources, num_contacts=0)
    solution = Milp().solve(problem, Budget(), 0)
    assert solution.bound is None
    assert solution.termination is Termination.HORIZON_COMPLETE


def crowded(seed: int) -> Problem:
    return random_problem(
        seed, num_collects=1500, num_targets=500, num_contacts=40, num_satellites=4,
        has_rewards=True, resources=replace(TIGHT, collect_drain_per_s=1 / 900),
    )  # fmt: skip


def is_bounded(progress: Progress) -> bool:
    """Return whether HiGHS has begun: no bound is reported before."""
    return progress.bound is not None


def test_cancelling_ends_a_search_without_any_other_limit() -> None:
    is_searching = threading.Event()
    budget = Budget(report=lambda progress: is_searching.set() if is_bounded(progress) else None)

    def cancel() -> None:
        is_searching.wait()
        budget.cancel()

    problem = crowded(1)
    thread = threading.Thread(target=cancel)
    thread.start()
    solution = Milp().solve(problem, budget, 0)
    thread.join()
    assert solution.termination is Termination.CANCELLED
    assert replay(problem, solution.plan).is_valid


def highs_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "highs"]


@pytest.mark.parametrize("num_questions", [1, 200])
def test_an_answer_does_not_wait_for_highs(
    monkeypatch: pytest.MonkeyPatch, num_questions: int
) -> None:
    """HiGHS is blocked in its callback: the best result so far is returned."""
    for thread in highs_threads():  # of earlier tests: they would check this test's budget
        thread.join()
    budget, may_go_on = Budget(), threading.Event()
    asked = 0

    def hold(engine: Engine, event: Any) -> None:
        nonlocal asked
        asked += 1
        if asked >= num_questions:
            budget.cancel()
            may_go_on.wait()
            event.interrupt()

    monkeypatch.setattr(Engine, "_interrupt_if_spent", hold)
    problem = crowded(1)
    try:
        solution = Milp().solve(problem, budget, 0)
        assert highs_threads()
    finally:
        may_go_on.set()
        for thread in highs_threads():
            thread.join()
    timeline = replay(problem, solution.plan)
    assert solution.termination is Termination.CANCELLED
    assert timeline.is_valid
    assert timeline.reward > 0.0
    assert solution.bound is None or solution.bound >= timeline.reward


def test_incumbents_and_bounds_are_reported_while_it_searches() -> None:
    reports: list[Progress] = []
    enough = bounds_told(2)

    def look_at(progress: Progress) -> bool:
        reports.append(progress)
        return enough(progress)

    solution = Milp().solve(crowded(1), expiring(look_at), 0)
    live = [(r.reward, r.bound) for r in reports if r.reward is not None and r.bound is not None]
    assert live
    assert all(reward <= bound + 1e-4 for reward, bound in live)
    assert solution.bound is not None
    assert solution.termination is Termination.TIME_LIMIT


def test_it_begins_with_plans_whose_images_come_down(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rule only takes contacts once its recorder is rather full."""
    nothing = Outcome(columns=None, bound=np.inf, is_infeasible=True, log="")
    monkeypatch.setattr(WholeProgram, "_search", lambda *_: nothing)
    problem = make_problem(
        [images(0, 100.0), images(1, 150.0), contact(330.0, 390.0)], num_targets=2, resources=ROOMY
    )
    problem = with_objective(problem, Objective.delivered())
    rule = Rule().solve(problem, Budget(), 0).plan
    assert replay(problem, rule).reward == 0.0
    monkeypatch.setattr(whole_program, "_starts", lambda *_: [rule])
    assert replay(problem, Milp().solve(problem, Budget(), 0).plan).reward == 2.0


def test_a_wanted_gap_is_enough() -> None:
    problem = random_problem(5, num_collects=60, num_targets=30, use_resources=False)
    solution = Milp(gap=0.9).solve(problem, Budget(), 0)
    reward = replay(problem, solution.plan).reward
    assert solution.bound is not None
    assert solution.bound - reward <= 0.9 * solution.bound
    assert solution.termination in (Termination.GAP_REACHED, Termination.OPTIMAL)


def num_threads() -> int:
    """Return the system's count of threads, once those of earlier searches have ended."""
    for thread in highs_threads():
        thread.join()
    return len(os.listdir("/proc/self/task"))


def wait_for_threads(number: int) -> int:
    """Return the system's count of threads once it is at most ``number``, or after a minute.

    A joined thread may still be counted for a moment.
    """
    patience_s = time.monotonic() + 60.0
    while (now := len(os.listdir("/proc/self/task"))) > number and time.monotonic() < patience_s:
        time.sleep(0.05)
    return now


def test_a_solve_that_ends_by_itself_leaves_no_thread_behind() -> None:
    """Workers are forked from a process that has planned with every solver."""
    before = num_threads()
    solution = Milp().solve(random_problem(5), Budget(), 0)
    assert not highs_threads()
    assert wait_for_threads(before) <= before
    assert solution.termination is Termination.OPTIMAL


def test_the_thread_of_a_solve_that_was_cut_short_ends_soon() -> None:
    """The answer is returned before HiGHS reaches its next callback."""
    before = num_threads()
    Milp().solve(crowded(2), expiring(is_bounded), 0)
    assert wait_for_threads(before) <= before


@examples(40)
@given(
    seed=SEEDS,
    dynamics=DYNAMICS,
    telemetry_per_s=st.sampled_from([0.0, 3e-4]),
    num_satellites=st.integers(1, 2),
    is_slow=st.booleans(),
)
def test_a_program_of_some_tasks_is_the_whole_one_without_the_others(
    seed: int, dynamics: Dynamics, telemetry_per_s: float, num_satellites: int, is_slow: bool
) -> None:
    """In the paper's dynamics a task's cost depends on its neighbours, taken or not."""
    resources = replace(
        TIGHT, telemetry_per_s=telemetry_per_s, initial_recorder_fraction=0.3,
        initial_battery_fraction=0.6,
    )  # fmt: skip
    problem = random_problem(
        seed, dynamics=dynamics, num_collects=12, num_contacts=4, num_satellites=num_satellites,
        resources=resources, agility=SLOW if is_slow else Agility(),
        max_turn_deg=20.0 if is_slow else 0.0,
    )  # fmt: skip
    is_kept = np.random.default_rng(seed).random(len(problem.opportunities)) < 0.6
    rows = np.flatnonzero(is_kept).astype(np.int32)
    whole = plan_program(problem, "antichain", 1e-7).program
    upper = np.concatenate(whole.upper)
    upper[: len(is_kept)] *= is_kept
    whole.upper = [upper]
    part = plan_program(problem, "antichain", 1e-7, rows).program
    assert _optimum(part) == _optimum(whole)


def _optimum(program: Program) -> float | None:
    outcome = Engine(program, Budget(), 0, is_chained=True).search(
        None, 0.0, 0.05, lambda _reward, _bound: None
    )
    if outcome.columns is None:
        return None
    return round(float(np.concatenate(program.worth) @ outcome.columns), 6)


@pytest.mark.parametrize("seed", [2, 6, 9])
def test_no_bound_is_told_below_the_optimum_of_a_program_without_a_start(seed: int) -> None:
    # Here HiGHS first solves a part of the program, which has a lower bound of its own.
    rng = np.random.default_rng(seed)
    program = Program()
    program.add_columns(rng.integers(5, 20, 300).astype(np.float64))
    groups = [rng.choice(300, 3, replace=False).tolist() for _ in range(330)]
    program.add_rows(Rows.at_most(groups, [1.0] * len(groups)))
    engine = Engine(program, Budget(), 0, is_chained=False)
    assert engine.relaxed() is not None
    bounds: list[float] = []
    outcome = engine.search(None, 0.0, 0.05, lambda _reward, bound: bounds.append(bound))
    assert outcome.columns is not None
    reward = float(np.concatenate(program.worth) @ outcome.columns)
    assert outcome.bound == pytest.approx(reward)
    assert min(bounds) >= reward - 1e-6


def test_worths_are_told_apart_and_none_is_lowered() -> None:
    program = Program()
    program.add_columns(np.array([0.0, 3.0, 0.0, 3.0]))
    program.add_columns(np.array([3.0]))
    program.tell_apart()
    (worth,) = program.worth
    assert worth[[0, 2]].tolist() == [0.0, 0.0]
    raised = worth[[1, 3, 4]]
    assert len(set(raised.tolist())) == 3
    assert np.all(raised >= 3.0)
    assert raised == pytest.approx(3.0, rel=1e-7, abs=0.0)
    assert program.num_columns == len(worth)
