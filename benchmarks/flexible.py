"""What a choice of starts gains, and how close to the best (``python -m benchmarks.flexible``).

Prints, for each size of the paper's mission without resources and each ``collect_spacing_s``, the
result of solver ``certified`` on one core in ``LIMIT_S`` CPU seconds: plan, bound, gap, CPU seconds
and peak memory. One run each, in a process of its own, after a warm-up on a small mission; access
and opportunities are not counted. For comparison the plans of forward search (3, 3) and of MCTS
with its defaults, and their CPU seconds.

``python -m benchmarks.flexible 1000 --spacings 15 5 --draw 1`` picks sizes, spacings and a draw.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any, Final

from benchmarks.cpu_budget import CpuBudget
from benchmarks.missions import paper_scenario, problem_of
from planner_core.problem import Problem

LIMIT_S: Final = 60.0
SIZES: Final = (500, 1000, 2000)
SPACINGS: Final = (None, 60.0, 30.0, 15.0, 5.0)
WARM_UP: Final = 60  # targets


def mission(num_targets: int, draw: int, spacing_s: float | None) -> Problem:
    """Return one day of the paper's satellite with starts this far apart."""
    scenario = paper_scenario(num_targets, draw, use_resources=False)
    return problem_of(replace(scenario, collect_spacing_s=spacing_s))


def one(num_targets: int, draw: int, spacing_s: float | None) -> dict[str, Any]:
    """Return the result of one solve, after a warm-up."""
    from planner_core.budget import Budget
    from planner_core.referee.replay import replay
    from planner_core.solvers.registry import Certified, ForwardSearch, Mcts

    for warm_s in (None, 15.0):
        small = mission(WARM_UP, 99, warm_s)
        Certified().solve(small, Budget(), 0)
        ForwardSearch().solve(small, Budget(), 0)
        Mcts().solve(small, Budget(), 0)
    began = time.process_time()
    problem = mission(num_targets, draw, spacing_s)
    build_s, began = time.process_time() - began, time.process_time()
    forward = replay(problem, ForwardSearch().solve(problem, Budget(), 0).plan).reward
    forward_s, began = time.process_time() - began, time.process_time()
    mcts = replay(problem, Mcts().solve(problem, Budget(), 0).plan).reward
    mcts_s, began = time.process_time() - began, time.process_time()
    solution = Certified().solve(problem, CpuBudget(LIMIT_S, time.time() + 10.0 * LIMIT_S), 0)
    cpu_s = time.process_time() - began
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert solution.bound is not None
    return {
        "opportunities": len(problem.opportunities),
        "reward": timeline.reward,
        "bound": solution.bound,
        "cpu_s": cpu_s,
        "build_s": build_s,
        "forward": forward,
        "forward_s": forward_s,
        "mcts": mcts,
        "mcts_s": mcts_s,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }


def apart(num_targets: int, draw: int, spacing_s: float | None) -> dict[str, Any]:
    """Return the same, computed in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.flexible", str(num_targets), "--draw", str(draw)]
    command += ["--one", "--spacings", "none" if spacing_s is None else str(spacing_s)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def spacing(text: str) -> float | None:
    """Return a spacing in the scenario's form."""
    return None if text == "none" else float(text)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=int, default=SIZES)
    parser.add_argument("--spacings", nargs="+", type=spacing, default=SPACINGS)
    parser.add_argument("--draw", type=int, default=0)
    parser.add_argument("--one", action="store_true")
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.sizes[0], options.draw, options.spacings[0])))
        return
    print(f"{'targets':>7} {'spacing_s':>9} {'starts':>7} {'plan':>5} {'bound':>6} {'gap':>7} "
          f"{'cpu_s':>6} {'peak_mb':>7} {'build_s':>7} {'forward':>7} {'cpu_s':>6} "
          f"{'mcts':>5} {'cpu_s':>6}")  # fmt: skip
    for size in options.sizes:
        for spacing_s in options.spacings:
            r = apart(size, options.draw, spacing_s)
            gap = 1.0 - r["reward"] / r["bound"]
            name = "none" if spacing_s is None else f"{spacing_s:g}"
            print(f"{size:7} {name:>9} {r['opportunities']:7} {r['reward']:5.0f} "
                  f"{r['bound']:6.0f} {100 * gap:6.2f}% {r['cpu_s']:6.1f} {r['peak_mb']:7.0f} "
                  f"{r['build_s']:7.1f} {r['forward']:7.0f} {r['forward_s']:6.1f} "
                  f"{r['mcts']:5.0f} {r['mcts_s']:6.1f}",
                  flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
