"""Problems in which a recorder is too full at the start: contacts are the way back.

Searches and bounds know limits as limits. They are given the same problem with recorders that are
just within theirs: whatever may be flown from the fuller ones may be flown from these, so that what
is proven holds. The plan is then made one that may be flown.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from planner_core.budget import Termination
from planner_core.problem import CONTACT, Problem, SatelliteProblem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.replanning.repair import conflicts, repaired
from planner_core.solvers.base import Solution

_CLEARLY: Final = 1e-6  # of a recorder: farther from the limit than searches keep anyway


def within_limits(problem: Problem) -> Problem:
    """Return the problem with recorders that telemetry alone does not fill.

    The problem itself where none is beyond its limit at the start.
    """
    if not problem.use_resources or not any(map(_is_too_full, problem.satellites)):
        return problem
    return replace(
        problem,
        satellites=tuple(
            _relieved(satellite, problem.horizon_s) if _is_too_full(satellite) else satellite
            for satellite in problem.satellites
        ),
    )


def flyable(problem: Problem, searched: Problem, solution: Solution) -> Solution:
    """Return an answer to ``within_limits(problem)`` as one to the problem itself.

    Contacts come first until the recorder is within its limit. What was optimal there need not be
    so here.
    """
    if searched is problem:
        return solution
    rows = {action.opportunity for action in solution.plan.actions}
    for index, satellite in enumerate(problem.satellites):
        if _is_too_full(satellite):
            rows = _with_relief(problem, index, rows)
    ended = solution.termination
    if ended is Termination.OPTIMAL:
        ended = Termination.HORIZON_COMPLETE
    return replace(solution, plan=repaired(problem, rows, ()), termination=ended)


def _is_too_full(satellite: SatelliteProblem) -> bool:
    r = satellite.resources
    return r.initial_recorder_fraction >= r.recorder_max_fraction


def _relieved(satellite: SatelliteProblem, horizon_s: float) -> SatelliteProblem:
    r = satellite.resources
    room = r.telemetry_per_s * horizon_s + _CLEARLY
    start = max(0.0, r.recorder_max_fraction - room)
    return replace(satellite, resources=replace(r, initial_recorder_fraction=start))


def _with_relief(problem: Problem, index: int, rows: set[int]) -> set[int]:
    """Return the plan's rows with contacts until the recorder of a satellite is within its limit.

    The earliest ones that can stand beside what is kept; other tasks make room, and images that
    would fill it meanwhile.
    """
    table, r = problem.opportunities, problem.satellites[index].resources
    taken = problem.kept_rows.tolist()
    until_s = problem.horizon_s
    for row in problem.satellites[index].rows.tolist():
        if table.kind[row] != CONTACT or row in taken or conflicts(problem, row, taken):
            continue
        taken.append(row)
        timeline = replay(problem, Plan.of(problem, taken))
        judged = {a.opportunity: a.recorder_end for a in timeline.satellites[index].actions}
        if (judged[row] or 0.0) < r.recorder_max_fraction:
            until_s = float(table.end_s[row])
            break
    return set(taken) | {
        row
        for row in rows
        if not conflicts(problem, row, taken)
        and (
            table.satellite[row] != index
            or table.kind[row] == CONTACT
            or table.start_s[row] >= until_s
        )
    }
