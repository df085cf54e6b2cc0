"""Images recorded at the start: they are downlinked first and earn then, and bounds hold."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest
from hypothesis import event, example, given
from hypothesis import strategies as st

from planner_core import run
from planner_core.budget import Budget, Termination
from planner_core.certified.lns.downlinks import brought_down
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.domain import (
    GroundStation,
    Horizon,
    Objective,
    OnBoard,
    Resources,
    Scenario,
    State,
    Target,
)
from planner_core.errors import InvalidScenario
from planner_core.pinning.apply_pins import apply_pins
from planner_core.problem import COLLECT, CONTACT, ImageOnBoard, Pinned, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.on_board import most_on_board, with_on_board, without_on_board
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.run import Judged, plan_scenario
from planner_core.solvers.registry import SOLVERS, Certified
from tests.examples import examples
from tests.geometry import hours, orbit, satellite
from tests.planner_core.brute_force import possible_plans
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem
from tests.planner_core.verdicts import certified

SEEDS = st.integers(0, 10**6)
OBJECTIVES = (
    Objective(collected_share=0.9),
    Objective(collected_share=0.0),
    Objective(collected_share=0.3, half_life_s=400.0),
    Objective(collected_share=0.0, half_life_s=200.0),
)


def _loaded(seed: int, num_collects: int = 5) -> Problem:
    """Return a drawn problem with images of random sizes on board."""
    rng = np.random.default_rng(seed)
    held = float(rng.uniform(0.05, 0.45))
    problem = random_problem(
        seed, num_collects=num_collects, num_contacts=3, has_rewards=bool(rng.integers(2)),
        resources=replace(TIGHT, initial_recorder_fraction=held),
    )  # fmt: skip
    problem = with_objective(problem, OBJECTIVES[int(rng.integers(len(OBJECTIVES)))])
    number = int(rng.integers(1, 4))
    shares = rng.dirichlet(np.ones(number + 1))[:number] * held
    images = tuple(
        ImageOnBoard(
            satellite=0,
            target=int(rng.integers(len(problem.target_ids))),
            amount=0.0 if rng.random() < 0.1 else float(share),
            collected_s=-float(rng.uniform(0.0, 900.0)),
            worth=float(rng.integers(1, 9)),
        )
        for share in shares
    )
    return with_on_board(problem, images)


def _valid(problem: Problem) -> Iterator[Timeline]:
    for rows in possible_plans(problem):
        timeline = replay(problem, Plan.of(problem, rows), in_detail=False)
        if timeline.is_valid:
            yield timeline


@examples(60)
@example(seed=749)  # almost nothing to earn: multipliers in units overflowed 32 bits
@given(seed=SEEDS)
def test_no_plan_earns_more_than_the_bound(seed: int) -> None:
    """Every possible plan, with its new images and those on board."""
    problem = _loaded(seed)
    bare = without_on_board(problem)
    solution = certified(bare, seed)
    proven, most = solution.proven, most_on_board(problem)
    assert proven is not None
    quick = quick_bound(bare, 0.0)
    best = 0.0
    for timeline in _valid(problem):
        best = max(best, timeline.reward)
        assert timeline.reward - timeline.earned_by_new <= most + 1e-9
        assert timeline.earned_by_new <= quick.value + 1e-9
    plan = brought_down(problem, solution.plan, Budget())
    mine = replay(problem, plan)
    if best == 0.0 or not mine.is_valid:
        return
    bound = proven.with_on_board(most)
    assert bound.value >= best - 1e-6
    assert mine.reward <= best + 1e-9
    event(f"as good as the best: {mine.reward >= best - 1e-6}")
    assert from_json(to_json(bound)).value == bound.value
    if is_proven(bare, proven) is not None:
        assert is_proven(problem, from_json(to_json(bound)))
    if most > 0.0:
        assert not is_proven(problem, replace(bound, on_board=0.9 * most))


def _queue(problem: Problem, plan: Plan) -> dict[int, float]:
    """Return when each image on board is down, from a queue served in small time steps."""
    r, step_s = problem.satellites[0].resources, 0.05
    listed = sum(image.amount for image in problem.on_board)
    queue: deque[list[float]] = deque(
        [image.amount, float(i)] for i, image in enumerate(problem.on_board) if image.amount > 0.0
    )
    queue.append([r.initial_recorder_fraction - listed, -1.0])
    down: dict[int, float] = {}
    for step in range(round(problem.horizon_s / step_s)):
        t_s, room = step * step_s, 0.0
        queue.append([r.telemetry_per_s * step_s, -1.0])
        for action in plan.actions:
            overlap_s = min(action.end_s, t_s + step_s) - max(action.start_s, t_s)
            if overlap_s > 0.0 and problem.opportunities.kind[action.opportunity] == CONTACT:
                room += r.downlink_per_s * overlap_s
            elif overlap_s > 0.0:
                queue.append([r.collect_fill_per_s * overlap_s, -1.0])
        while queue and room > 1e-15:
            taken = min(room, queue[0][0])
            room -= taken
            queue[0][0] -= taken
            if queue[0][0] <= 1e-12:
                number = int(queue.popleft()[1])
                if number >= 0:
                    down[number] = t_s + step_s
    return down


@examples(60)
@given(seed=SEEDS)
def test_they_come_down_first_and_in_their_order(seed: int) -> None:
    """Compared with an independent integration and the formula of their worth."""
    problem = _loaded(seed, num_collects=6)
    rng = np.random.default_rng(seed)
    chosen: list[int] = []
    for row in range(len(problem.opportunities)):
        if rng.random() < 0.7 and replay(problem, Plan.of(problem, [*chosen, row])).is_valid:
            chosen.append(row)
    plan = Plan.of(problem, chosen)
    timeline = replay(problem, plan)
    expected = _queue(problem, plan)
    a, half_life_s = problem.objective.collected_share, problem.objective.half_life_s
    earned: dict[int, float] = {}
    for one, image in zip(timeline.brought_down, problem.on_board, strict=True):
        if one.delivered_s is None:
            # In the last moment of a contact the steps are too coarse to tell.
            ends_s = [act.end_s for act in plan.actions]
            late_s = expected.get(one.image)
            assert late_s is None or any(abs(late_s - end_s) < 0.2 for end_s in ends_s)
            continue
        assert one.delivered_s == pytest.approx(expected.get(one.image, np.inf), abs=0.2)
        age_s = one.delivered_s - image.collected_s
        decay = 1.0 if half_life_s is None else 2.0 ** (-age_s / half_life_s)
        best = max(earned.get(image.target, 0.0), (1.0 - a) * image.worth * decay)
        earned[image.target] = best
    new = sum(image.worth for image in timeline.collected.values())
    assert timeline.reward == pytest.approx(new + sum(earned.values()))
    assert not timeline.collected.keys() & {image.target for image in problem.on_board}


@pytest.mark.parametrize("name", sorted(SOLVERS))
def test_every_solver_leaves_their_targets_alone(name: str) -> None:
    problem = apply_pins(_loaded(3, num_collects=8), Pinned())
    solution = SOLVERS[name]().solve(without_on_board(problem), Budget(), 0)
    on_board = {image.target for image in problem.on_board}
    table = problem.opportunities
    assert not on_board & {
        int(table.site[a.opportunity])
        for a in solution.plan.actions
        if table.kind[a.opportunity] == COLLECT
    }


BEGIN = hours(1).start
OBJECTIVE = Objective(collected_share=0.5, half_life_s=7200.0)


def _mission(*on_board: OnBoard, recorder: float | None = None, **more: object) -> Scenario:
    sites = np.random.default_rng(0).uniform((-60.0, -180.0), (60.0, 180.0), (40, 2)).tolist()
    own = satellite(orbit())
    resources = replace(Resources.paper(5668.7), recorder_capacity_mbit=1000.0)
    state = State(satellite_id=own.id, at=BEGIN, recorder_fraction=recorder, on_board=on_board)
    values: dict[str, object] = {
        "horizon": Horizon(start=BEGIN, end=BEGIN + timedelta(hours=4)),
        "satellites": (replace(own, resources=resources),),
        "targets": tuple(
            Target(id=f"t{i}", lat_deg=lat, lon_deg=lon) for i, (lat, lon) in enumerate(sites)
        ),
        "ground_stations": (GroundStation(id="sv", name="sv", lat_deg=78.2, lon_deg=15.4),),
        "objective": OBJECTIVE,
        "states": (state,),
    }
    return Scenario(**(values | more))  # type: ignore[arg-type]


def _judged(scenario: Scenario) -> Judged:
    return plan_scenario(scenario, Certified(), 0, Budget(20.0))


def test_a_plan_brings_down_what_is_on_board_and_says_so() -> None:
    hour = timedelta(hours=1)
    images = (
        OnBoard(target_id="t1", collected_at=BEGIN - hour, mbit=50.0, worth=8.0),
        OnBoard(target_id="t2", collected_at=BEGIN - 2 * hour, recorder_fraction=0.02),
        OnBoard(target_id="t3", collected_at=BEGIN - 2 * hour, mbit=0.0),
    )
    judged = _judged(_mission(*images, recorder=0.3))
    timeline = judged.timeline
    assert timeline.is_valid
    assert judged.bound is not None
    assert judged.bound.value >= timeline.reward
    first, second, third = timeline.brought_down
    assert first.delivered_s is not None
    assert second.delivered_s is not None
    assert first.delivered_s < second.delivered_s
    assert third.delivered_s is None
    assert first.earned == pytest.approx(
        0.5 * 8.0 * 2.0 ** (-(first.delivered_s + 3600.0) / 7200.0)
    )
    assert (second.earned > 0.0, third.earned) == (True, 0.0)
    outcomes = {judged.problem.target_ids[o.target]: o for o in judged.outcomes}
    for name in ("t1", "t2", "t3"):
        assert (outcomes[name].outcome, outcomes[name].reason) == ("downlinked", None)
    assert timeline.reward == pytest.approx(timeline.earned_by_new + first.earned + second.earned)


def test_a_bound_that_a_plan_beats_by_what_is_on_board_is_not_repeated(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    image = OnBoard(target_id="t1", collected_at=BEGIN, mbit=50.0, worth=100.0)
    monkeypatch.setattr(run, "most_on_board", lambda _: 1e-6)
    judged = _judged(_mission(image, recorder=0.3))
    assert judged.bound is None
    assert judged.solution.termination is not Termination.OPTIMAL
    assert "which a valid plan earns" in caplog.text


def test_a_plan_earns_by_its_own_images_and_by_those_on_board_but_not_twice() -> None:
    tasks = [
        Task(kind=COLLECT, site=0, start_s=0.0, end_s=30.0),
        Task(kind=COLLECT, site=1, start_s=100.0, end_s=130.0),
        Task(kind=CONTACT, site=0, start_s=400.0, end_s=600.0),
    ]
    roomy = replace(TIGHT, recorder_max_fraction=0.9)
    problem = with_objective(
        make_problem(tasks, num_targets=2, resources=roomy), Objective.delivered()
    )
    held = ImageOnBoard(satellite=0, target=0, amount=0.05, collected_s=-100.0, worth=3.0)
    problem = with_on_board(problem, (held, replace(held, worth=2.0)))
    timeline = replay(problem, Plan.of(problem, range(3)))
    assert [(v.code, v.satellite) for v in timeline.violations] == [("duplicate", 0)]
    assert set(timeline.collected) == {1}
    first, second = timeline.brought_down
    assert (first.delivered_s, first.age_s) == pytest.approx((412.5, 512.5))
    assert (second.delivered_s, second.age_s) == pytest.approx((425.0, 525.0))
    assert (first.earned, second.earned) == (3.0, 0.0)
    assert timeline.reward == 3.0 + 1.0


def test_without_contacts_they_stay_on_board() -> None:
    image = OnBoard(target_id="t1", collected_at=BEGIN, mbit=50.0)
    judged = _judged(_mission(image, ground_stations=()))
    (one,) = judged.timeline.brought_down
    assert (one.delivered_s, one.earned) == (None, 0.0)
    assert judged.outcomes[1].outcome == "collected"
    assert most_on_board(judged.problem) == 0.0
    # The recorder holds the listed images unless it is said to hold more.
    assert judged.problem.satellites[0].resources.initial_recorder_fraction == 0.05


@pytest.mark.parametrize(
    ("image", "code", "field"),
    [
        ({"target_id": "none"}, "unknown_target", "/0/target_id"),
        ({"collected_at": BEGIN + timedelta(seconds=1)}, "value_out_of_range", "/0/collected_at"),
        ({"mbit": None}, "value_out_of_range", "/0/mbit"),
        ({"recorder_fraction": 0.1}, "value_out_of_range", "/0/mbit"),
        ({"mbit": -1.0}, "value_out_of_range", "/0/mbit"),
        ({"worth": float("nan")}, "value_out_of_range", "/0/worth"),
        ({"mbit": 301.0}, "value_out_of_range", ""),
    ],
)
def test_impossible_images_are_refused(image: dict[str, object], code: str, field: str) -> None:
    fine = OnBoard(target_id="t1", collected_at=BEGIN, mbit=50.0)
    with pytest.raises(InvalidScenario) as caught:
        _mission(replace(fine, **image), recorder=0.3)  # type: ignore[arg-type]
    fault = caught.value.fault
    assert (fault.code, fault.pointer) == (code, f"/states/0/on_board{field}")


def test_megabits_need_a_recorder_with_a_size() -> None:
    own = replace(satellite(orbit()), resources=Resources.paper(5668.7))
    with pytest.raises(InvalidScenario) as caught:
        _mission(OnBoard(target_id="t1", collected_at=BEGIN, mbit=5.0), satellites=(own,))
    assert caught.value.fault.pointer == "/states/0/on_board/0/mbit"
    _mission(OnBoard(target_id="t1", collected_at=BEGIN, recorder_fraction=0.1), satellites=(own,))
