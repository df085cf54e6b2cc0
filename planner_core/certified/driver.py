"""One driver for all problems: the strategy that gained most goes on.

A strategy improves the plan or lowers the bound, one slice of work at a time. The gain of a slice
is how much it narrows the distance between plan and bound. The next slice goes to the strategy
whose latest slice gained most, so that work goes to whichever of bound and plan is further off.
All slices take about the same time. They are not timed, so that the same seed gives the same plan
(docs/decisions/0012-one-driver.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Protocol, TypeAlias, TypeVar, cast

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.solvers.base import Solution


class Begin(Enum):
    """When a strategy has its first slice."""

    ALWAYS = auto()
    """At once, even if the budget is spent: no answer can do without it."""
    NEXT = auto()
    """Once those listed before it have begun."""
    STALLED = auto()
    """Once all that have begun are stalled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much is done before HiGHS is called for the rest.

    Attributes
    ----------
    moves_per_task
        Moves of the window search for each opportunity.
    max_rounds
        Rounds of cutting planes.
    """

    moves_per_task: float = 30.0
    max_rounds: int = 200


Slices: TypeAlias = Callable[["Search"], Iterator[None]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Strategy:
    """One way to improve the plan or to lower the bound.

    Attributes
    ----------
    supports
        Whether it is for a problem.
    slices
        Does the work, and yields after each slice; ends when more work would be of no use.
    begin
        When it has its first slice.
    patience
        After how many slices in a row without a gain it is stalled; None if it ends by itself.
    """

    name: str
    supports: Callable[[Problem], bool]
    slices: Slices
    begin: Begin = Begin.NEXT
    patience: Callable[[], int] | None = None


class Engine(Protocol):
    """State about one incumbent, which strategies share."""

    def __init__(self, best: Incumbent, seed: int) -> None: ...


E = TypeVar("E", bound=Engine)


@dataclass(eq=False)
class Search:
    """What the strategies of one search share.

    Attributes
    ----------
    like
        The problem that strategies must support; by default the one that is planned.
    num_idle
        How many slices in a row have gained nothing.
    proof
        Returns the bound with its whole proof, if that is put together only at the end.
    """

    best: Incumbent
    seed: int
    strategies: Sequence[Strategy]
    effort: Effort = field(default_factory=Effort)
    like: Problem | None = None
    num_idle: int = 0
    proof: Callable[[], Bound] | None = None
    _engines: dict[type, object] = field(default_factory=dict)

    @property
    def problem(self) -> Problem:
        """The problem that is planned."""
        return self.best.problem

    @property
    def budget(self) -> Budget:
        """The time that may be spent."""
        return self.best.budget

    def engine(self, kind: type[E]) -> E:
        """Return the engine of this kind, the same one for all strategies."""
        if kind not in self._engines:
            self._engines[kind] = kind(self.best, self.seed)
        return cast(E, self._engines[kind])

    def beside(
        self,
        best: Incumbent,
        seed: int,
        *,
        like: Problem | None = None,
        without: Slices | None = None,
        only: Sequence[Slices] | None = None,
    ) -> Search:
        """Return a search about another incumbent, with all strategies but one, or with a few."""
        strategies = [
            one
            for one in self.strategies
            if one.slices is not without and (only is None or one.slices in only)
        ]
        return Search(best, seed, strategies, like=like)

    @property
    def is_promising(self) -> bool:
        """Whether any strategy has gained anything recently."""
        return self.num_idle < TUNING.rounds

    def solved(self) -> Solution:
        """Search until plan and bound are close enough, the budget is spent or strategies end."""
        for _ in close_in(self):
            pass
        return self.best.solution(self.proof() if self.proof else None)


class ActiveStrategy:
    """A strategy that has begun."""

    def __init__(self, strategy: Strategy, search: Search) -> None:
        self._patience, self._best = strategy.patience, search.best
        self._slices = strategy.slices(search)
        self.name = strategy.name
        self.gain, self.num_waits, self.num_idle = 0.0, 0, 0
        self.has_ended = False

    @property
    def is_stalled(self) -> bool:
        """Whether its latest slices have gained nothing."""
        return self._patience is not None and self.num_idle >= self._patience()

    def go_on(self) -> None:
        """Do a slice."""
        before = self._best.distance
        self.has_ended = next(self._slices, self) is self
        self.gain, self.num_waits = before - self._best.distance, 0
        trifle = TUNING.trifle * self._best.problem.typical_worth
        self.num_idle = 0 if self.gain > trifle else self.num_idle + 1


def close_in(search: Search) -> Iterator[None]:
    """Run slices of the strategies until plan and bound meet, each chosen by the latest gains.

    No strategy waits for more than a few slices of others. Yields after each slice: a search beside
    another is a strategy of that one, and each of its slices counts as one there.
    """
    like = search.problem if search.like is None else search.like
    left = [one for one in search.strategies if one.supports(like)]
    active: list[ActiveStrategy] = []
    while left or active:
        if search.best.is_done and not (left and left[0].begin is Begin.ALWAYS):
            return
        is_next = left and left[0].begin is not Begin.STALLED
        if is_next or (left and all(one.is_stalled for one in active)):
            active.append(ActiveStrategy(left.pop(0), search))
            chosen = active[-1]
        else:
            chosen = _chosen(active)
        for one in active:
            one.num_waits += 1
        reward = search.best.reward
        chosen.go_on()
        search.num_idle = 0 if chosen.num_idle == 0 else search.num_idle + 1
        if search.best.reward > reward:
            for one in active:
                one.num_idle = 0
        active = [one for one in active if not one.has_ended]
        if not chosen.has_ended:
            yield


def slices_beyond_the_first_plan(search: Search) -> Iterator[None]:
    """Close in; yield after each slice once the plan is better than the first, the rule's.

    What other strategies make of that first plan is worse, and takes as long. If it remains the
    best for some slices, they get it after all.
    """
    first = np.inf
    for number, _ in enumerate(close_in(search)):
        first = min(first, search.best.reward)
        if search.best.reward > first or number >= TUNING.patience:
            yield


def _chosen(active: Sequence[ActiveStrategy]) -> ActiveStrategy:
    """Return the strategy that has waited too long, or else that has gained most."""
    going = [one for one in active if not one.is_stalled] or active
    longest = max(going, key=lambda one: one.num_waits)
    if longest.num_waits >= TUNING.several:
        return longest
    return max(going, key=lambda one: (one.gain, one.num_waits))
