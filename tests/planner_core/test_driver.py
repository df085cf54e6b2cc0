"""The next slice goes to the strategy that gained most, and none is forgotten."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import pytest

from planner_core.budget import Budget, Termination
from planner_core.certified.driver import (
    Begin,
    Effort,
    Search,
    Slices,
    Strategy,
    close_in,
    slices_beyond_the_first_plan,
)
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.strategies.every import STRATEGIES
from planner_core.certified.strategies.resources import tasks_alone
from planner_core.certified.tuning import TUNING
from planner_core.domain import Agility, Objective
from planner_core.problem import Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Solution
from planner_core.solvers.rule import Rule
from tests.planner_core.flat_earth import flat_problem
from tests.planner_core.problems import random_problem


class Log:
    """Record which strategy has a slice."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def gaining(self, name: str, gains: Sequence[float]) -> Slices:
        """Return slices that lower the bound by the given gains, one after the other."""

        def slices(search: Search) -> Iterator[None]:
            for gain in gains:
                self.names.append(name)
                search.best.lower(Bound(value=search.best.distance + search.best.reward - gain,
                                        proof="milp"))  # fmt: skip
                yield

        return slices


def strategy(
    name: str,
    slices: Slices,
    begin: Begin = Begin.NEXT,
    patience: Callable[[], int] | None = None,
    supports: Callable[[Problem], bool] = lambda _: True,
) -> Strategy:
    return Strategy(name=name, supports=supports, slices=slices, begin=begin, patience=patience)


def search_by(strategies: Sequence[Strategy], budget: Budget | None = None) -> Search:
    problem = random_problem(3, use_resources=False, num_collects=30, num_targets=20,
                             has_rewards=True)  # fmt: skip
    best = Incumbent(problem, budget or Budget(), 0.0, bound=Bound(value=1e4, proof="milp"))
    return Search(best, 0, strategies)


def test_who_gained_most_goes_on_and_nobody_waits_for_long() -> None:
    log = Log()
    search_by(
        [
            strategy("a", log.gaining("a", [3.0, 1.0, 1.0])),
            strategy("b", log.gaining("b", [9.0, 9.0, 9.0, 9.0, 9.0, 2.0, 2.0])),
        ]
    ).solved()
    # b gains more, until a has waited for several slices; then b gains less than a.
    waits = "b" * TUNING.several
    assert TUNING.several == 4
    assert "".join(log.names) == "a" + waits + "a" + "bbb" + "a"


def test_some_begin_when_all_others_are_stalled() -> None:
    log = Log()
    search_by(
        [
            strategy("a", log.gaining("a", [5.0, 0.0, 0.0, 0.0]), patience=lambda: 2),
            strategy("z", log.gaining("z", [1.0, 1.0]), Begin.STALLED),
        ]
    ).solved()
    assert "".join(log.names) == "aaazza"


def test_a_better_plan_lets_those_that_stalled_try_again() -> None:
    log = Log()

    def better(search: Search) -> Iterator[None]:
        log.names.append("z")
        search.best.offer(Rule().solve(search.problem, Budget(), 0).plan)
        yield

    search_by(
        [
            strategy("a", log.gaining("a", [0.0] * 4), patience=lambda: 1),
            strategy("z", better, Begin.STALLED),
            strategy("y", log.gaining("y", [0.0]), Begin.STALLED),
        ]
    ).solved()
    assert "".join(log.names).startswith("azay")


def test_what_an_answer_needs_is_done_whatever_the_time() -> None:
    log = Log()
    budget = Budget()
    budget.cancel()
    search_by(
        [
            strategy("a", log.gaining("a", [1.0, 1.0]), Begin.ALWAYS),
            strategy("b", log.gaining("b", [1.0]), Begin.ALWAYS),
            strategy("c", log.gaining("c", [1.0])),
        ],
        budget,
    ).solved()
    assert log.names == ["a", "b"]


def test_a_strategy_is_asked_for_the_problems_that_it_supports_alone() -> None:
    log = Log()
    search = search_by(
        [
            strategy("a", log.gaining("a", [1.0]), supports=lambda p: p.use_resources),
            strategy("b", log.gaining("b", [1.0])),
        ]
    )
    search.solved()
    assert log.names == ["b"]
    without = search.beside(search.best, 1, without=search.strategies[1].slices)
    assert [one.name for one in without.strategies] == ["a"]


def test_the_slices_of_a_search_beside_are_slices_of_a_strategy() -> None:
    log = Log()
    inner = [
        strategy("x", log.gaining("x", [1.0, 1.0])),
        strategy("y", log.gaining("y", [2.0, 2.0])),
    ]

    def beside(search: Search) -> Iterator[None]:
        for _ in close_in(Search(search.best, 1, inner)):
            log.names.append("|")
            yield

    search_by([strategy("a", log.gaining("a", [1.5] * 3)), strategy("b", beside)]).solved()
    # In the inner search x and y begin and y gains more. For the outer search that is b's gain.
    assert "".join(log.names) == "ax|aay|y|x|"


def test_who_is_beside_a_search_gets_its_first_plan_only_where_none_is_better() -> None:
    """A proof that the first plan is the best may take all the time there is."""
    log = Log()

    def better(search: Search) -> Iterator[None]:
        for _ in range(3):
            yield
        search.best.offer(Rule().solve(search.problem, Budget(), 0).plan)
        yield
        yield

    proving = log.gaining("x", [1.0] * (TUNING.patience + 3))
    assert len(list(slices_beyond_the_first_plan(search_by([strategy("x", proving)])))) == 3
    assert len(list(slices_beyond_the_first_plan(search_by([strategy("y", better)])))) == 2


def test_engines_are_shared() -> None:
    class Counter:
        def __init__(self, best: Incumbent, seed: int) -> None:
            self.began = (best, seed)

    search = search_by([])
    assert search.engine(Counter) is search.engine(Counter)
    assert search.engine(Counter).began == (search.best, search.seed)


MOVING: Final = Agility(slew_model="moving", acceleration_deg_s2=0.1)


def _late(problem: Problem, share: float = 0.0) -> Problem:
    return with_objective(problem, Objective(collected_share=share, half_life_s=3000.0))


KINDS: Final = {
    "agility": random_problem(1, use_resources=False, num_collects=20),
    "choice": random_problem(1, use_resources=False, num_collects=20, num_offers=2),
    "fleet": random_problem(1, use_resources=False, num_collects=20, num_satellites=2),
    "fleet with a choice": random_problem(1, use_resources=False, num_collects=20, num_offers=2,
                                          num_satellites=2),
    "limits": random_problem(1, num_collects=20, num_contacts=2),
    "fleet with limits": random_problem(1, num_collects=20, num_contacts=2, num_satellites=2),
    "limits in motion": random_problem(1, num_collects=20, num_contacts=2, agility=MOVING),
    "motion alone": random_problem(1, num_collects=20, use_resources=False, agility=MOVING),
    "fleet in motion": random_problem(1, num_collects=20, num_contacts=2, num_satellites=2,
                                      agility=MOVING),
    "aging": _late(random_problem(1, num_collects=20, num_contacts=2)),
    "aging on board": _late(random_problem(2, num_collects=20, num_contacts=2), 0.5),
    "aging fleet": _late(random_problem(1, num_collects=20, num_contacts=2, num_satellites=2)),
    "continuous starts": flat_problem(1, num_targets=8),
    "continuous starts with limits": flat_problem(
        1, num_targets=8, num_contacts=2, use_resources=True, spacing_s=60.0
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_problem_has_strategies_for_plans_and_for_bounds(kind: str) -> None:
    problem = KINDS[kind]
    best = Incumbent(problem, Budget(), 0.0, Plan(), Bound(value=1e9, proof="milp"),
                     covers_starts=True)  # fmt: skip
    solution = Search(best, 0, STRATEGIES, Effort(moves_per_task=5.0)).solved()
    assert best.is_valid
    assert best.reward > 0.0
    assert solution.proven is not None
    assert best.reward <= solution.proven.value <= problem.best_worth.sum() + 1e-6


@pytest.mark.parametrize(
    ("kind", "left_out"),
    [(kind, one) for kind in KINDS for one in STRATEGIES if one.supports(KINDS[kind])],
    ids=lambda value: value.name if isinstance(value, Strategy) else value,
)
def test_no_strategy_needs_another(kind: str, left_out: Strategy) -> None:
    best = Incumbent(KINDS[kind], Budget(), 0.0, Plan(), Bound(value=1e9, proof="milp"),
                     covers_starts=True)  # fmt: skip
    others = [one for one in STRATEGIES if one is not left_out]
    solution = Search(best, 0, others, Effort(moves_per_task=5.0)).solved()
    assert best.is_valid
    assert solution.proven is not None
    assert best.reward <= solution.proven.value


def test_every_strategy_of_the_list_has_a_problem_and_a_name_of_its_own() -> None:
    large = {"windows of a large fleet", "plans without the half-life"}
    used = {one.name for one in STRATEGIES for kind in KINDS.values() if one.supports(kind)}
    assert used | large == {one.name for one in STRATEGIES}
    assert len({one.name for one in STRATEGIES}) == len(STRATEGIES)


def test_agility_alone_is_asked_by_its_own_strategies(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the strategies for limits it would call agility-only planning again, without end."""
    began: list[list[str]] = []

    def solved(search: Search) -> Solution:
        assert search.like is not None
        began.append([one.name for one in search.strategies if one.supports(search.like)])
        return Solution(plan=Plan(), termination=Termination.HORIZON_COMPLETE)

    monkeypatch.setattr(Search, "solved", solved)
    for kind in ("limits", "limits in motion"):
        tasks_alone(Search(Incumbent(KINDS[kind], Budget(), 0.0), 0, STRATEGIES))
    assert began == [["rule", "multipliers of paths", "windows", "cutting planes"]] * 2
