"""CP-SAT on a program read from standard input; it cannot share a process with HiGHS.

The program: ``worth`` of each binary column, ``groups`` of columns of which at most one may be
chosen, and ``limit_s``. Prints its best objective, its bound and CPU seconds as JSON.
"""

from __future__ import annotations

import json
import sys
import time

from ortools.sat.python import cp_model


def main() -> None:
    """Solve the program, after a warm-up on a part of it."""
    program = json.load(sys.stdin)
    solve(program["worth"][:10], [], 1.0)
    began = time.process_time()
    reward, bound = solve(program["worth"], program["groups"], program["limit_s"])
    print(json.dumps({"reward": reward, "bound": bound, "cpu_s": time.process_time() - began}))


def solve(worth: list[float], groups: list[list[int]], limit_s: float) -> tuple[float, float]:
    """Return objective and bound."""
    model = cp_model.CpModel()
    taken = [model.new_bool_var(f"x{i}") for i in range(len(worth))]
    for group in groups:
        model.add_at_most_one(taken[column] for column in group)
    model.maximize(sum(each * x for each, x in zip(worth, taken, strict=True)))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.max_time_in_seconds = limit_s
    solver.solve(model)
    return solver.objective_value, solver.best_objective_bound


if __name__ == "__main__":
    main()
