"""Plans and bounds with continuous starts, over the paper's mission without resources.

Run ``python -m benchmarks.continuous [TARGETS DRAW ...]``; times are CPU seconds of one core.
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import replace

from benchmarks.missions import paper_scenario, problem_of
from planner_core.budget import Budget, Progress
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified

_CASES = ((500, 0), (1000, 0), (1000, 1), (2000, 0))


def measure(num_targets: int, draw: int) -> str:
    asked = replace(paper_scenario(num_targets, draw, use_resources=False), continuous_starts=True)
    problem = problem_of(asked)
    begun = time.process_time()
    improved: list[tuple[float, float, float]] = []

    def note(progress: Progress) -> None:
        reward, bound = progress.reward or 0.0, progress.bound or 0.0
        if not improved or (reward, bound) != improved[-1][1:]:
            improved.append((time.process_time() - begun, reward, bound))

    solution = Certified().solve(problem, Budget(report=note), 0)
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid
    assert solution.bound is not None
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    curve = " ".join(f"{at:.0f}:{reward:.0f}/{bound:.0f}" for at, reward, bound in improved[::3])
    return (
        f"{num_targets}/{draw}: {timeline.reward:.0f} of at most {solution.bound:.0f}, "
        f"{time.process_time() - begun:.1f} s, {memory_mb:.0f} MB; {curve}"
    )


def main() -> None:
    numbers = [int(word) for word in sys.argv[1:]]
    for case in list(zip(numbers[::2], numbers[1::2], strict=True)) or _CASES:
        print(measure(*case), flush=True)


if __name__ == "__main__":
    main()
