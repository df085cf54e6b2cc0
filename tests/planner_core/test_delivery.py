"""When images are downlinked, and what they then earn."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from planner_core.domain import Dynamics, Objective, Resources
from planner_core.errors import InvalidScenario
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.delivery import least_age_s, with_objective
from planner_core.problem.plan import Plan
from planner_core.referee.delivery import _one_after_another
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from tests.planner_core.problems import TIGHT, Task, make_problem, random_problem

ROOMY = Resources(
    battery_min_fraction=0.0,
    initial_battery_fraction=1.0,
    sunpoint_charge_per_s=1.0,
    collect_drain_per_s=0.0,
    contact_drain_per_s=0.0,
    recorder_max_fraction=1.0,
    initial_recorder_fraction=0.05,
    collect_fill_per_s=1 / 1000,
    downlink_per_s=1 / 500,
    telemetry_per_s=1e-5,
)


def collect(target: int, start_s: float, quality: float = 1.0) -> Task:
    return Task(kind=COLLECT, site=target, start_s=start_s, end_s=start_s + 30.0, quality=quality)


def contact(start_s: float, end_s: float) -> Task:
    return Task(kind=CONTACT, site=0, start_s=start_s, end_s=end_s)


def all_of(problem: Problem) -> Timeline:
    return replay(problem, Plan.of(problem, range(len(problem.opportunities))))


def test_the_hand_worked_queue() -> None:
    """0.05 on board at the start, telemetry, two images of 0.03: downlinked at 0.002 a second."""
    problem = make_problem(
        [collect(0, 100.0), collect(1, 200.0), contact(300.0, 360.0), contact(500.0, 600.0)],
        num_targets=2,
        resources=ROOMY,
    )
    timeline = all_of(problem)
    first, second = timeline.collected[0], timeline.collected[1]
    ahead = 0.05 + 130e-5 + 0.03
    assert first.delivered_s == pytest.approx(300.0 + ahead / 0.002)
    assert first.age_s == pytest.approx(300.0 + ahead / 0.002 - 130.0)
    ahead = 0.05 + 230e-5 + 0.06
    assert ahead < 60 * 0.002
    assert second.delivered_s == pytest.approx(300.0 + ahead / 0.002)
    assert timeline.on_board[0] == pytest.approx(400e-5)


def test_what_one_contact_leaves_the_next_one_takes() -> None:
    problem = make_problem(
        [collect(0, 100.0), contact(300.0, 330.0), contact(500.0, 600.0)],
        num_targets=1,
        resources=ROOMY,
    )
    ahead = 0.05 + 130e-5 + 0.03 - 30 * 0.002
    assert all_of(problem).collected[0].delivered_s == pytest.approx(500.0 + ahead / 0.002)


def test_events_of_the_paper_come_down_one_after_another_too() -> None:
    problem = make_problem(
        [collect(0, 100.0), contact(300.0, 400.0)],
        num_targets=1,
        resources=ROOMY,
        dynamics="paper",
    )
    ahead = 0.05 + 100e-5 + 0.03
    assert all_of(problem).collected[0].delivered_s == pytest.approx(300.0 + ahead / 0.002)


@pytest.mark.parametrize(
    ("objective", "on_the_ground", "on_board"),
    [
        (Objective.collected(), 4.0, 4.0),
        (Objective.delivered(), 4.0, 0.0),
        (Objective(collected_share=0.25), 4.0, 1.0),
        (Objective(collected_share=0.25, half_life_s=100.0), 1.0 + 3.0 * 2 ** (-2.5825), 1.0),
    ],
)
def test_what_an_image_earns_by_where_it_is(
    objective: Objective, on_the_ground: float, on_board: float
) -> None:
    tasks = [collect(0, 100.0), contact(347.6, 420.0), collect(1, 600.0)]
    bare = replace(ROOMY, telemetry_per_s=0.0)  # 0.08 in 40 s: down at 387.6, 257.6 s old
    problem = make_problem(tasks, num_targets=2, rewards=[4.0, 4.0], resources=bare)
    timeline = all_of(with_objective(problem, objective))
    age_s = 347.6 + 40.0 - 130.0
    expected = on_the_ground
    if objective.half_life_s:
        expected = 1.0 + 3.0 * 2 ** (-age_s / 100.0)
    assert timeline.collected[0].worth == pytest.approx(expected)
    assert timeline.collected[1].worth == pytest.approx(on_board)
    assert timeline.collected[1].age_s is None
    assert timeline.reward == pytest.approx(expected + on_board)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@pytest.mark.parametrize("held", [0.0, 0.05])
def test_an_image_without_data_is_down_when_the_next_contact_begins(
    held: float, dynamics: Dynamics
) -> None:
    """Whatever was recorded before it is down already, which does not make the image older."""
    empty = replace(
        ROOMY, collect_fill_per_s=0.0, telemetry_per_s=0.0, initial_recorder_fraction=held
    )
    tasks = [contact(100.0, 200.0), collect(0, 300.0), contact(400.0, 500.0), collect(1, 600.0)]
    problem = make_problem(tasks, num_targets=2, resources=empty, dynamics=dynamics)
    problem = with_objective(problem, Objective(collected_share=0.0, half_life_s=70.0))
    first, second = (all_of(problem).collected[target] for target in range(2))
    assert (first.delivered_s, first.age_s, first.worth) == (400.0, 70.0, 0.5)
    assert first.worth <= problem.worth[1] <= 0.5 + 1e-6
    assert (second.delivered_s, second.worth) == (None, 0.0)


def test_a_contact_that_takes_down_all_it_can_ends_with_its_last_bit() -> None:
    """Its pieces, added one by one, may differ from their sum by a rounding error."""
    pieces = np.array([[0.0, 10.0, 0.01], [10.0, 20.0, 0.03], [20.0, 30.0, 0.02]])
    points = _one_after_another(pieces, 0.2, 0.8 + 1e-12)
    assert points[0] == (0.0, 0.2)
    assert [time_s for time_s, _ in points] == [0.0, 10.0, 20.0, 30.0]
    assert points[-1][1] == 0.8 + 1e-12


def test_of_several_images_the_one_that_earns_most_counts() -> None:
    """The better image is still on board at the end."""
    tasks = [collect(0, 100.0, quality=0.5), contact(300.0, 400.0), collect(0, 600.0)]
    problem = make_problem(tasks, num_targets=1, resources=ROOMY)
    delivered = all_of(with_objective(problem, Objective.delivered()))
    assert delivered.reward == 0.5
    assert delivered.collected[0].is_downlinked
    assert all_of(problem).reward == 1.0


def test_without_resources_images_earn_all_when_they_are_taken() -> None:
    problem = make_problem([collect(0, 100.0)], num_targets=1, use_resources=False)
    made = with_objective(problem, Objective.delivered())
    assert all_of(made).reward == 1.0


@pytest.mark.parametrize("collected_share", [-0.1, 1.1, math.nan])
def test_a_share_is_from_0_to_1(collected_share: float) -> None:
    with pytest.raises(InvalidScenario):
        Objective(collected_share=collected_share)


@pytest.mark.parametrize("half_life_s", [0.0, -1.0, math.inf, math.nan])
def test_a_half_life_is_a_time(half_life_s: float) -> None:
    with pytest.raises(InvalidScenario):
        Objective(half_life_s=half_life_s)


def _queue(problem: Problem, plan: Plan) -> dict[int, float]:
    """Return when each image is down, from a queue of pieces served second by second."""
    r = problem.satellites[0].resources
    kind, step_s = problem.opportunities.kind, 0.05
    queue: deque[list[float]] = deque([[r.initial_recorder_fraction, -1.0]])
    down: dict[int, float] = {}
    actions = plan.actions
    for step in range(round(problem.horizon_s / step_s)):
        t_s = step * step_s
        queue.append([r.telemetry_per_s * step_s, -1.0])
        room = 0.0
        for position, action in enumerate(actions):
            overlap_s = min(action.end_s, t_s + step_s) - max(action.start_s, t_s)
            if overlap_s <= 0.0:
                continue
            if kind[action.opportunity] == CONTACT:
                room += r.downlink_per_s * overlap_s
                continue
            is_last = action.end_s <= t_s + step_s
            queue.append([r.collect_fill_per_s * overlap_s, float(position) if is_last else -1.0])
        while queue and room > 0.0:
            taken = min(room, queue[0][0])
            room -= taken
            queue[0][0] -= taken
            if queue[0][0] <= 1e-12:
                done = queue.popleft()[1]
                if done >= 0.0:
                    down[int(done)] = t_s + step_s
    return down


@pytest.mark.parametrize("seed", range(60))
def test_the_queue_is_that_of_pieces_served_one_after_another(seed: int) -> None:
    problem = random_problem(seed, num_collects=6, num_contacts=3, resources=ROOMY)
    timeline = all_of(problem)
    rng = np.random.default_rng(seed)
    chosen: list[int] = []
    for row in range(len(problem.opportunities)):
        if rng.uniform() < 0.7 and replay(problem, Plan.of(problem, [*chosen, row])).is_valid:
            chosen.append(row)
    plan = Plan.of(problem, chosen)
    timeline = replay(problem, plan)
    found = {
        action.position: action.delivered_s
        for action in timeline.satellites[0].actions
        if action.delivered_s is not None and action.position is not None
    }
    expected = _queue(problem, plan)
    # Whatever arrives in the very last piece of a contact may arrive just before or after its end.
    for position in found.keys() & expected.keys():
        assert found[position] == pytest.approx(expected[position], abs=0.2)
    near_an_end = [
        p for p in found.keys() ^ expected.keys() if not _is_close(problem, plan, found, p)
    ]
    assert not near_an_end


def _is_close(problem: Problem, plan: Plan, found: dict[int, float], position: int) -> bool:
    """Return whether an image is finished as a contact ends, which pieces are too coarse for."""
    kind = problem.opportunities.kind
    ends = [a.end_s for a in plan.actions if kind[a.opportunity] == CONTACT]
    return position in found and any(abs(found[position] - end) < 0.2 for end in ends)


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@pytest.mark.parametrize("seed", range(40))
def test_no_image_is_younger_than_it_can_be(seed: int, dynamics: Dynamics) -> None:
    problem = random_problem(
        seed,
        num_collects=8,
        num_contacts=3,
        resources=TIGHT,
        dynamics=dynamics,
        has_quality=True,
    )
    least_s = least_age_s(problem)
    objective = Objective(collected_share=0.3, half_life_s=200.0)
    made = with_objective(problem, objective)
    rng = np.random.default_rng(seed)
    for _ in range(10):
        rows = np.flatnonzero(rng.uniform(size=len(problem.opportunities)) < 0.6)
        plan = Plan.of(problem, rows)
        timeline = replay(made, plan)
        for action in timeline.satellites[0].actions:
            if action.delivered_s is not None and timeline.is_valid:
                assert action.delivered_s - action.end_s >= least_s[action.opportunity]
        if timeline.is_valid:
            assert timeline.reward <= made.worth_of(rows) + 1e-9
