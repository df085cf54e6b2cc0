"""Plans: a solver's answer, before the referee has judged it."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner_core.problem import CONTACT, Bools, Floats, Longs, Problem


class Action(NamedTuple):
    """One task: an opportunity of the problem, taken from ``start_s`` to ``end_s``.

    It is a tuple because searches make, sort and compare thousands of them.
    """

    start_s: float
    end_s: float
    opportunity: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Columns:
    """Actions as arrays. Shape ``(n,)`` each."""

    row: Longs
    start_s: Floats
    end_s: Floats

    @classmethod
    def of(cls, actions: Sequence[Action]) -> Columns:
        """Return these actions in their order."""
        fields = itertools.chain.from_iterable(actions)
        table = np.fromiter(fields, np.float64, 3 * len(actions)).reshape(-1, 3)
        start_s, end_s, row = table.T.copy()
        return cls(row=row.astype(np.int64), start_s=start_s, end_s=end_s)

    def at(self, which: Bools | Longs | slice) -> Columns:
        """Return some of the actions."""
        return Columns(row=self.row[which], start_s=self.start_s[which], end_s=self.end_s[which])

    @property
    def order(self) -> Longs:
        """Indices that sort the actions by start, end and row; equal actions keep their order."""
        return np.lexsort((self.row, self.end_s, self.start_s))


@dataclass(frozen=True)
class Plan:
    """Actions of all satellites, in order of start. The empty plan is a plan."""

    actions: tuple[Action, ...] = ()

    @cached_property
    def columns(self) -> Columns:
        """The actions as arrays, kept because the referee reads them again and again."""
        return Columns.of(self.actions)

    @classmethod
    def of(cls, problem: Problem, opportunities: Iterable[int]) -> Plan:
        """Return the plan that takes these opportunities at their own times."""
        table = problem.opportunities
        row = np.array(list(opportunities), dtype=np.int64)
        columns = Columns(row=row, start_s=table.start_s[row], end_s=table.end_s[row])
        ordered = columns.at(columns.order)
        fields = ordered.start_s, ordered.end_s, ordered.row
        return cls(tuple(map(Action, *(field.tolist() for field in fields))))

    def contacts(self, problem: Problem) -> tuple[int, ...]:
        """Return the contacts that the plan takes, ascending."""
        kind = problem.opportunities.kind
        return tuple(sorted(a.opportunity for a in self.actions if kind[a.opportunity] == CONTACT))

    def with_kept(self, problem: Problem) -> Plan:
        """Return the plan with every task that must be taken, missing ones at their own times."""
        taken = {action.opportunity for action in self.actions}
        missing = [row for row in problem.kept_rows.tolist() if row not in taken]
        return Plan(tuple(sorted((*self.actions, *Plan.of(problem, missing).actions))))
