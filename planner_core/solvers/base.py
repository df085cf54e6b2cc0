"""What a solver is, what it may spend, and what it answers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, Literal, Protocol

import numpy as np

from planner_core.bounds.bound import Bound
from planner_core.plan import Plan
from planner_core.problem import Bytes, Problem

Feasibility = Literal["hard", "penalty"]
BreadthCounts = Literal["tasks", "one_more"]
ContactCounts = Literal["duration", "wait"]
ImageNeeds = Literal["nothing", "limits", "room"]


class Constraint(StrEnum):
    """A rule of the plan model that a solver may or may not respect by itself."""

    SLEW = "slew"
    STATION = "station"
    BATTERY = "battery"
    RECORDER = "recorder"
    DUPLICATE = "duplicate"


class Termination(StrEnum):
    """Why a search ended."""

    OPTIMAL = "optimal"
    GAP_REACHED = "gap_reached"
    TIME_LIMIT = "time_limit"
    ITERATION_LIMIT = "iteration_limit"
    HORIZON_COMPLETE = "horizon_complete"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far the work is. ``fraction`` counts within the phase, 0 to 1."""

    phase: Literal["access", "compile", "solve", "verify"]
    fraction: float
    reward: float | None = None
    bound: float | None = None
    message: str = ""


def _ignore(_: Progress) -> None:
    pass


class Budget:
    """Time and patience left for one job; the only clock in the core.

    Parameters
    ----------
    time_s
        Seconds from now, or None for no limit.
    report
        Called with each progress report.
    num_threads
        How many threads may work at a time. What comes out does not depend on it, but for how
        far a search gets before its time is over.

    Attributes
    ----------
    stop
        One byte that kernels read inside long loops: not 0 means "stop now". Whoever
        cancels sets it through ``cancel``, from any thread. Shape ``(1,)``.
    """

    def __init__(
        self,
        time_s: float | None = None,
        report: Callable[[Progress], None] = _ignore,
        num_threads: int = 1,
    ):
        self.stop: Bytes = np.zeros(1, dtype=np.uint8)
        self.report = report
        self.num_threads = num_threads
        self._deadline = None if time_s is None else time.monotonic() + time_s
        self._cancelled = False

    def cancel(self) -> None:
        """Ask the work to stop; safe to call from another thread."""
        self._cancelled = True
        self.stop[0] = 1

    def expire(self) -> None:
        """Stop kernels because the time is over (they cannot read a clock themselves)."""
        self._deadline = time.monotonic()
        self.stop[0] = 1

    @property
    def is_cancelled(self) -> bool:
        """Whether someone asked the work to stop."""
        return self._cancelled

    def is_spent(self) -> bool:
        """Return whether the work should stop now and answer with the best it has."""
        # Budgets for a part of the work share the stop byte of the whole.
        return bool(self.stop[0]) or (
            self._deadline is not None and time.monotonic() >= self._deadline
        )

    def remaining_s(self) -> float | None:
        """Return the seconds left, or None where there is no limit."""
        return None if self._deadline is None else max(0.0, self._deadline - time.monotonic())

    def termination(self) -> Termination:
        """Return why a spent budget ended the search."""
        return Termination.CANCELLED if self._cancelled else Termination.TIME_LIMIT

    def ending(self, *, is_optimal: bool, is_close: bool) -> Termination:
        """Return why a search for plan and bound has ended: by what it found, or by the budget."""
        if is_optimal:
            return Termination.OPTIMAL
        if is_close:
            return Termination.GAP_REACHED
        return self.termination() if self.is_spent() else Termination.HORIZON_COMPLETE


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """A plan and how the search ended. It has no reward: only the referee awards that.

    Attributes
    ----------
    proven
        What the search has proven on the way: no valid plan of the problem earns more. None
        where it has proven nothing.
    """

    plan: Plan
    termination: Termination
    statistics: Mapping[str, float] = field(default_factory=dict)
    proven: Bound | None = None

    @property
    def bound(self) -> float | None:
        """The value of what is proven."""
        return None if self.proven is None else self.proven.value


class Solver(Protocol):
    """A frozen dataclass whose fields are its parameters, and nothing else.

    Attributes
    ----------
    name, title, paper
        How it is called in the API; what it is; where the paper describes it.
    exact
        Whether it proves its plan optimal when it runs to the end.
    honours
        The rules that its plans never break, whatever the problem.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    paper: ClassVar[str]
    exact: ClassVar[bool]
    honours: ClassVar[frozenset[Constraint]]

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the best plan found before the budget is spent."""
        ...
