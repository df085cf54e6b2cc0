"""Plans: what a solver answers, before anyone has judged it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from planner_core.problem import Problem


@dataclass(frozen=True, slots=True, order=True)
class Action:
    """One task: an opportunity of the problem, taken from ``start_s`` to ``end_s``."""

    start_s: float
    end_s: float
    opportunity: int


@dataclass(frozen=True, slots=True)
class Plan:
    """Actions of all satellites, in order of start. The empty plan is a plan."""

    actions: tuple[Action, ...] = ()

    @classmethod
    def of(cls, problem: Problem, opportunities: Iterable[int]) -> Plan:
        """Return the plan that takes these opportunities at their own times."""
        table = problem.opportunities
        return cls(
            tuple(
                sorted(
                    Action(float(table.start_s[i]), float(table.end_s[i]), int(i))
                    for i in opportunities
                )
            )
        )

    def with_kept(self, problem: Problem) -> Plan:
        """Return the plan with all that must be taken, at its own times."""
        taken = {action.opportunity for action in self.actions}
        missing = [row for row in problem.kept_rows.tolist() if row not in taken]
        return Plan(tuple(sorted((*self.actions, *Plan.of(problem, missing).actions))))
