"""Plans and bounds of whole fleets (``python -m benchmarks.fleet SPACECRAFT CITIES STATIONS``).

Runs each case in a process of its own, after a warm-up, for the given CPU seconds (with
``--threads`` above 1: seconds by the clock). Prints the number of opportunities, CPU seconds of the
access search, of compiling the problem and of ``certified``, reward and bound, peak memory, and
when the gap was first within some shares of the bound. The files are those of the public benchmark
(``benchmarks.fleet_missions``).
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from benchmarks.cpu_budget import CpuBudget
from benchmarks.fleet_missions import Files, fleet_scenario
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget, Progress
from planner_core.build import build_problem
from planner_core.domain import Dynamics
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified

NEAR: Final = (0.02, 0.015, 0.01, 0.003)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One line of the table."""

    num_satellites: int
    num_targets: int
    time_s: float
    use_resources: bool = False
    dynamics: Dynamics = "physical"


CASES: Final = {
    "4": Case(num_satellites=4, num_targets=2000, time_s=10.0),
    "24": Case(num_satellites=24, num_targets=10_000, time_s=60.0),
    "4-resources": Case(num_satellites=4, num_targets=2000, time_s=60.0, use_resources=True),
    "4-paper": Case(
        num_satellites=4, num_targets=2000, time_s=60.0, use_resources=True, dynamics="paper"
    ),
}
_WARM_UP: Final = Case(num_satellites=2, num_targets=40, time_s=60.0)


def one(files: Files, case: Case, seed: int, num_threads: int) -> dict[str, Any]:
    """Return the result of one case."""
    scenario = fleet_scenario(
        files, case.num_satellites, case.num_targets,
        use_resources=case.use_resources, dynamics=case.dynamics,
    )  # fmt: skip
    began_s = time.process_time()
    opportunities = compute_opportunities(scenario, Budget())
    access_s = time.process_time() - began_s
    began_s = time.process_time()
    problem = build_problem(scenario, opportunities, Budget())
    compile_s = time.process_time() - began_s
    curve: list[tuple[float, float, float]] = []

    def watch(progress: Progress) -> None:
        if progress.reward is not None and progress.bound is not None:
            curve.append((time.process_time() - began_s, progress.reward, progress.bound))

    budget: Budget = CpuBudget(case.time_s, time.time() + 10.0 * case.time_s)
    if num_threads > 1:
        budget = Budget(case.time_s)
    budget.report, budget.num_threads = watch, num_threads
    began_s, clock_s = time.process_time(), time.perf_counter()
    solution = Certified().solve(problem, budget, seed)
    solve_s, passed_s = time.process_time() - began_s, time.perf_counter() - clock_s
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations[:3]
    assert solution.bound is not None
    curve.append((solve_s, timeline.reward, solution.bound))
    return {
        "opportunities": len(problem.opportunities),
        "access_s": access_s,
        "compile_s": compile_s,
        "solve_s": solve_s,
        "clock_s": passed_s,
        "reward": timeline.reward,
        "bound": solution.bound,
        "termination": solution.termination.value,
        "near_s": [next((t for t, r, b in curve if b - r <= near * b), None) for near in NEAR],
        "curve": curve[:: max(1, len(curve) // 30)],
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spacecraft", type=Path)
    parser.add_argument("cities", type=Path)
    parser.add_argument("stations", type=Path, nargs="?")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--curve", action="store_true", help="print plan and bound over time")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    files = Files(spacecraft=options.spacecraft, cities=options.cities, stations=options.stations)
    if options.one:
        case = CASES[options.cases[0]]
        one(files, Case(**{**_fields(_WARM_UP), "use_resources": case.use_resources}), 0, 1)
        print(json.dumps(one(files, case, options.seed, options.threads)))
        return
    print(f"{'case':>12} {'tasks':>7} {'access_s':>8} {'compile_s':>9} {'reward':>7} {'bound':>8} "
          f"{'gap':>7} {'cpu_s':>6} {'clock_s':>7} {'MB':>5}  "
          + " ".join(f"{100 * near:g}%_s" for near in NEAR))  # fmt: skip
    for name in options.cases:
        print_case(name, options)


def print_case(name: str, options: argparse.Namespace) -> None:
    """Print one line."""
    paths = [options.spacecraft, options.cities, *([options.stations] if options.stations else [])]
    command = [sys.executable, "-m", "benchmarks.fleet", *map(str, paths), "--one"]
    command += ["--cases", name, "--seed", str(options.seed), "--threads", str(options.threads)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    answer = json.loads(done.stdout.splitlines()[-1])
    gap = 1.0 - answer["reward"] / answer["bound"]
    near = " ".join("   -" if s is None else f"{s:4.1f}" for s in answer["near_s"])
    print(f"{name:>12} {answer['opportunities']:7} {answer['access_s']:8.1f} "
          f"{answer['compile_s']:9.1f} {answer['reward']:7.0f} {answer['bound']:8.1f} "
          f"{100 * gap:6.2f}% {answer['solve_s']:6.1f} {answer['clock_s']:7.1f} "
          f"{answer['peak_mb']:5.0f}  {near}", flush=True)  # fmt: skip
    if options.curve:
        for passed_s, reward, bound in answer["curve"]:
            print(f"{'':12} {passed_s:6.1f} s: {reward:.0f} / {bound:.1f}")


def _fields(case: Case) -> dict[str, Any]:
    return {name: getattr(case, name) for name in Case.__slots__}


if __name__ == "__main__":
    main()
