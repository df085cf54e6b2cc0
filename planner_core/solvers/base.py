"""What a solver is, what it may spend, and what it returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, Literal, Protocol

from planner_core.budget import Budget, Termination
from planner_core.certified.proofs.bound import Bound
from planner_core.problem import Problem
from planner_core.problem.plan import Plan

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Solution:
    """A plan and how the search ended. It has no reward: only the referee awards that.

    Attributes
    ----------
    proven
        A bound that the search has proven on the way: no valid plan of the problem earns more.
        None if it has proven none.
    """

    plan: Plan
    termination: Termination
    statistics: Mapping[str, float] = field(default_factory=dict)
    proven: Bound | None = None

    @property
    def bound(self) -> float | None:
        """The value of the bound that is proven."""
        return None if self.proven is None else self.proven.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlook:
    """Which actions of a state a search considers.

    Attributes
    ----------
    breadth
        How many tasks at most; None for all.
    contact_above
        Recorder level, as a fraction, from which on contacts are among them.
    """

    breadth: int | None = None
    contact_above: float = 0.0


class Solver(Protocol):
    """A frozen dataclass whose fields are its parameters, and nothing else.

    Attributes
    ----------
    name, title, about, paper
        Its name in the API; what it is; what it does and when to choose it, for those who operate
        satellites; where the paper describes it.
    exact
        Whether it proves its plan optimal when it runs to the end.
    bounds
        Whether it computes bounds itself from the start, so that a quick bound after it adds
        nothing.
    honours
        The rules that its plans never break, whatever the problem.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    about: ClassVar[str]
    paper: ClassVar[str]
    exact: ClassVar[bool]
    bounds: ClassVar[bool]
    honours: ClassVar[frozenset[Constraint]]

    @property
    def outlook(self) -> Outlook:
        """Which actions it considers."""
        ...

    def solve(self, problem: Problem, budget: Budget, seed: int) -> Solution:
        """Return the best plan found before the budget is spent."""
        ...
