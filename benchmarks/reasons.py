"""What reasons cost, beside the accesses of the same scenario (``python -m benchmarks.reasons``).

Prints CPU seconds, each the median of several runs after a warm-up: access search, compiling,
the reasons of all targets (with the smallest changes), and one target explained at length. Ends
with status 1 where the reasons cost as much as the access search.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable

from benchmarks.missions import paper_scenario
from planner_core.build import build_problem, compute_opportunities
from planner_core.explanation import explain_target
from planner_core.reasons import explain
from planner_core.solvers import ForwardSearch, Rule
from planner_core.solvers.base import Budget
from planner_core.timeline import replay

RUNS = 9


def median_cpu_s(work: Callable[[], object]) -> float:
    """Return the median CPU seconds of some work, warm."""
    work()
    times = []
    for _ in range(RUNS):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return statistics.median(times)


def main() -> int:
    """Print the table."""
    is_cheaper = True
    print(f"{'targets':>7} {'resources':>9} {'solver':>14} {'left out':>8} {'access_s':>8} "
          f"{'compile_s':>9} {'reasons_s':>9} {'one_s':>8}")  # fmt: skip
    for num_targets in (1000, 4000):
        for use_resources in (True, False):
            scenario = paper_scenario(num_targets, 0, use_resources=use_resources)
            budget = Budget()
            computed = compute_opportunities(scenario, budget)
            access_s = median_cpu_s(lambda s=scenario: compute_opportunities(s, Budget()))
            compile_s = median_cpu_s(lambda s=scenario, c=computed: build_problem(s, c, Budget()))
            problem = build_problem(scenario, computed, budget)
            for solver in (Rule(), ForwardSearch()):
                plan = solver.solve(problem, budget, 0).plan
                timeline = replay(problem, plan)
                outcomes = explain(problem, plan, timeline)
                left = [o for o in outcomes if o.reason is not None]
                reasons_s = median_cpu_s(lambda p=problem, q=plan, t=timeline: explain(p, q, t))
                target = next(o.target for o in left if o.reason and o.reason.opportunity)
                one_s = median_cpu_s(
                    lambda p=problem, q=plan, t=timeline, i=target: explain_target(p, q, t, i)
                )
                is_cheaper = is_cheaper and reasons_s < access_s
                print(f"{num_targets:7} {use_resources!s:>9} {solver.name:>14} {len(left):8} "
                      f"{access_s:8.4f} {compile_s:9.4f} {reasons_s:9.4f} {one_s:8.4f}  "
                      f"{dict(Counter(o.reason.code for o in left if o.reason))}")  # fmt: skip
    return 0 if is_cheaper else 1


if __name__ == "__main__":
    sys.exit(main())
