"""The best plan of a small problem, by trying every one; nothing is shared with the solvers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from planner_core.problem import COLLECT, Pinned, Problem
from planner_core.problem.plan import Plan
from planner_core.referee.replay import replay


def best_reward(problem: Problem) -> float:
    """Return the highest reward of any valid plan, judged by the referee; 0 where none is."""
    best = best_plan(problem)
    return 0.0 if best is None else replay(problem, best).reward


def best_plan(problem: Problem) -> Plan | None:
    """Return a valid plan of the highest reward, judged by the referee, if there is any.

    The referee first says which two tasks a satellite cannot do one right after the other.
    Plans without such a pair are judged from the one that could earn most downwards, until no
    other can earn more.
    """
    table = problem.opportunities
    free = replace(problem, use_resources=False, pinned=Pinned())
    may_follow = {
        (a, b)
        for a in range(len(table))
        for b in range(a + 1, len(table))
        if table.satellite[a] != table.satellite[b]
        or replay(free, Plan.of(problem, (a, b)), in_detail=False).is_valid
    }

    def worth(rows: tuple[int, ...]) -> float:
        best: dict[int, float] = {}
        for row in rows:
            if table.kind[row] == COLLECT:
                target = int(table.place[row])
                best[target] = max(best.get(target, 0.0), float(problem.worth[row]))
        return sum(best.values())

    plans = sorted(_chains(problem, may_follow, (), 0), key=worth, reverse=True)
    best, reward = None, 0.0
    for rows in plans:
        if best is not None and worth(rows) <= reward:
            break
        plan = Plan.of(problem, rows)
        timeline = replay(problem, plan, in_detail=False)
        if timeline.is_valid and (best is None or timeline.reward > reward):
            best, reward = plan, timeline.reward
    return best


def _chains(
    problem: Problem, may_follow: set[tuple[int, int]], rows: tuple[int, ...], first: int
) -> Iterator[tuple[int, ...]]:
    """Yield a plan and all that go on from it, each task right after one that it may follow."""
    yield rows
    satellite = problem.opportunities.satellite
    for row in range(first, len(satellite)):
        before = next((r for r in reversed(rows) if satellite[r] == satellite[row]), None)
        if before is None or (before, row) in may_follow:
            yield from _chains(problem, may_follow, (*rows, row), row + 1)
