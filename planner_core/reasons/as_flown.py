"""A plan with continuous starts, rewritten for a problem whose opportunities have these starts.

Code that tries whether an image fits beside the plan only looks at opportunities. With continuous
starts those of the scenario do not suffice. So each action of the plan becomes an opportunity, and
so does the earliest start of each target left out after each task of the plan.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.jit import kernel
from planner_core.problem import (
    Floats,
    Ints,
    Longs,
    Problem,
    line_of_sight,
)
from planner_core.problem.plan import Plan
from planner_core.problem.pointing import (
    Agile,
    Path,
    agile_of,
    earliest_start_s,
)
from planner_core.problem.retimed import Retimed, offered, with_starts
from planner_core.reasons.reason import Reason
from planner_core.sorting import first_not_below


def as_flown(problem: Problem, plan: Plan, targets: Longs) -> tuple[Retimed, Plan]:
    """Return the problem with the plan's starts and those that suit ``targets``, and the plan.

    The plan's actions keep their positions.
    """
    rows = [np.array([a.opportunity for a in plan.actions], dtype=np.int32)]
    starts = [np.array([a.start_s for a in plan.actions], dtype=np.float64)]
    for index in range(len(problem.satellites)):
        found = _fitting(problem, plan, index, targets)
        rows.append(found[0])
        starts.append(found[1])
    made = with_starts(problem, np.concatenate(rows), np.concatenate(starts))
    return made, offered(made, problem, plan)


def in_rows_of(source: Ints, reason: Reason) -> Reason:
    """Return a reason in terms of the original opportunities, from which the starts were made."""
    change = reason.change
    if change is not None:
        change = replace(change, opportunity=int(source[change.opportunity]))
    opportunity = reason.opportunity
    if opportunity is not None:
        opportunity = int(source[opportunity])
    return replace(reason, opportunity=opportunity, change=change)


def _fitting(problem: Problem, plan: Plan, index: int, targets: Longs) -> tuple[Ints, Floats]:
    """Return the earliest starts in the targets' accesses after each task of one satellite."""
    table, pointing = problem.opportunities, problem.pointing
    collects, offsets = problem.target_opportunities
    rows = np.concatenate(
        [collects[:0], *(collects[offsets[t] : offsets[t + 1]] for t in targets.tolist())]
    )
    rows = rows[table.satellite[rows] == index]
    if pointing is None or len(rows) == 0:
        return rows[:0], np.empty(0)
    _, first = np.unique(table.access[rows], return_index=True)
    rows = rows[first]
    tasks = [a for a in plan.actions if table.satellite[a.opportunity] == index]
    looked = [line_of_sight(problem, a.opportunity, a.end_s) for a in tasks]
    agility = problem.satellites[index].agility
    length_s = table.end_s[rows] - table.start_s[rows]
    at, start_s = _first_starts(
        pointing.paths[index],
        pointing.targets_m,
        agile_of(agility.slew_rate_deg_s, agility.acceleration_deg_s2, agility.settle_s),
        np.array([a.start_s for a in tasks], dtype=np.float64),
        np.array([a.end_s for a in tasks], dtype=np.float64),
        np.array(looked, dtype=np.float64).reshape(len(tasks), 3),
        table.site[rows],
        np.maximum(table.access_start_s[rows], 0.0),
        np.minimum(table.access_end_s[rows], problem.horizon_s) - length_s,
    )
    return rows[at], start_s


@kernel
def _first_starts(
    path: Path,
    targets_m: Floats,
    agile: Agile,
    start_s: Floats,
    end_s: Floats,
    looked: Floats,
    target: Ints,
    open_s: Floats,
    close_s: Floats,
) -> tuple[Ints, Floats]:
    """Return, for each access, its earliest start after each task around it."""
    access, found = [np.int32(0) for _ in range(0)], [0.0 for _ in range(0)]
    for c in range(len(target)):
        i = first_not_below(start_s, open_s[c])
        while i > 0 and end_s[i - 1] > open_s[c] - 180.0 / agile.rate_deg_s:
            i -= 1
        i -= 1
        while i < len(start_s):
            if i < 0:
                at = open_s[c]
            else:
                u = (looked[i, 0], looked[i, 1], looked[i, 2])
                at = earliest_start_s(
                    agile, end_s[i], u, path, targets_m, target[c], open_s[c], close_s[c]
                )
            if at == np.inf:
                break
            access.append(np.int32(c))
            found.append(at)
            i += 1
    return np.array(access, dtype=np.int32), np.array(found)
