"""Plan and verify AEOSSP cases (``python -m benchmarks.aeossp FOLDER [--time 60] [--out DIR]``).

Prints for each case whether the solution is valid under the benchmark's rules, its weighted
completion rate (WCR), the upper bound proven for it, completion rate (CR), mean turnaround time
(TAT), energy used (PC), images dropped because of a battery, CPU seconds from the scenario to the
solution, and how the search ended ("optimal" is proven with batteries left out).
FOLDER is one case or holds cases; with ``--out`` each solution is written to CASE/solution.json.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.aeossp.case import read_case, write_solution
from benchmarks.aeossp.planner import plan_case
from benchmarks.aeossp.verifier import verify
from planner_core.solvers.registry import SOLVERS


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="+")
    parser.add_argument("--solver", choices=SOLVERS, default="certified")
    parser.add_argument("--time", type=float, default=60.0, help="seconds for the solver")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    folders = [
        found.parent for folder in options.folder for found in sorted(folder.rglob("mission.yaml"))
    ]
    print(f"{'case':28} {'sats':>4} {'tasks':>5} {'collects':>8} {'valid':>5} {'WCR':>7} "
          f"{'bound':>7} {'CR':>7} {'TAT':>7} {'PC':>8} {'dropped':>7} {'cpu_s':>6} "
          "ended")  # fmt: skip
    for folder in folders:
        case = read_case(folder)
        planned = plan_case(case, SOLVERS[options.solver](), time_s=options.time, seed=options.seed)
        verdict = verify(case, planned.observations)
        weight = sum(task.weight for task in case.tasks.values())
        bound = "-" if planned.bound is None else f"{planned.bound / weight:.5f}"
        turnaround = "-" if verdict.turnaround_s is None else f"{verdict.turnaround_s:.1f}"
        name = f"{folder.parent.name}/{folder.name}"
        print(f"{name:28} {len(case.satellites):4} {len(case.tasks):5} {planned.num_collects:8} "
              f"{'yes' if verdict.is_valid else 'NO':>5} {verdict.weighted_share:7.5f} {bound:>7} "
              f"{verdict.completed_share:7.4f} {turnaround:>7} {verdict.energy_wh:8.1f} "
              f"{planned.num_dropped:7} {planned.cpu_s:6.1f} "
              f"{planned.termination}", flush=True)  # fmt: skip
        for failure in verdict.failures:
            print(f"    {failure.time} {failure.satellite_id} {failure.task_id}: {failure.reason}")
        if options.out is not None:
            target = options.out / name
            target.mkdir(parents=True, exist_ok=True)
            write_solution(case, planned.observations, target / "solution.json")


if __name__ == "__main__":
    main()
