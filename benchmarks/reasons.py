"""The cost of reasons, relative to the scenario's access search (``python -m benchmarks.reasons``).

Prints CPU seconds, each the median of several runs after a warm-up: access search, compiling,
the reasons of all targets (with the smallest changes), and one target explained in detail. Ends
with status 1 if the reasons cost as much as the access search.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable

from benchmarks.missions import paper_scenario
from planner_core.access.scenario_opportunities import compute_opportunities
from planner_core.budget import Budget
from planner_core.build import build_problem
from planner_core.reasons.at_length import explain_target
from planner_core.reasons.explain import explain
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solver
from planner_core.solvers.registry import ForwardSearch, Rule

RUNS = 9


def median_cpu_s(work: Callable[[], object]) -> float:
    """Return the median CPU seconds of some work after a warm-up."""
    work()
    times = []
    for _ in range(RUNS):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return statistics.median(times)


def row(num_targets: int, use_resources: bool, solver: Solver) -> bool:
    """Print one row; return whether the reasons cost less than the accesses."""
    scenario = paper_scenario(num_targets, 0, use_resources=use_resources)
    computed = compute_opportunities(scenario, Budget())
    problem = build_problem(scenario, computed, Budget())
    plan = solver.solve(problem, Budget(), 0).plan
    timeline = replay(problem, plan)
    reasons = {o.target: o.reason for o in explain(problem, plan, timeline) if o.reason}
    target = next(target for target, reason in reasons.items() if reason.opportunity)
    access_s = median_cpu_s(lambda: compute_opportunities(scenario, Budget()))
    compile_s = median_cpu_s(lambda: build_problem(scenario, computed, Budget()))
    reasons_s = median_cpu_s(lambda: explain(problem, plan, timeline))
    one_s = median_cpu_s(lambda: explain_target(problem, plan, timeline, target))
    counts = dict(Counter(reason.code for reason in reasons.values()))
    print(f"{num_targets:7} {use_resources!s:>9} {solver.name:>14} {len(reasons):8} "
          f"{access_s:8.4f} {compile_s:9.4f} {reasons_s:9.4f} {one_s:8.4f}  {counts}")  # fmt: skip
    return reasons_s < access_s


def main() -> int:
    """Print the table."""
    print(f"{'targets':>7} {'resources':>9} {'solver':>14} {'left out':>8} {'access_s':>8} "
          f"{'compile_s':>9} {'reasons_s':>9} {'one_s':>8}")  # fmt: skip
    is_cheaper = [
        row(num_targets, use_resources, solver)
        for num_targets in (1000, 4000)
        for use_resources in (True, False)
        for solver in (Rule(), ForwardSearch())
    ]
    return 0 if all(is_cheaper) else 1


if __name__ == "__main__":
    sys.exit(main())
