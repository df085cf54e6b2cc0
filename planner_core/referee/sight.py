"""Where a satellite looks when it begins an action, and when it ends it."""

from __future__ import annotations

import numpy as np

from planner_core.problem import Problem, line_of_sight
from planner_core.problem.plan import Action
from planner_core.problem.slew import TIME_TOLERANCE_S, Vector


def looks(problem: Problem, action: Action) -> Vector:
    """Return the line of sight at an action's start."""
    table, i = problem.opportunities, action.opportunity
    if abs(action.start_s - table.start_s[i]) <= TIME_TOLERANCE_S:
        return np.asarray(table.los_start[i])
    return line_of_sight(problem, i, action.start_s)


def looked(problem: Problem, action: Action) -> Vector:
    """Return the line of sight at an action's end."""
    table, i = problem.opportunities, action.opportunity
    if abs(action.end_s - table.end_s[i]) <= TIME_TOLERANCE_S:
        return np.asarray(table.los_end[i])
    return line_of_sight(problem, i, action.end_s)
