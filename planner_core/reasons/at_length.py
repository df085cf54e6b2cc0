"""Why one target is left out, in detail: each of its opportunities is tried with the referee."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.reasons.as_flown import as_flown
from planner_core.reasons.displacing import displace_each
from planner_core.reasons.explain import earned_by, explain
from planner_core.reasons.forcing import PlannedSatellite, force_each
from planner_core.reasons.reason import UNKNOWN_SEARCH, Search, TargetOutcome
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline, Violation


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """The referee's verdict on the plan with one more opportunity.

    Attributes
    ----------
    opportunity
        Row of the problem; None if pins rule it out.
    scenario_row
        Row of the scenario's table.
    violations
        New violations that it causes, with ``blamed`` as positions in ``plan.actions``. Empty if
        it fits.
    displaces
        Positions in ``plan.actions`` of the actions that have to be dropped for it.
    is_settled
        Whether the plan with it and without those is valid.
    reward_delta
        How much more that plan earns, if it is valid.
    ruled_out
        Whether a pin rules it out; ``displaces`` are then kept actions in its way.
    """

    opportunity: int | None
    scenario_row: int
    satellite: int
    start_s: float
    end_s: float
    violations: tuple[Violation, ...] = ()
    displaces: tuple[int, ...] = ()
    is_settled: bool = False
    reward_delta: float | None = None
    ruled_out: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """A target's outcome, and an attempt with each of its opportunities, in order of time."""

    outcome: TargetOutcome
    attempts: tuple[Attempt, ...]


def explain_target(
    problem: Problem, plan: Plan, timeline: Timeline, target: int, search: Search = UNKNOWN_SEARCH
) -> Explanation:
    """Return why one target is not in the plan, in detail.

    A target that is collected has no attempts.
    """
    outcome = explain(problem, plan, timeline, search)[target]
    if outcome.outcome in ("collected", "downlinked"):
        return Explanation(outcome=outcome, attempts=())
    attempts = [
        *_forced(problem, plan, timeline, target),
        *_ruled_out(problem, plan, target),
    ]
    attempts.sort(key=lambda attempt: (attempt.start_s, attempt.scenario_row))
    return Explanation(outcome=outcome, attempts=tuple(attempts))


def _forced(problem: Problem, plan: Plan, timeline: Timeline, target: int) -> list[Attempt]:
    source = np.arange(len(problem.opportunities), dtype=np.int32)
    if problem.pointing is not None:
        made, plan = as_flown(problem, plan, np.array([target]))
        problem, source = made
    table = problem.opportunities
    earned = earned_by(problem, plan, timeline)
    own = [action.opportunity for action in plan.actions]
    before = {_name(violation) for violation in timeline.violations}
    attempts = []
    collects = problem.collects_of(target)
    collects = collects[~np.isin(collects, own)]
    for index in np.unique(table.satellite[collects]):
        rows = collects[table.satellite[collects] == index]
        planned = PlannedSatellite.of(problem, plan, int(index), earned)
        local = problem.local_row[rows]
        displaced = displace_each(planned, local, force_each(problem, planned, local))
        for c, row in enumerate(rows.tolist()):
            dropped = np.flatnonzero(displaced.dropped[c])
            positions = tuple(sorted(planned.positions[dropped].tolist()))
            (added,) = Plan.of(problem, [row]).actions
            order = sorted([*plan.actions, added])
            forced = replay(problem, Plan(tuple(order)), in_detail=False)
            place = {action: position for position, action in enumerate(plan.actions)}
            left = [a for position, a in enumerate(plan.actions) if position not in positions]
            after = replay(problem, Plan(tuple(sorted([*left, added]))), in_detail=False)
            attempts.append(
                Attempt(
                    opportunity=int(source[row]),
                    scenario_row=problem.scenario_row(row),
                    satellite=int(index),
                    start_s=float(table.start_s[row]),
                    end_s=float(table.end_s[row]),
                    violations=tuple(
                        replace(
                            v, blamed=tuple(place[order[p]] for p in v.blamed if order[p] != added)
                        )
                        for v in forced.violations
                        if _name(v) not in before
                    ),
                    displaces=positions,
                    is_settled=after.is_valid,
                    reward_delta=after.reward - timeline.reward if after.is_valid else None,
                )
            )
    return attempts


def _name(violation: Violation) -> tuple[str, int, float]:
    return violation.code, violation.satellite, violation.at_s


def _ruled_out(problem: Problem, plan: Plan, target: int) -> list[Attempt]:
    positions = {action.opportunity: p for p, action in enumerate(plan.actions)}
    return [
        Attempt(
            opportunity=None,
            scenario_row=ruled_out.row,
            satellite=ruled_out.satellite,
            start_s=ruled_out.start_s,
            end_s=ruled_out.end_s,
            displaces=tuple(sorted(positions[row] for row in ruled_out.kept if row in positions)),
            ruled_out=True,
        )
        for ruled_out in problem.pinned.ruled_out.get(target, ())
    ]
