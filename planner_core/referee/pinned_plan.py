"""The referee's check that a plan honours pins, outages and the freeze of a replan."""

from __future__ import annotations

from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.timeline import Violation, ViolationCode


def breaches(problem: Problem, plan: Plan) -> list[Violation]:
    """Return a violation for each kept action that is missing and each action ruled out."""
    pinned, table = problem.pinned, problem.opportunities
    starts = {action.opportunity: action.start_s for action in plan.actions}
    found = [
        Violation(
            satellite=int(table.satellite[kept.row]),
            at_s=float(table.start_s[kept.row]),
            needed=1.0,
            available=0.0,
            detail=f"The action that {kept.pointer} keeps is missing.",
            blamed=(),
            code="frozen" if kept.pointer.startswith("/replan/") else "pin",
        )
        for kept in pinned.kept
        if kept.row not in starts
        or (
            problem.continuous_starts
            and abs(starts[kept.row] - table.start_s[kept.row]) > TIME_TOLERANCE_S
        )
    ]
    kept_rows = {kept.row for kept in pinned.kept}
    if not (pinned.blocked or pinned.forbidden or pinned.skipped or pinned.follows):
        return found  # nothing is ruled out
    for position, action in enumerate(plan.actions):
        row = action.opportunity
        satellite, kind = int(table.satellite[row]), int(table.kind[row])
        site = int(table.site[row])
        spans = [
            blocked
            for blocked in pinned.blocked
            if blocked.concerns(satellite, kind, site)
            and action.start_s < blocked.end_s - TIME_TOLERANCE_S
            and action.end_s > blocked.start_s + TIME_TOLERANCE_S
        ]
        why = [
            f"It lies in the interval that {blocked.pointer} blocks."
            for blocked in spans
            if not blocked.is_outage
        ]
        if kind == COLLECT and site in pinned.forbidden:
            why.append("Its target is forbidden.")
        if row in pinned.skipped:
            why.append(f"It is an action that {pinned.skipped[row]} skips.")
        codes: list[tuple[ViolationCode, str]] = [("pin", detail) for detail in why]
        codes += [
            ("outage", f"It lies in the outage {blocked.pointer}.")
            for blocked in spans
            if blocked.is_outage
        ]
        if pinned.is_frozen(action.start_s) and row not in kept_rows:
            codes.append(("frozen", "It starts within the freeze, but is not a frozen action."))
        found += [
            Violation(
                satellite=satellite, at_s=action.start_s, needed=0.0, available=1.0,
                detail=detail, blamed=(position,), code=code,
            )
            for code, detail in codes
        ]  # fmt: skip
    return found
