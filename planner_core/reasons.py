"""Why a target is not in a plan: first what geometry proves, then what the plan blocks.

For each target left out, each of its opportunities is put into the final plan and checked
against the tasks around it and against battery and recorder to the end of the horizon.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner_core.jit import kernel
from planner_core.plan import Plan
from planner_core.problem import (
    ACCESS_TOO_SHORT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    Floats,
    Ints,
    Problem,
)
from planner_core.timeline import Timeline
from planner_core.track import NO_TASK, STRICT, Track, compile_track, take

Outcome = Literal["downlinked", "collected", "unscheduled", "excluded"]
ReasonCode = Literal["no_access", "slew_conflict", "battery", "recorder", "solver_limit"]
Certainty = Literal["proven", "verified", "heuristic"]

_NO_ACCESS = {
    NEVER_VISIBLE: "No satellite rises above its horizon during the planning horizon.",
    OUTSIDE_LIMITS: "It is visible, but never within the limits of the sensor and its own.",
    ACCESS_TOO_SHORT: "Every access is shorter than its collect.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason:
    """Why a target is left out.

    Attributes
    ----------
    blocking
        Positions in ``plan.actions`` of the actions in its way.
    opportunity
        The opportunity that the reason speaks of, where it is one.
    at_s
        When the limit would break, where one would.
    """

    code: ReasonCode
    certainty: Certainty
    detail: str
    blocking: tuple[int, ...] = ()
    opportunity: int | None = None
    at_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetOutcome:
    """What became of one target; ``position`` is that of the action that collected it."""

    target: int
    outcome: Outcome
    position: int | None
    satellite: int | None
    reason: Reason | None


def explain(problem: Problem, plan: Plan, timeline: Timeline) -> tuple[TargetOutcome, ...]:
    """Return every target exactly once, with its outcome and, if left out, a true reason."""
    planned = [_Planned.of(problem, plan, index) for index in range(len(problem.satellites))]
    blamed = {
        position: violation.code for violation in timeline.violations
        for position in violation.blamed
    }  # fmt: skip
    outcomes = []
    for target in range(len(problem.target_ids)):
        collected = timeline.collected.get(target)
        if collected is not None:
            outcomes.append(
                TargetOutcome(
                    target=target,
                    outcome="downlinked" if collected.is_downlinked else "collected",
                    position=collected.position,
                    satellite=collected.satellite,
                    reason=None,
                )
            )
            continue
        reason = _reason(problem, planned, blamed, target)
        outcomes.append(
            TargetOutcome(
                target=target, outcome="unscheduled", position=None, satellite=None, reason=reason
            )
        )
    return tuple(outcomes)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Planned:
    """One satellite's share of the plan: its rows in order, and the state before each."""

    track: Track
    rows: Ints
    positions: tuple[int, ...]
    battery: Floats
    recorder: Floats

    @classmethod
    def of(cls, problem: Problem, plan: Plan, index: int) -> _Planned:
        satellite = problem.satellites[index]
        table = problem.opportunities
        positions = tuple(
            p for p, a in enumerate(plan.actions) if table.satellite[a.opportunity] == index
        )
        rows = problem.local_row[
            np.array([plan.actions[p].opportunity for p in positions], dtype=np.int64)
        ]
        track = compile_track(problem, satellite, np.zeros(len(satellite), dtype=np.uint8))
        battery = np.empty(len(rows) + 1)
        recorder = np.empty(len(rows) + 1)
        _replay_states(track, rows, battery, recorder)
        return cls(track=track, rows=rows, positions=positions, battery=battery, recorder=recorder)


@kernel
def _replay_states(track: Track, rows: Ints, battery: Floats, recorder: Floats) -> None:
    """Fill in the state after 0, 1, ... tasks."""
    battery[0], recorder[0] = track.battery_start, track.recorder_start
    last = NO_TASK
    for k in range(len(rows)):
        battery[k + 1], recorder[k + 1], _ = take(track, last, rows[k], battery[k], recorder[k])
        last = rows[k]


_FITS = -1
_AT_END = -2


@kernel
def _first_break(
    track: Track, rows: Ints, k: int, row: int, battery: float, recorder: float
) -> tuple[int, bool]:
    """Return where a limit breaks with ``row`` inserted before task ``k``, and if it is power.

    A row, ``_AT_END`` (telemetry fills the recorder after the last task) or ``_FITS``.
    """
    last = rows[k - 1] if k > 0 else NO_TASK
    battery, recorder, is_within = take(track, last, row, battery, recorder)
    if not is_within:
        return row, battery <= track.battery_min + STRICT
    last = row
    for i in range(k, len(rows)):
        battery, recorder, is_within = take(track, last, rows[i], battery, recorder)
        if not is_within:
            return rows[i], battery <= track.battery_min + STRICT
        last = rows[i]
    idle_s = max(0.0, track.data_end_s - track.data_from_s[last])
    if recorder + track.telemetry_per_s * idle_s >= track.recorder_max - STRICT:
        return _AT_END, False
    return _FITS, False


def _reason(
    problem: Problem,
    planned: Sequence[_Planned],
    blamed: Mapping[int, str],
    target: int,
) -> Reason:
    collects = problem.collects_of(target)
    if len(collects) == 0:
        detail = _NO_ACCESS[int(problem.target_access[target])]
        return Reason(code="no_access", certainty="proven", detail=detail)
    blocked: Reason | None = None
    short: Reason | None = None
    for opportunity in (int(c) for c in collects):
        satellite = planned[problem.opportunities.satellite[opportunity]]
        row = int(problem.local_row[opportunity])
        found = _tried(problem, satellite, opportunity, row, blamed)
        if found.code == "solver_limit":
            return found
        if found.code in ("battery", "recorder"):
            short = short or found
        elif blocked is None or len(found.blocking) < len(blocked.blocking):
            blocked = found
    reason = short or blocked
    assert reason is not None
    return reason


def _tried(
    problem: Problem,
    satellite: _Planned,
    opportunity: int,
    row: int,
    blamed: Mapping[int, str],
) -> Reason:
    """Return what keeps one opportunity out of the final plan."""
    track, rows = satellite.track, satellite.rows
    k = int(np.searchsorted(rows, row))
    if k < len(rows) and rows[k] == row:
        return _broken(satellite.positions[k], opportunity, blamed)
    blockers = _blockers(problem, satellite, opportunity, row, k)
    if blockers:
        return Reason(
            code="slew_conflict",
            certainty="verified",
            detail=f"Each of its {len(problem.collects_of(int(track.place[row])))} opportunities "
            "lies too close to a planned action for the satellite to turn in time.",
            blocking=blockers,
            opportunity=opportunity,
        )
    if problem.use_resources:
        where, is_battery = _first_break(
            track, rows, k, row, satellite.battery[k], satellite.recorder[k]
        )
        if where != _FITS:
            at_s = track.data_end_s if where == _AT_END else float(track.start_s[where])
            after = "after it" if where != row else "with it"
            name = "battery" if is_battery else "recorder"
            return Reason(
                code="battery" if is_battery else "recorder",
                certainty="verified",
                detail=f"The plan has no room for it: {after} the {name} would reach its limit.",
                opportunity=opportunity,
                at_s=at_s,
            )
    return Reason(
        code="solver_limit",
        certainty="verified",
        detail="The plan has room for it; the solver did not find this.",
        opportunity=opportunity,
    )


def _broken(position: int, opportunity: int, blamed: Mapping[int, str]) -> Reason:
    """Return the reason of a collect that is in the plan but earns nothing."""
    code = blamed.get(position, "solver_limit")
    known: Mapping[str, ReasonCode] = {
        "battery": "battery", "recorder": "recorder", "slew": "slew_conflict",
        "overlap": "slew_conflict",
    }  # fmt: skip
    return Reason(
        code=known.get(code, "solver_limit"),
        certainty="verified",
        detail=f"Its collect is in the plan but does not count: {code} violation.",
        blocking=(position,),
        opportunity=opportunity,
    )


def _blockers(
    problem: Problem, satellite: _Planned, opportunity: int, row: int, k: int
) -> tuple[int, ...]:
    """Return the planned actions that the opportunity cannot follow, or that cannot follow it."""
    transitions = problem.satellites[problem.opportunities.satellite[opportunity]].transitions
    found = []
    # Neighbours decide where turning is transitive; further ones matter only past a short task.
    for j in range(k - 1, -1, -1):
        if not transitions.allows(int(satellite.rows[j]), row):
            found.append(satellite.positions[j])
        elif j < k - 1:
            break
    for j in range(k, len(satellite.rows)):
        if not transitions.allows(row, int(satellite.rows[j])):
            found.append(satellite.positions[j])
        elif j > k:
            break
    return tuple(sorted(found))
