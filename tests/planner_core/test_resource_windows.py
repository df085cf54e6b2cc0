"""Window search under battery and recorder: plans valid, never worse, and near the optimum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.budget import Budget, Progress
from planner_core.certified.lns import resource_search
from planner_core.certified.lns.alternating import AlternatingSearch
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.proofs.documents import from_json, is_proven, to_json
from planner_core.certified.tuning import TUNING, tuned
from planner_core.domain import Agility
from planner_core.problem import Kept, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified, Rule
from tests.examples import examples
from tests.planner_core.brute_force import best_reward
from tests.planner_core.problems import TIGHT, random_problem, sunny_problem, varied_problem

SEEDS = st.integers(0, 10**6)
STARVED = replace(TIGHT, battery_min_fraction=0.5, initial_battery_fraction=0.62)
_problem = partial(varied_problem, scarce=STARVED)
Dynamics = Literal["physical", "paper"]


@pytest.mark.parametrize("slew_rate_deg_s", [1.0, 0.3])
@examples(60)
@given(
    seed=SEEDS, dynamics=st.sampled_from(["physical", "paper"]),
    num_satellites=st.integers(1, 3), has_rewards=st.booleans(),
    has_quality=st.booleans(), num_offers=st.sampled_from([1, 3]), num_kept=st.integers(0, 2),
)  # fmt: skip
def test_plans_stay_valid_and_never_get_worse(
    slew_rate_deg_s: float,
    seed: int,
    dynamics: Dynamics,
    num_satellites: int,
    has_rewards: bool,
    has_quality: bool,
    num_offers: int,
    num_kept: int,
) -> None:
    problem = random_problem(
        seed, num_collects=30, num_targets=15, num_contacts=6, num_satellites=num_satellites,
        dynamics=dynamics, has_rewards=has_rewards, has_quality=has_quality, max_turn_deg=25.0,
        num_offers=num_offers, agility=Agility(slew_rate_deg_s=slew_rate_deg_s),
    )  # fmt: skip
    first = Rule().solve(problem, Budget(), 0).plan
    must = [action.opportunity for action in first.actions[:num_kept]]
    kept = tuple(Kept(row=row, pointer=f"/pins/keep/{i}") for i, row in enumerate(must))
    problem = replace(problem, pinned=Pinned(kept=kept))
    start = replay(problem, first)
    search = ResourceWindows(problem, seed)
    search.adopt(first)
    assert search.plan == first
    search.make_moves(400, Budget())
    timeline = replay(problem, search.plan)
    search.anneal(20, Budget())
    annealed = replay(problem, search.plan)
    if start.is_valid:
        assert not timeline.violations
        assert not annealed.violations
        assert annealed.reward >= timeline.reward - 1e-9 >= start.reward - 2e-9
        assert search.reward == pytest.approx(annealed.reward)
        assert set(must) <= {action.opportunity for action in search.plan.actions}
    again = ResourceWindows(problem, seed)
    again.adopt(first)
    again.make_moves(400, Budget())
    again.anneal(20, Budget())
    assert again.plan == search.plan


def test_small_problems_end_at_the_optimum() -> None:
    reached = 0
    for seed in range(30):
        problem = _problem(seed, "physical" if seed % 2 else "paper", 1 + seed % 3)
        start = Rule().solve(problem, Budget(), 0).plan
        search = AlternatingSearch(problem, start, 1.0, Budget(), seed)
        search.step(5)
        timeline = replay(problem, search.plan)
        assert timeline.is_valid
        reached += timeline.reward == best_reward(problem)
    assert reached >= 27


def test_windows_better_a_plan_that_the_rule_leaves() -> None:
    gained = 0.0
    for seed in range(5):
        problem = random_problem(
            seed, num_collects=200, num_targets=80, num_contacts=12, num_satellites=2,
            span_s=5000.0,
        )  # fmt: skip
        problem = replace(problem, horizon_s=5100.0)
        start = Rule().solve(problem, Budget(), 0).plan
        search = ResourceWindows(problem, 0)
        search.adopt(start)
        before = search.reward
        search.make_moves(2000, Budget())
        assert not replay(problem, search.plan).violations
        gained += search.reward / before
    assert gained / 5 > 1.1


def test_noise_leads_further_where_images_differ_in_worth() -> None:
    plain, noisy = 0.0, 0.0
    for seed in range(5):
        problem = random_problem(
            seed, num_collects=300, num_targets=120, num_contacts=12, num_satellites=3,
            span_s=5000.0, has_quality=True,
        )  # fmt: skip
        problem = replace(problem, horizon_s=5100.0)
        start = Rule().solve(problem, Budget(), 0).plan
        one, other = ResourceWindows(problem, 0), ResourceWindows(problem, 0)
        one.adopt(start)
        other.adopt(start)
        other.anneal(200, Budget())
        for _ in range(TUNING.rounds):  # the same number of moves
            one.make_moves_on_each(200, Budget())
        plain, noisy = plain + one.reward, noisy + other.reward
    assert noisy > 1.005 * plain


def test_a_search_that_is_stopped_keeps_its_plan() -> None:
    problem = random_problem(3, num_collects=60, num_targets=30, num_contacts=6)
    budget = Budget()
    budget.cancel()
    search = ResourceWindows(problem, 0)
    plan = Rule().solve(problem, Budget(), 0).plan
    search.adopt(plan)
    search.make_moves(1000, budget)
    search.anneal(1000, budget)
    assert search.plan == plan


def test_a_search_that_is_stopped_amid_noise_keeps_the_better_plan() -> None:
    problem = random_problem(
        3, num_collects=200, num_targets=80, num_contacts=12, num_satellites=2, has_quality=True
    )
    search = ResourceWindows(problem, 0)
    search.adopt(Rule().solve(problem, Budget(), 0).plan)
    search.anneal(200, Budget())
    plan, looks = search.plan, iter(range(100))

    class EndsAmidNoise(Budget):
        def is_spent(self) -> bool:
            return next(looks) >= 2

    search.anneal(200, EndsAmidNoise())
    assert search.plan == plan


def test_a_satellite_without_tasks_has_no_moves() -> None:
    problem = random_problem(3, num_collects=0, num_contacts=0, num_satellites=2)
    search = ResourceWindows(problem, 0)
    search.make_moves(100, Budget())
    assert search.plan == Plan()


@pytest.mark.parametrize("dynamics", ["physical", "paper"])
@examples(60)
@given(seed=SEEDS, num_satellites=st.integers(2, 3))
def test_fleets_end_with_a_plan_and_a_bound_around_the_optimum(
    dynamics: Dynamics, seed: int, num_satellites: int
) -> None:
    with tuned(large=3, fleet_patience=5, epochs=40):
        problem = _problem(seed, dynamics, num_satellites)
        best = best_reward(problem)
        reported: list[Progress] = []
        budget = Budget()
        budget.report = reported.append
        solution = Certified().solve(problem, budget, 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert timeline.reward <= best + 1e-6
    assert solution.proven is not None
    assert solution.proven.value >= best - 1e-6
    assert is_proven(problem, from_json(to_json(solution.proven))) is not False
    assert all(p.bound is not None and p.bound >= best - 1e-6 for p in reported)
    assert np.all(np.diff([p.reward or 0.0 for p in reported]) >= 0.0)


def test_less_than_a_move_on_each_satellite_is_one_on_some_in_turn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = random_problem(0, num_satellites=3, num_collects=30, num_targets=20)
    windows = ResourceWindows(problem, 0)
    moved: list[tuple[int, int]] = []
    monkeypatch.setattr(
        resource_search, "make_moves",
        lambda ground, taken, room, draws, num, stop: moved.append((ground.number, num)),
    )  # fmt: skip
    for num_moves in (4.7, 0.7, 0.7, 0.4, 0.01):
        windows.make_moves_on_each(num_moves, Budget())
    assert moved == [(0, 4), (1, 4), (2, 4), (0, 1), (1, 1), (2, 1), (0, 1), (1, 1), (2, 1)]


@pytest.mark.parametrize(
    ("drawn", "is_dense", "num_satellites", "num_days", "num_steps"),
    [
        (random_problem, False, 2, 2, 1),
        (sunny_problem, False, 2, 4, 4),
        (sunny_problem, False, 5, 5, 4),
        (sunny_problem, True, 2, 16, 1),
    ],
)
def test_windows_have_more_steps_where_images_come_in_batches_that_are_not_dense(
    monkeypatch: pytest.MonkeyPatch,
    drawn: Callable[..., Problem],
    is_dense: bool,
    num_satellites: int,
    num_days: int,
    num_steps: int,
) -> None:
    problem = drawn(1, num_collects=40, num_contacts=4, num_satellites=num_satellites)
    days, moves = list[int](), list[int]()
    with tuned(dense=1 if is_dense else 1000):
        search = AlternatingSearch(problem, Plan(), 1.0, Budget(), 0)
    search.step(1)
    monkeypatch.setattr(ChoiceSearch, "move", lambda _: days.append(1))
    monkeypatch.setattr(ResourceWindows, "make_moves", lambda _, number, __: moves.append(number))
    search.step(1)
    assert len(days) == num_days
    assert moves == [num_steps * TUNING.moves_in_a_step * num_satellites]
