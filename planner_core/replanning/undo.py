"""Changes that gain nothing are undone.

A change is a connected part of the symmetric difference of two plans, whose links are actions that
image the same target or conflict. The smallest parts are tried first. A part is undone if the
referee finds the result valid and its worth, kept actions counted, no less.
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
    """A connected part of the difference: the rows that a plan adds, and those that it drops."""

    added: frozenset[int]
    removed: frozenset[int]

    def __len__(self) -> int:
        return len(self.added) + len(self.removed)


def parts_of(question: Question, plan: Plan) -> list[Part]:
    """Return the difference between a plan and the base in connected parts, smallest first."""
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
    """Yield the rows of the other plan that ``row`` replaced, or that replaced it."""
    table = question.problem.opportunities
    blocked = set(conflicts(question.problem, row, sorted(others)))
    for other in others:
        is_same = (
            table.kind[row] == table.kind[other] == COLLECT and table.site[row] == table.site[other]
        )
        if is_same or other in blocked:
            yield other


def undone(question: Question, plan: Plan, budget: Budget) -> Plan:
    """Return the plan with every part of its difference undone that gains nothing."""
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
    """Return the plan with the changes undone that gain least, until few enough are left.

    Once time is up, the first that can be undone is: the share must hold anyway.
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
    """Return the plan with a part of its difference undone.

    None if that breaks something, or if the rows left cannot be worth ``least``: so the referee
    need replay only a few of the 102 parts of a good plan.
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
    """Return what a plan earns plus the bonus of its kept actions."""
    return question.judged(plan).reward + question.stable_worth(plan)
