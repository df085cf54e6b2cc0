"""Pins on a problem with continuous starts: kept actions at the starts that they name.

A kept collect becomes an opportunity at its own start. Accesses around it also get opportunities
right before and after it, and likewise around blocked intervals and outages: a target whose
opportunities all overlap it at their own starts may still be imaged beside it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.domain import Outage, Scenario
from planner_core.jit import kernel
from planner_core.pins import BlockedInterval
from planner_core.problem import (
    COLLECT,
    Floats,
    Ints,
    Opportunities,
    Problem,
    line_of_sight,
)
from planner_core.problem.first_turns import first_start_s
from planner_core.problem.plan import Action, Plan
from planner_core.problem.pointing import (
    Agile,
    Path,
    Vector,
    agile_of,
    earliest_start_s,
    latest_start_s,
)
from planner_core.problem.retimed import offered, with_starts
from planner_core.problem.slew import TIME_TOLERANCE_S


def whole_accesses(problem: Problem) -> Opportunities:
    """Return the table with each collect as long as its access: pins may name any start in it."""
    table = problem.opportunities
    is_collect = table.kind == COLLECT
    return replace(
        table,
        start_s=np.where(is_collect, table.access_start_s, table.start_s),
        end_s=np.where(is_collect, table.access_end_s, table.end_s),
    )


def with_pinned_starts(
    scenario: Scenario, problem: Problem, kept: list[int]
) -> tuple[Problem, list[int]]:
    """Return the problem with the starts that pins need, and the rows of the kept actions in it.

    Parameters
    ----------
    kept
        For each kept action an opportunity of its access.
    """
    table, pins = problem.opportunities, scenario.pins
    rows: list[int] = []
    starts: list[float] = []
    for pin, row in zip(pins.keep, kept, strict=True):
        start_s = float(table.start_s[row])
        if pin.start is not None and table.kind[row] == COLLECT:
            open_s, close_s = starts_of(problem, row)
            start_s = min(max(round(scenario.horizon.offset_s(pin.start), 3), open_s), close_s)
        rows.append(row)
        starts.append(start_s)
    own = Plan(
        tuple(
            Action(start_s, start_s + float(table.end_s[row] - table.start_s[row]), row)
            for row, start_s in zip(kept, starts, strict=True)
        )
    )
    for action in own.actions:
        _add_beside(problem, action, rows, starts)
    ids = [satellite.id for satellite in scenario.satellites]
    spans: list[BlockedInterval | Outage] = [*pins.block, *scenario.outages]
    for span in spans:
        if "collect" in span.modes and span.satellite_id is not None:
            from_s, to_s = (scenario.horizon.offset_s(t) for t in (span.start, span.end))
            _add_around(problem, ids.index(span.satellite_id), from_s, to_s, rows, starts)
    made = with_starts(problem, np.array(rows, dtype=np.int32), np.array(starts))
    return made.problem, [action.opportunity for action in offered(made, problem, own).actions]


def starts_of(problem: Problem, row: int) -> tuple[float, float]:
    """Return the first and the last start that an opportunity's access allows."""
    table = problem.opportunities
    length_s = float(table.end_s[row] - table.start_s[row])
    open_s = max(0.0, float(table.access_start_s[row]))
    close_s = min(problem.horizon_s, float(table.access_end_s[row])) - length_s
    return open_s, round(close_s, 3)


def open_when_turned_to(problem: Problem, kept: list[int]) -> tuple[Problem, list[int]]:
    """Return the problem with accesses that begin once their satellite can have turned to them.

    Each access cut so also gets a collect at its new beginning. The kept rows are returned too.
    """
    table = problem.opportunities
    opens_s: dict[int, float] = {}
    for satellite, own in enumerate(problem.satellites):
        if own.heading is None:
            continue
        for row in _first_rows(problem, satellite).tolist():
            open_s, close_s = starts_of(problem, row)
            first_s = first_start_s(problem, row, open_s, close_s)
            if open_s < first_s < np.inf:
                opens_s[row] = first_s
    if not opens_s:
        return problem, kept
    rows = np.array(list(opens_s), dtype=np.int32)
    made = with_starts(problem, rows, np.array(list(opens_s.values())))
    whole, start_s = made.problem.opportunities, table.start_s[made.source]
    by_access = {int(table.access[row]): first_s for row, first_s in opens_s.items()}
    own_s = np.array([by_access.get(access, -np.inf) for access in whole.access.tolist()])
    opened = replace(whole, access_start_s=np.maximum(whole.access_start_s, own_s))
    at = {
        int(row): i
        for i, row in enumerate(made.source)
        if abs(whole.start_s[i] - start_s[i]) <= TIME_TOLERANCE_S
    }
    return replace(made.problem, opportunities=opened), [at[row] for row in kept]


def _first_rows(problem: Problem, satellite: int) -> Ints:
    """Return one collect of each access of a satellite."""
    table = problem.opportunities
    rows = np.flatnonzero((table.satellite == satellite) & (table.kind == COLLECT))
    _, first = np.unique(table.access[rows], return_index=True)
    return rows[first].astype(np.int32)


def _add_beside(problem: Problem, action: Action, rows: list[int], starts: list[float]) -> None:
    table, pointing = problem.opportunities, problem.pointing
    if pointing is None:
        return
    row, satellite = action.opportunity, int(table.satellite[action.opportunity])
    others = _first_rows(problem, satellite)
    agility = problem.satellites[satellite].agility
    length_s = table.end_s[others] - table.start_s[others]
    before, after = _beside(
        pointing.paths[satellite],
        pointing.targets_m,
        agile_of(agility.slew_rate_deg_s, agility.acceleration_deg_s2, agility.settle_s),
        (action.start_s, action.end_s),
        line_of_sight(problem, row, action.start_s),
        line_of_sight(problem, row, action.end_s),
        table.site[others],
        length_s,
        np.maximum(table.access_start_s[others], 0.0),
        np.minimum(table.access_end_s[others], problem.horizon_s) - length_s,
    )
    for found in (before, after):
        for c in np.flatnonzero(np.isfinite(found)):
            rows.append(int(others[c]))
            starts.append(float(found[c]))


@kernel
def _beside(
    path: Path,
    targets_m: Floats,
    agile: Agile,
    task_s: tuple[float, float],
    looks: Vector,
    looked: Vector,
    target: Ints,
    length_s: Floats,
    open_s: Floats,
    close_s: Floats,
) -> tuple[Floats, Floats]:
    """Return the latest start in each access before a task, and the earliest after it.

    ``task_s`` is when the task begins and ends, ``looks`` and ``looked`` its lines of sight then.
    Not finite for accesses far from the task, or if there is no such start.
    """
    start_s, end_s = task_s
    before, after = np.full(len(target), -np.inf), np.full(len(target), np.inf)
    around_s = 360.0 / agile.rate_deg_s + agile.settle_s
    for c in range(len(target)):
        if open_s[c] > end_s + around_s or close_s[c] + length_s[c] < start_s - around_s:
            continue
        before[c] = latest_start_s(
            agile, start_s, looks, path, targets_m, target[c], length_s[c], open_s[c], close_s[c]
        )
        after[c] = earliest_start_s(
            agile, end_s, looked, path, targets_m, target[c], open_s[c], close_s[c]
        )
    return before, after


def _add_around(
    problem: Problem,
    satellite: int,
    from_s: float,
    to_s: float,
    rows: list[int],
    starts: list[float],
) -> None:
    for row in _first_rows(problem, satellite).tolist():
        table = problem.opportunities
        length_s = float(table.end_s[row] - table.start_s[row])
        open_s, close_s = starts_of(problem, row)
        before_s = np.floor((from_s - length_s) * 1000.0 + 1e-4) / 1000.0
        after_s = np.ceil(to_s * 1000.0 - 1e-4) / 1000.0
        for start_s in (before_s, after_s):
            if open_s <= start_s <= close_s:
                rows.append(row)
                starts.append(float(start_s))
