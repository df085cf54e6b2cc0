"""Problems that begin beyond a limit, or whose frozen part leads there: contacts are the way back.

Searches and bounds treat limits as strict. So they get the same problem with satellites that begin
with an emptier recorder and a fuller battery, such that frozen actions and telemetry keep the
limits. Any plan that may be flown from the worse start may be flown from the better one, so bounds
still hold. Afterwards the plan found is repaired for the real start.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.budget import Budget, Termination
from planner_core.pinning.limits import can_keep
from planner_core.precedence.conflicts import conflicts
from planner_core.problem import CONTACT, Problem, SatelliteProblem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay
from planner_core.referee.resource_profile import Curve, integrate
from planner_core.referee.unavoidable import beyond_from_s
from planner_core.replanning.known import KnownMultipliers
from planner_core.replanning.promises import require_promises, with_promised
from planner_core.replanning.question import Question
from planner_core.replanning.repair import repaired
from planner_core.replanning.replan import differences, solve_replan
from planner_core.replanning.undo import undone
from planner_core.solvers.base import Solution, Solver

_CLEARLY: Final = 1e-6  # of a capacity: farther from the limit than searches keep anyway


def within_limits(problem: Problem) -> Problem:
    """Return the problem with satellites for which some plan keeps the limits.

    Returns the problem itself if that is so already.
    """
    if not problem.use_resources:
        return problem
    relieved = tuple(_relieved(problem, index) for index in range(len(problem.satellites)))
    is_same = all(a is b for a, b in zip(relieved, problem.satellites, strict=True))
    return problem if is_same else replace(problem, satellites=relieved)


def flyable(
    problem: Problem, searched: Problem, solution: Solution, protected: Collection[int] = ()
) -> Solution:
    """Return a solution of ``within_limits(problem)`` as a solution of the problem itself.

    Contacts come first until the recorder is within its limit. A plan that was optimal there need
    not be optimal here.

    Parameters
    ----------
    protected
        Rows that are dropped last.
    """
    if searched is problem:
        return solution
    rows = {action.opportunity for action in solution.plan.actions}
    for index, (own, relieved) in enumerate(
        zip(problem.satellites, searched.satellites, strict=True)
    ):
        if own.resources != relieved.resources:
            rows = _with_relief(problem, index, rows)
    ended = solution.termination
    if ended is Termination.OPTIMAL:
        ended = Termination.HORIZON_COMPLETE
    return replace(solution, plan=repaired(problem, rows, protected), termination=ended)


def replanned(
    question: Question,
    searched: Problem,
    solver: Solver,
    budget: Budget,
    seed: int,
    known: KnownMultipliers | None = None,
) -> Solution:
    """Return the plan that follows the base, even if the problem begins beyond limits.

    Parameters
    ----------
    searched
        ``within_limits`` of the question's problem.
    known
        As in ``solve_replan``.

    Raises
    ------
    InvalidScenario
        ``promise_not_kept``: as in ``solve_replan``.
    """
    problem = question.problem
    found = solve_replan(replace(question, problem=searched), solver, budget, seed, known)
    if searched is problem:
        return found
    protected = np.flatnonzero(question.is_promised).tolist()
    solution = flyable(problem, searched, found, protected)
    plan = undone(question, with_promised(question, solution.plan), budget)
    require_promises(question, plan)
    statistics = {**solution.statistics, **differences(question, plan)}
    return replace(solution, plan=plan, statistics=statistics)


def _is_too_full(satellite: SatelliteProblem) -> bool:
    r = satellite.resources
    return r.initial_recorder_fraction >= r.recorder_max_fraction


def _relieved(problem: Problem, index: int) -> SatelliteProblem:
    """Return the satellite with a start from which all that may be flown keeps the limits."""
    satellite = problem.satellites[index]
    if _is_too_full(satellite):
        r = satellite.resources
        room = r.telemetry_per_s * problem.horizon_s + _CLEARLY
        start = max(0.0, r.recorder_max_fraction - room)
        satellite = replace(satellite, resources=replace(r, initial_recorder_fraction=start))
    if not problem.pinned.follows:
        return satellite
    is_full = beyond_from_s(problem, index) is not None
    for relieve in (_emptied, _charged) if is_full else (_charged, _emptied):
        if _keeps_limits(problem, index, satellite):
            return satellite
        satellite = relieve(problem, index, satellite)
    return satellite if _keeps_limits(problem, index, satellite) else _unlimited(satellite)


def _keeps_limits(problem: Problem, index: int, satellite: SatelliteProblem) -> bool:
    """Return whether a satellite may keep the limits with its kept actions and contacts."""
    satellites = [*problem.satellites]
    satellites[index] = satellite
    own = set(satellite.rows.tolist())
    kept = [one for one in problem.pinned.kept if one.row in own]
    none = np.zeros(len(problem.opportunities), dtype=np.bool_)
    return can_keep(replace(problem, satellites=tuple(satellites)), index, kept, none)


def _emptied(problem: Problem, index: int, satellite: SatelliteProblem) -> SatelliteProblem:
    """Return the satellite with enough room in the recorder for kept actions and telemetry."""
    r = satellite.resources
    over = _levels(problem, index, satellite).recorder.max() - r.recorder_max_fraction
    start = max(0.0, r.initial_recorder_fraction - max(0.0, over + _CLEARLY))
    return replace(satellite, resources=replace(r, initial_recorder_fraction=start))


def _charged(problem: Problem, index: int, satellite: SatelliteProblem) -> SatelliteProblem:
    """Return the satellite with a battery that lasts for the kept actions."""
    r = satellite.resources
    under = r.battery_min_fraction - _levels(problem, index, satellite).battery.min()
    start = min(1.0, r.initial_battery_fraction + max(0.0, under + _CLEARLY))
    return replace(satellite, resources=replace(r, initial_battery_fraction=start))


def _unlimited(satellite: SatelliteProblem) -> SatelliteProblem:
    """Return the satellite with no limits but an empty battery and a full recorder."""
    r = replace(satellite.resources, recorder_max_fraction=1.0, battery_min_fraction=0.0)
    return replace(satellite, resources=r)


def _levels(problem: Problem, index: int, satellite: SatelliteProblem) -> Curve:
    """Return battery and recorder of a satellite that only carries out its kept actions."""
    table = problem.opportunities
    rows = [row for row in problem.kept_rows.tolist() if table.satellite[row] == index]
    return integrate(problem, satellite, Plan.of(problem, rows)).curve


def _with_relief(problem: Problem, index: int, rows: set[int]) -> set[int]:
    """Return the plan's rows with contacts until the recorder of a satellite is within its limit.

    These are the earliest contacts that do not conflict with kept rows. Tasks that conflict with
    them are dropped, and so are images that would fill the recorder meanwhile. Returns the same
    rows if some plan keeps the limit throughout.
    """
    from_s = beyond_from_s(problem, index)
    if from_s is None:
        return rows
    table, r = problem.opportunities, problem.satellites[index].resources
    taken = problem.kept_rows.tolist()
    until_s = problem.horizon_s
    for row in problem.satellites[index].rows.tolist():
        if table.kind[row] != CONTACT or row in taken or conflicts(problem, row, taken):
            continue
        taken.append(row)
        timeline = replay(problem, Plan.of(problem, taken))
        judged = {a.opportunity: a.recorder_end for a in timeline.satellites[index].actions}
        is_within = (judged[row] or 0.0) < r.recorder_max_fraction
        if is_within and table.end_s[row] > from_s:
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
