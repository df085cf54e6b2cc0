"""What the MILP proves, and how fast (``python -m benchmarks.milp``).

Prints, for the paper's mission without resources, the CPU seconds of both formulations and their
ratio; then plan and bound with resources. Each search may take at most ``LIMIT_S``.
"""

from __future__ import annotations

import sys
import time

from benchmarks.missions import paper_scenario, problem_of
from planner_core.budget import Budget
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution
from planner_core.solvers.registry import Milp

LIMIT_S = 60.0


def timed(problem: Problem, solver: Milp) -> tuple[Solution, float, float]:
    """Return the answer, its reward and the CPU seconds it took."""
    began = time.process_time()
    solution = solver.solve(problem, Budget(LIMIT_S), 0)
    return solution, replay(problem, solution.plan).reward, time.process_time() - began


def row(problem: Problem, solver: Milp) -> tuple[str, float]:
    """Return the result of one search, and its CPU seconds."""
    solution, reward, solve_s = timed(problem, solver)
    bound = f"{solution.bound:5.0f}" if solution.bound is not None else "    -"
    return f"{solve_s:8.2f} {reward:6.0f} {bound} {solution.termination:>12}", solve_s


def main() -> None:
    """Print the tables; numbers of targets may be given."""
    sizes = [int(size) for size in sys.argv[1:]] or [200, 500, 1000]
    problem = problem_of(paper_scenario(50, 0, use_resources=True))
    timed(problem, Milp())  # compiles
    print(f"{'targets':>7} {'draw':>4} {'formulation':>11} {'cpu_s':>8} {'reward':>6} "
          f"{'bound':>5} {'ended':>12}")  # fmt: skip
    for size in sizes:
        for seed in (0, 1, 2):
            problem = problem_of(paper_scenario(size, seed, use_resources=False))
            antichain, antichain_s = row(problem, Milp())
            print(f"{size:7} {seed:4} {'antichain':>11} {antichain}", flush=True)
            pairwise, pairwise_s = row(problem, Milp(formulation="pairwise"))
            print(f"{size:7} {seed:4} {'pairwise':>11} {pairwise}", flush=True)
            print(f"{'':12} time, antichain to pairwise: {antichain_s / pairwise_s:.2f}")
    for dynamics in ("physical", "paper"):
        problem = problem_of(paper_scenario(200, 0, use_resources=True, dynamics=dynamics))
        line, _ = row(problem, Milp())
        print(f"    200    0 {dynamics:>11} {line}", flush=True)


if __name__ == "__main__":
    main()
