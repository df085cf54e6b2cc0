"""Continuous starts as a problem with several fixed starts in each access."""

from __future__ import annotations

import numpy as np

from planner_core.certified.sizes import APART_S
from planner_core.certified.tuning import TUNING
from planner_core.precedence.time_windows import action_of, time_windows_of
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.problem.retimed import Retimed, with_starts


def with_sampled_starts(problem: Problem) -> Retimed:
    """Return the problem with further starts, evenly spread over the accesses."""
    windows = [time_windows_of(problem, index) for index in range(len(problem.satellites))]
    row = np.concatenate([each.row for each in windows])
    open_s = np.concatenate([each.open_s for each in windows])
    length_s = np.concatenate([each.close_s for each in windows]) - open_s
    # So many that searches with resources still find good plans within seconds.
    apart_s = max(APART_S, float(length_s.sum()) / TUNING.most_relaxed)
    count = np.ceil(length_s / apart_s).astype(np.int64)
    window = np.repeat(np.arange(len(row)), count)
    nth = np.arange(len(window)) - np.repeat(np.cumsum(count) - count, count)
    start_s = open_s[window] + (nth + 0.5) * (length_s / np.maximum(count, 1))[window]
    return with_starts(problem, row[window], np.round(start_s, 3))


def with_own_rows(problem: Problem, made: Retimed, plan: Plan) -> Plan:
    """Return a plan of the problem made from ``problem`` as one of ``problem`` itself."""
    return Plan(
        tuple(
            action_of(problem, int(made.source[action.opportunity]), action.start_s)
            for action in plan.actions
        )
    )
