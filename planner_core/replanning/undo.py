"""Changes taken back that gain nothing.

A change is a connected part of the symmetric difference of two plans: actions that image the same
target, or that cannot stand in one plan. The smallest parts are tried first. Each is taken back
where the referee finds the plan as valid and its worth, changes counted, no less.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner_core.budget import Budget
from planner_core.precedence.conflicts import conflicts
from planner_core.problem import COLLECT
from planner_core.problem.plan import Plan
from planner_core.replanning.question import Question

_EQUAL = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A connected part of the difference: rows that a plan has anew, and rows that it dropped."""

    added: frozenset[int]
    removed: frozenset[int]

    def __len__(self) -> int:
        return len(self.added) + len(self.removed)


def parts_of(question: Question, plan: Plan) -> list[Part]:
    """Return what tells a plan from the base, in connected parts, the smallest first."""
    taken = {action.opportunity for action in plan.actions}
    base = set(question.base.tolist())
    added, removed = taken - base, base - taken
    left = added | removed
    parts = []
    while left:
        found, open_ = set(), {min(left)}
        while open_:
            row = open_.pop()
            found.add(row)
            left.discard(row)
            others = removed if row in added else added
            open_ |= set(_linked(question, row, others & left))
        parts.append(Part(added=frozenset(found & added), removed=frozenset(found & removed)))
    return sorted(parts, key=lambda part: (len(part), min(part.added | part.removed)))


def _linked(question: Question, row: int, others: set[int]) -> Iterator[int]:
    """Yield the rows of the other plan that ``row`` came for, or gave way to."""
    table = question.problem.opportunities
    blocked = set(conflicts(question.problem, row, sorted(others)))
    for other in others:
        is_same = (
            table.kind[row] == table.kind[other] == COLLECT and table.site[row] == table.site[other]
        )
        if is_same or other in blocked:
            yield other


def undone(question: Question, plan: Plan, budget: Budget) -> Plan:
    """Return the plan with every part of its difference taken back that gains nothing."""
    is_better = True
    while is_better:
        is_better = False
        for part in parts_of(question, plan):
            if budget.is_spent():
                return plan
            least = value(question, plan) - _EQUAL
            trial = without(question, plan, part, least)
            if trial is not None and value(question, trial) >= least:
                plan, is_better = trial, True
    return plan


def within_share(question: Question, plan: Plan, budget: Budget) -> Plan:
    """Return the plan with changes taken back that gain least, until few enough are left.

    Once the time is over whichever comes first: the share holds all the same.
    """
    share = question.stability.max_changed_share
    while share is not None and question.changed(plan) > share * question.num_base:
        num_changed = question.changed(plan)
        trials = (without(question, plan, part) for part in parts_of(question, plan))
        fewer = (t for t in trials if t is not None and question.changed(t) < num_changed)
        if budget.is_spent():
            found = next(fewer, None)
        else:
            found = max(fewer, key=lambda trial: value(question, trial), default=None)
        if found is None:
            break
        plan = found
    return plan


def without(question: Question, plan: Plan, part: Part, least: float = -math.inf) -> Plan | None:
    """Return the plan without a part of its difference.

    None where that breaks something, or where what is taken cannot be worth ``least``: of 102 parts
    of a good plan the referee need see a few only.
    """
    problem = question.problem
    if any(row in problem.kept_rows for row in part.added):
        return None
    taken = {action.opportunity for action in plan.actions}
    trial = Plan.of(problem, (taken - part.added) | part.removed)
    rows = np.array([action.opportunity for action in trial.actions], dtype=np.int32)
    if problem.worth_of(rows) + question.stable_worth(trial) < least:
        return None
    if len(question.missing(trial)) > len(question.missing(plan)):
        return None
    return trial if question.may_fly(trial) else None


def value(question: Question, plan: Plan) -> float:
    """Return what a plan earns, and what its kept actions count."""
    return question.judged(plan).reward + question.stable_worth(plan)
