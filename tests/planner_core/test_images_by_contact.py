"""Programs that know which contact downlinks each image."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.mip.highs import Engine
from planner_core.certified.mip.program_windows import ProgramWindows
from planner_core.certified.program import deliveries
from planner_core.certified.program.model import plan_program
from planner_core.certified.tolerances import TOUCHING
from planner_core.domain import Objective
from planner_core.problem import Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.downlink import Downlinks, StationLinks
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.replay import replay
from planner_core.solvers.milp import Milp
from planner_core.solvers.rule import Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import make_problem, varied_problem
from tests.planner_core.test_certified_delivered import STARVED
from tests.planner_core.test_delivery import ROOMY, collect, contact

_small = partial(varied_problem, scarce=STARVED, num_collects=6, num_contacts=3)

AGING = st.builds(
    Objective,
    collected_share=st.one_of(st.sampled_from([0.0, 0.5, 0.9]), st.floats(0.0, 0.95)),
    half_life_s=st.floats(60.0, 2000.0),
)
DYNAMICS = st.sampled_from(["physical", "paper"])


def _program_bound(problem: Problem) -> float:
    """Return HiGHS's own bound, which a solver would raise to its plan's reward."""
    program = plan_program(problem, "antichain", TOUCHING).program
    engine = Engine(program, Budget(), 0, is_chained=True)
    return engine.search(None, 0.0, None, lambda _reward, _bound: None).bound


@examples(250)
@given(
    seed=st.integers(0, 10**6),
    dynamics=DYNAMICS,
    objective=AGING,
    num_satellites=st.integers(1, 2),
    has_quality=st.booleans(),
    num_named=st.sampled_from([0, 1, 8]),
)
def test_no_plan_beats_the_program(
    seed: int,
    dynamics: Literal["physical", "paper"],
    objective: Objective,
    num_satellites: int,
    has_quality: bool,
    num_named: int,
) -> None:
    problem = _small(seed, dynamics, num_satellites, has_quality=has_quality)
    problem = with_objective(problem, objective)
    best = best_reward(problem)
    with mock.patch.object(deliveries, "NEXT_CONTACTS", num_named):
        assert _program_bound(problem) >= best - 1e-6
        solution = Milp().solve(problem, Budget(), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert timeline.reward <= best + 1e-6
    assert solution.bound is not None
    assert solution.bound >= best - 1e-6


def test_a_contact_brings_down_what_it_has_time_for() -> None:
    """The younger image with the first contact, which has room for one; the other with the next."""
    tasks = [collect(0, 100.0), collect(1, 200.0), contact(330.0, 345.0), contact(600.0, 615.0)]
    bare = replace(ROOMY, telemetry_per_s=0.0, initial_recorder_fraction=0.0)
    problem = make_problem(tasks, num_targets=2, resources=bare)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=300.0))
    assert problem.satellites[0].volume[2] == pytest.approx(30.0 * bare.collect_fill_per_s)
    # None earns more than if it were downlinked as soon as possible.
    most = problem.worth[1] + 2.0 ** (-(600.0 - 130.0) / 300.0)
    assert Milp().solve(problem, Budget(), 0).bound == pytest.approx(most, abs=1e-4)


def test_a_contact_may_begin_as_an_image_ends_to_the_tolerance_of_times() -> None:
    tasks = [collect(0, 100.0), contact(130.0 - TIME_TOLERANCE_S / 2.0, 230.0)]
    problem = make_problem(tasks, num_targets=1, resources=ROOMY)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=300.0))
    best = best_reward(problem)
    assert best > 0.5
    assert _program_bound(problem) >= best


def test_a_later_contact_may_be_ready_sooner() -> None:
    """The first takes a minute to set up, the second begins a little later and needs none."""
    tasks = [collect(0, 100.0), contact(300.0, 400.0), replace(contact(310.0, 410.0), site=1)]
    links = StationLinks(gain=np.ones(2), setup_s=np.array([60.0, 0.0]))
    bare = replace(ROOMY, telemetry_per_s=0.0, initial_recorder_fraction=0.0)
    problem = make_problem(
        tasks, num_targets=1, num_stations=2, resources=bare, downlinks=Downlinks(stations=links)
    )
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=100.0))
    best = best_reward(problem)
    assert best > 2.0 ** (-(360.0 - 130.0) / 100.0)
    for num_named in (0, 1, 8):
        with mock.patch.object(deliveries, "NEXT_CONTACTS", num_named):
            assert _program_bound(problem) >= best


@examples(150)
@given(
    seed=st.integers(0, 10**6),
    dynamics=DYNAMICS,
    objective=AGING,
    num_satellites=st.integers(1, 2),
    data=st.data(),
)
def test_a_window_planned_anew_leaves_the_rest_as_it_is(
    seed: int,
    dynamics: Literal["physical", "paper"],
    objective: Objective,
    num_satellites: int,
    data: st.DataObject,
) -> None:
    problem = with_objective(_small(seed, dynamics, num_satellites), objective)
    plan = Rule().solve(problem, Budget(), 0).plan
    windows = ProgramWindows(problem, Budget(), seed)
    number = len(problem.opportunities)
    window = np.array(data.draw(st.lists(st.booleans(), min_size=number, max_size=number)))
    with mock.patch.object(ProgramWindows, "_window", return_value=window):
        new = windows.move(plan, 1)
    assert replay(problem, new).is_valid
    changed = {a.opportunity for a in plan.actions} ^ {a.opportunity for a in new.actions}
    assert all(window[row] for row in changed)


@pytest.mark.parametrize("num_tasks", [1, 5, 20, 100])
def test_a_window_is_of_so_many_opportunities(num_tasks: int) -> None:
    problem = _small(1, "physical", 2)
    windows = ProgramWindows(problem, Budget(), 0)
    drawn = [windows._window(num_tasks) for _ in range(30)]
    start_s, end_s = problem.opportunities.start_s, problem.opportunities.end_s
    for window in drawn:
        assert window.any()
        within = (start_s >= start_s[window].min()) & (end_s <= end_s[window].max())
        assert np.array_equal(within, window)
    assert (num_tasks >= 2 * len(start_s)) == all(window.all() for window in drawn)
    assert np.all(np.any(drawn, axis=0))
