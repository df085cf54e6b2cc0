"""The best plan of a small problem, by trying every one; nothing is shared with the solvers."""

from __future__ import annotations

import itertools

from planner_core.plan import Plan
from planner_core.problem import Problem
from planner_core.timeline import replay


def best_reward(problem: Problem) -> float:
    """Return the highest reward of any valid plan: all subsets, judged by the referee.

    Subsets of opportunities of one satellite that overlap are skipped before judging.
    """
    table = problem.opportunities
    best = 0.0
    for size in range(len(table) + 1):
        for rows in itertools.combinations(range(len(table)), size):
            if any(
                table.satellite[a] == table.satellite[b] and table.start_s[b] < table.end_s[a]
                for a, b in itertools.combinations(rows, 2)
            ):
                continue
            timeline = replay(problem, Plan.of(problem, rows))
            if timeline.is_valid:
                best = max(best, timeline.reward)
    return best
