"""Frozen actions that exceed a limit: the replan is made, and no plan is blamed for them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from planner_core.budget import Budget
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.domain import Dynamics, Stability
from planner_core.errors import InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import COLLECT, CONTACT, Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.resource_profile import Curve, integrate
from planner_core.referee.timeline import Timeline
from planner_core.referee.unavoidable import is_unavoidable
from planner_core.replanning.question import Question
from planner_core.replanning.relief import replanned, within_limits
from planner_core.solvers.registry import SOLVERS, Certified, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward, possible_plans
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem
from tests.planner_core.verdicts import certified

NEARLY_FULL = replace(TIGHT, initial_recorder_fraction=0.4, initial_battery_fraction=0.9)
TASKS = [
    Task(kind=COLLECT, site=0, start_s=50.0, end_s=80.0),
    Task(kind=COLLECT, site=1, start_s=120.0, end_s=150.0),
    Task(kind=CONTACT, site=0, start_s=200.0, end_s=300.0),
    Task(kind=COLLECT, site=2, start_s=400.0, end_s=430.0),
]


def _after(problem: Problem, frozen: list[int], until_s: float) -> Problem:
    """Return the remaining problem, with actions frozen up to an instant."""
    kept = tuple(Kept(row=row, pointer=f"/replan/base/{i}") for i, row in enumerate(frozen))
    return apply_pins(problem, Pinned(kept=kept, frozen_until_s=until_s))


def _question(problem: Problem, base: list[int], *promised: int) -> Question:
    is_later = problem.opportunities.start_s[base] >= (problem.pinned.frozen_until_s or 0.0)
    return Question(
        problem=problem, base=np.array(base, dtype=np.int32), num_base=int(is_later.sum()),
        promised=promised, stability=Stability(),
    )  # fmt: skip


def _lost_pass() -> Problem:
    """Return a problem whose lost contact leaves too little room for the image flown next."""
    whole = make_problem(TASKS, num_targets=3, resources=NEARLY_FULL)
    return _after(whole, [0], 100.0)


def test_what_is_frozen_refuses_no_replan_and_is_inherited() -> None:
    problem = _lost_pass()
    timeline = replay(problem, Plan.of(problem, [0, 2, 3]))
    assert timeline.validity == "inherited"
    assert [(v.code, v.blamed, v.inherited) for v in timeline.violations] == [
        ("recorder", (), True)
    ]
    assert timeline.reward == 2.0


def test_what_makes_it_worse_is_to_blame() -> None:
    problem = _lost_pass()
    timeline = replay(problem, Plan.of(problem, [0, 1, 2]))
    assert timeline.validity == "violations"
    assert [(v.blamed, v.inherited) for v in timeline.violations] == [((1,), False)]
    assert set(timeline.collected) == {0}


def test_without_a_freeze_the_same_images_break_a_limit() -> None:
    whole = make_problem(TASKS, num_targets=3, resources=NEARLY_FULL)
    timeline = replay(whole, Plan.of(whole, [0, 2, 3]))
    assert [(v.blamed, v.inherited) for v in timeline.violations] == [((0, 1), False)]


def test_in_the_event_model_a_contact_is_not_blamed_for_what_it_empties() -> None:
    whole = make_problem(TASKS, num_targets=3, resources=NEARLY_FULL, dynamics="paper")
    timeline = replay(whole, Plan.of(whole, [0, 2]))
    assert [(v.code, v.blamed) for v in timeline.violations] == [("recorder", (0,))]


def test_a_pin_that_breaks_limits_by_itself_is_still_refused() -> None:
    whole = make_problem(TASKS, num_targets=3, resources=NEARLY_FULL)
    kept = (Kept(row=1, pointer="/pins/keep/0"),)
    with pytest.raises(InvalidScenario) as caught:
        apply_pins(whole, Pinned(kept=kept, frozen_until_s=100.0, skipped={2: "/pins/skip/0"}))
    assert caught.value.fault.code == "pin_breaks_limits"


def test_an_image_that_finds_no_room_at_all_earns_nothing() -> None:
    """Data is lost if the recorder is full, not if it is just beyond its limit."""
    full = replace(NEARLY_FULL, initial_recorder_fraction=0.95)
    problem = _after(make_problem(TASKS, num_targets=3, resources=full), [0], 100.0)
    timeline = replay(problem, Plan.of(problem, [0, 2]))
    assert timeline.validity == "inherited"
    assert [(v.blamed, v.inherited) for v in timeline.violations] == [((0,), True)]
    assert timeline.reward == 0.0


def test_an_image_that_finds_no_energy_at_all_earns_nothing() -> None:
    low = replace(TIGHT, initial_battery_fraction=0.05)
    problem = _after(make_problem(TASKS, num_targets=3, resources=low), [0], 100.0)
    timeline = replay(problem, Plan.of(problem, [0]))
    assert timeline.battery_min == 0.0
    assert [(v.code, v.blamed, v.inherited) for v in timeline.violations] == [
        ("battery", (0,), True)
    ]
    assert timeline.reward == 0.0


def test_no_recorder_is_full_for_want_of_the_longest_contact_of_a_pass() -> None:
    passes = [
        Task(kind=CONTACT, site=0, start_s=200.0, end_s=end_s, access=9) for end_s in (220.0, 300.0)
    ]
    whole = make_problem([*TASKS[:2], *passes], num_targets=2, resources=NEARLY_FULL)
    problem = _after(whole, [0], 100.0)
    level = 0.4 + 30 / 200 + 350e-4 - 20 / 250
    assert level > TIGHT.recorder_max_fraction
    assert is_unavoidable(problem, 0, "recorder", level, 150.0)
    assert not is_unavoidable(problem, 0, "recorder", level, 350.0)


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_every_solver_goes_on_from_what_is_frozen(name: str) -> None:
    problem = _lost_pass()
    question = _question(problem, [0, 1, 3])
    searched = within_limits(problem)
    assert searched is not problem
    found = replanned(question, searched, SOLVERS[name](), Budget(), 0)
    timeline = replay(problem, found.plan)
    assert (timeline.validity, timeline.reward) == ("inherited", 2.0)
    assert found.statistics["changed"] == 1.0


def test_a_promise_that_would_overfill_the_recorder_is_kept_later_or_refused() -> None:
    later = Task(kind=COLLECT, site=1, start_s=500.0, end_s=530.0)
    whole = make_problem([*TASKS, later], num_targets=3, resources=NEARLY_FULL)
    problem = _after(whole, [0], 100.0)
    found = replanned(_question(problem, [0, 1, 3], 1), within_limits(problem), Rule(), Budget(), 0)
    assert 4 in {action.opportunity for action in found.plan.actions}
    assert replay(problem, found.plan).validity == "inherited"
    problem = _lost_pass()
    with pytest.raises(InvalidScenario) as caught:
        replanned(_question(problem, [0, 1, 3], 1), within_limits(problem), Rule(), Budget(), 0)
    assert caught.value.fault.code == "promise_not_kept"


def _worse_than_planned(seed: int, dynamics: Dynamics) -> Problem | None:
    """Return a problem with a frozen part, from a worse state than its plan was made for."""
    rng = np.random.default_rng(seed)
    whole = random_problem(
        seed, num_collects=5, num_contacts=3, num_targets=5, dynamics=dynamics, has_rewards=True
    )
    base = Rule().solve(whole, Budget(), 0).plan
    until_s = float(rng.uniform(100, 600))
    frozen = [action.opportunity for action in base.actions if action.start_s < until_s]
    worse = replace(
        TIGHT,
        initial_recorder_fraction=float(rng.choice([0.1, 0.3, 0.45, 0.49])),
        initial_battery_fraction=float(rng.choice([0.35, 0.5, 0.7])),
    )
    satellites = tuple(replace(satellite, resources=worse) for satellite in whole.satellites)
    try:
        return _after(replace(whole, satellites=satellites), frozen, until_s)
    except InvalidScenario as error:
        assert error.fault.code == "pins_conflict"  # noqa: PT017 - never what is frozen
        return None


def _plans(problem: Problem) -> Iterator[tuple[Plan, Timeline]]:
    """Yield every plan that holds the frozen part, within limits or not."""
    for rows in possible_plans(problem):
        plan = Plan.of(problem, rows)
        timeline = replay(problem, plan, in_detail=False)
        if not {v.code for v in timeline.violations} - {"battery", "recorder", "duplicate"}:
            yield plan, timeline


@examples(150)
@given(seed=st.integers(0, 10**6), dynamics=st.sampled_from(["physical", "paper"]))
def test_bounds_hold_for_all_that_may_be_flown_and_plans_are_among_it(
    seed: int, dynamics: Dynamics
) -> None:
    problem = _worse_than_planned(seed, dynamics)
    if problem is None:
        return
    plans = list(_plans(problem))
    valid = max((timeline.reward for _, timeline in plans if timeline.is_valid), default=0.0)
    assert best_reward(problem) == pytest.approx(valid, abs=1e-9)
    flown = [timeline for _, timeline in plans if timeline.validity != "violations"]
    searched = within_limits(problem)
    solution = certified(searched, seed)
    base = problem.kept_rows.tolist()
    found = replanned(_question(problem, base), searched, Certified(), Budget(), 0)
    timeline = replay(problem, found.plan)
    event(f"relieved: {searched is not problem}, may be flown: {bool(flown)}")
    if not flown:
        return
    best = max(one.reward for one in flown)
    assert timeline.validity != "violations"
    assert timeline.reward <= best + 1e-9
    assert solution.bound is not None
    assert solution.bound >= best - 1e-9
    assert found.bound is not None
    assert found.bound >= best - 1e-9
    assert quick_bound(searched, 0.0).value >= best - 1e-9


@examples(150)
@given(seed=st.integers(0, 10**6), dynamics=st.sampled_from(["physical", "paper"]))
def test_what_counts_as_inherited_no_plan_avoids(seed: int, dynamics: Dynamics) -> None:
    problem = _worse_than_planned(seed, dynamics)
    if problem is None:
        return
    plans = list(_plans(problem))
    given_s = {
        (v.code, v.at_s)
        for _, timeline in plans
        for v in timeline.violations
        if v.inherited and v.at_s > 0.0
    }
    event(f"inherited: {len(given_s)}")
    r = problem.satellites[0].resources
    for plan, _ in plans if given_s else ():
        curve = integrate(problem, problem.satellites[0], plan).curve
        for code, at_s in given_s:
            if code == "battery":
                assert _level(problem, curve, "battery", at_s) <= r.battery_min_fraction + 1e-6
            else:
                assert _level(problem, curve, "recorder", at_s) >= r.recorder_max_fraction - 1e-6


def _level(problem: Problem, curve: Curve, name: str, at_s: float) -> float:
    time_s, levels = curve.time_s, getattr(curve, name)
    if problem.dynamics == "physical":
        return float(np.interp(at_s, time_s, levels))
    return float(levels[np.searchsorted(time_s, at_s, side="right") - 1])
