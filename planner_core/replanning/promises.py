"""Promised targets: make room for their images, or raise an error that says why not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.errors import InvalidScenario
from planner_core.precedence.conflicts import conflicts
from planner_core.problem import COLLECT, CONTACT
from planner_core.problem.plan import Plan
from planner_core.replanning.question import Question
from planner_core.replanning.repair import repaired
from planner_core.replanning.undo import value


def with_promised(question: Question, plan: Plan) -> Plan:
    """Return the plan with an image of each promised target for which there can be room."""
    problem = question.problem
    kept = set(problem.kept_rows.tolist())
    protected = set(np.flatnonzero(question.is_promised).tolist())
    for target in sorted(question.missing(plan)):
        taken = [action.opportunity for action in plan.actions]
        trials = []
        for row in problem.collects_of(target).tolist():
            gone = set(conflicts(problem, row, taken))
            if gone & (kept | protected):
                continue
            trial = repaired(problem, [*(set(taken) - gone), row], protected)
            if target not in question.missing(trial) and question.may_fly(trial):
                trials.append(trial)
        fewer = [t for t in trials if len(question.missing(t)) < len(question.missing(plan))]
        plan = max(fewer, key=lambda trial: value(question, trial), default=plan)
    for target in sorted(question.missing(plan) & question.deadline_s.keys()):
        plan = _with_downlink(question, plan, target)
    return plan


def _with_downlink(question: Question, plan: Plan, target: int) -> Plan:
    """Return the plan with a contact that delivers an image of a target in time, if any does.

    If the current image is too late for that, another one replaces it.
    """
    problem = question.problem
    table, kept = problem.opportunities, set(problem.kept_rows.tolist())
    taken = [action.opportunity for action in plan.actions]
    own = [row for row in taken if table.kind[row] == COLLECT and table.site[row] == target]
    images = [*own, *(row for row in problem.collects_of(target).tolist() if row not in own)]
    imaged_by_all = [(int(table.satellite[row]), float(table.end_s[row]), [row]) for row in images]
    imaged_by_all += [(i.satellite, 0.0, []) for i in question.on_board if i.target == target]
    deadline_s = question.deadline_s[target]
    best, fewest = plan, len(question.missing(plan))
    for satellite, from_s, rows in imaged_by_all:
        others = [row for row in taken if row not in own or row in kept or row in rows]
        for contact in problem.satellites[satellite].rows.tolist():
            start_s = table.start_s[contact]
            if table.kind[contact] != CONTACT or not from_s <= start_s <= deadline_s:
                continue
            new = [row for row in (*rows, contact) if row not in others]
            gone = {other for row in new for other in conflicts(problem, row, others)}
            if gone & kept:
                continue
            protected = {*np.flatnonzero(question.is_promised).tolist(), contact}
            trial = repaired(problem, [*(set(others) - gone), *new], protected)
            num_missing = len(question.missing(trial))
            if num_missing < fewest and question.may_fly(trial):
                best, fewest = trial, num_missing
        if fewest < len(question.missing(plan)):
            return best
    return best


def require_promises(question: Question, plan: Plan) -> None:
    """Raise ``promise_not_kept`` if a plan misses a promise."""
    problem, missing = question.problem, question.missing(plan)
    for i, target in enumerate(question.promised):
        if target not in missing:
            continue
        if target in question.deadline_s and target not in replace(question, deadline_s={}).missing(
            plan
        ):
            raise _late(question, plan, target, i)
        why = (
            "each of its opportunities would displace something promised or flown, or break "
            "limits of battery or recorder"
            if len(problem.collects_of(target)) > 0
            else "no opportunity to image it is left"
        )
        raise InvalidScenario(
            "promise_not_kept",
            f"The promised target {problem.target_ids[target]!r} is not imaged: {why}.",
            pointer=f"/replan/promises/{i}",
        )


def _late(question: Question, plan: Plan, target: int, number: int) -> InvalidScenario:
    down_s = question.down_s(plan).get(target)
    name = question.problem.target_ids[target]
    said = (
        "its image is never downlinked"
        if down_s is None
        else f"it is downlinked {down_s - question.deadline_s[target]:.0f} s too late"
    )
    return InvalidScenario(
        "promise_not_kept",
        f"The promised target {name!r} is not delivered in time: {said}, and no earlier contact "
        "would do without displacing what is promised or flown.",
        pointer=f"/replan/promises/{number}/deliver_by",
    )
