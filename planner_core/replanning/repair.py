"""Repair of the previous plan: it keeps the limits again after some of it is lost."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from planner_core.precedence.conflicts import conflicts
from planner_core.problem import COLLECT, CONTACT, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Violation

LIMITS: Final = ("battery", "recorder")
_MOST_TRIED: Final = 30  # contacts in place of a lost one


def repaired(problem: Problem, rows: Collection[int], protected: Collection[int]) -> Plan:
    """Return a plan made valid by adding contacts and dropping tasks, as far as possible.

    Parameters
    ----------
    rows
        The plan to repair; rows that every plan must hold are added.
    protected
        Rows that are dropped last.
    """
    plan = Plan.of(problem, set(rows)).with_kept(problem)
    for _ in range(len(plan.actions) + 1):
        timeline = replay(problem, plan, in_detail=False)
        broken = [v for v in timeline.violations if v.code != "duplicate" and not v.inherited]
        if not broken:
            return plan
        first = min(broken, key=lambda v: v.at_s)
        found = _with_contact(problem, plan, first) if first.code == "recorder" else None
        found = found or _shed(problem, plan, first, protected)
        if found is None:
            return plan
        plan = found
    return plan


def _with_contact(problem: Problem, plan: Plan, broken: Violation) -> Plan | None:
    """Return the plan with one more contact before the recorder is full, if one helps."""
    table = problem.opportunities
    taken = [action.opportunity for action in plan.actions]
    own = problem.satellites[broken.satellite].rows
    free = [
        int(row)
        for row in own[::-1]
        if table.kind[row] == CONTACT and table.start_s[row] < broken.at_s and row not in taken
    ]
    before = replay(problem, plan, in_detail=False)
    for row in [row for row in free if not conflicts(problem, row, taken)][:_MOST_TRIED]:
        trial = Plan.of(problem, [*taken, row])
        after = replay(problem, trial, in_detail=False)
        own_broken = [
            v for v in after.violations if v.satellite == broken.satellite and not v.inherited
        ]
        if all(v.at_s > broken.at_s for v in own_broken if v.code in LIMITS) and len(
            after.violations
        ) <= len(before.violations):
            return trial
    return None


def _shed(
    problem: Problem, plan: Plan, broken: Violation, protected: Collection[int]
) -> Plan | None:
    """Return the plan without one action that contributes to a violation; None if none is left."""
    table, kept = problem.opportunities, set(problem.kept_rows.tolist())
    blamed = [plan.actions[p].opportunity for p in broken.blamed]
    ahead = [
        action.opportunity
        for action in reversed(plan.actions)
        if table.satellite[action.opportunity] == broken.satellite
        and action.start_s <= broken.at_s + TIME_TOLERANCE_S
        and (table.kind[action.opportunity] == COLLECT or broken.code == "battery")
    ]
    # If frozen actions lead beyond a limit, actions that make it worse come later and are blamed.
    candidates = [*ahead, *reversed(blamed)] if broken.code in LIMITS else [*blamed, *ahead]
    loose = [row for row in candidates if row not in kept]
    if not loose:
        return None
    gone = next((row for row in loose if row not in protected), loose[0])
    return Plan.of(problem, [a.opportunity for a in plan.actions if a.opportunity != gone])
