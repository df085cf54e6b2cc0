"""How long forward search takes on the paper's problem (``python -m benchmarks.forward_search``).

Prints, after one warm-up run, the median solver time of several runs for each depth and
breadth, with and without resources, and the ratio to the rule-based planner in the same run.
"""

from __future__ import annotations

import statistics
import time

from benchmarks.missions import paper_scenario, problem_of
from planner_core.budget import Budget
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import ForwardSearch, Rule

RUNS = 7


def median_s(problem: Problem, solver: Solver) -> float:
    """Return the median solver time over several runs, warm."""
    solver.solve(problem, Budget(), 0)
    times = []
    for _ in range(RUNS):
        began = time.perf_counter()
        solver.solve(problem, Budget(), 0)
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def main() -> None:
    """Print the table."""
    print(f"{'resources':>9} {'depth':>5} {'breadth':>7} {'solve_s':>8} {'ratio':>7} "
          f"{'reward':>6} {'bound':>6}")  # fmt: skip
    for use_resources in (False, True):
        problem = problem_of(paper_scenario(1000, 0, use_resources=use_resources))
        rule_s = median_s(problem, Rule())
        for depth, breadth in ((3, 3), (5, 3), (3, 5)):
            solver = ForwardSearch(depth=depth, breadth=breadth)
            solve_s = median_s(problem, solver)
            reward = replay(problem, solver.solve(problem, Budget(), 0).plan).reward
            bound = lagrangian_bound(problem, reward).value
            print(f"{use_resources!s:>9} {depth:5} {breadth:7} {solve_s:8.4f} "
                  f"{solve_s / rule_s:7.1f} {reward:6.0f} {bound:6.0f}")  # fmt: skip


if __name__ == "__main__":
    main()
