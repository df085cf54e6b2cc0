"""One case of the suite in this process: all that the suite uses of the planner.

Only the public path from a scenario to a judged plan is used, so the package can be copied into
the checkout of another release and run there; if modules have other names, only this file changes.
"""

from __future__ import annotations

import math
import resource
import time
from dataclasses import dataclass
from typing import Any, Final

from numba.core import event

from benchmarks.cpu_budget import CpuBudget
from benchmarks.missions import problem_of
from benchmarks.suite.families import FAMILIES, scenario_of, warm_up_of
from planner_core.budget import Progress
from planner_core.problem import Problem
from planner_core.referee.replay import replay
from planner_core.solvers.registry import Certified

LEVELS: Final = (0.02, 0.01, 0.005, 0.0)
"""Gaps for which the suite records when they were first reached."""

_ROUNDING: Final = 1e-6  # relative; rewards to which bounds are stated
_WARM_UP_S: Final = 20.0
_PATIENCE: Final = 10.0  # seconds of the clock that each CPU second may take


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run: a mission of a family, a seed and CPU seconds."""

    family: str
    draw: int
    seed: int
    budget_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """The result of a case.

    Attributes
    ----------
    bound
        Infinite if nothing was proven.
    to_level_s
        CPU seconds until the gap was first within each of ``LEVELS``, None if it never was.
    compiled_s
        Seconds of compilation within the clock: such a run says nothing about speed.
    """

    reward: float
    bound: float
    to_level_s: tuple[float | None, ...]
    used_s: float
    peak_mb: float
    compiled_s: float


class Curve:
    """A listener to progress that records when each gap was first reached."""

    def __init__(self) -> None:
        self._began_s = time.process_time()
        self._reward, self._bound = 0.0, math.inf
        self.to_level_s: list[float | None] = [None] * len(LEVELS)

    def __call__(self, progress: Progress) -> None:
        """Take the best reward and the best bound so far."""
        self.note(progress.reward, progress.bound, time.process_time() - self._began_s)

    def note(self, reward: float | None, bound: float | None, used_s: float) -> None:
        """Take a reward and a bound; None for an unknown one."""
        self._reward = max(self._reward, 0.0 if reward is None else reward)
        self._bound = min(self._bound, math.inf if bound is None else bound)
        for i, level in enumerate(LEVELS):
            is_reached = self._bound - self._reward <= (level + _ROUNDING) * self._bound
            if self.to_level_s[i] is None and math.isfinite(self._bound) and is_reached:
                self.to_level_s[i] = used_s


def run_case(case: Case) -> Result:
    """Plan one case, after a warm-up; only the search itself is on the clock.

    Raises
    ------
    AssertionError
        If the referee finds a violation.
    """
    warm_up(case.family)
    problem = problem_of(scenario_of(FAMILIES[case.family], case.draw))
    return solve(problem, case.seed, case.budget_s)


def warm_up(family: str) -> None:
    """Load the kernels that a family needs."""
    solve(problem_of(warm_up_of(FAMILIES[family])), 0, _WARM_UP_S)


def solve(problem: Problem, seed: int, budget_s: float) -> Result:
    """Plan a built problem in the given CPU seconds of this process.

    Raises
    ------
    AssertionError
        If the referee finds a violation.
    """
    compiled_s: list[float] = []
    with event.install_timer("numba:compile", compiled_s.append):
        result = _solve(problem, seed, budget_s)
    return Result(**result, compiled_s=sum(compiled_s))


def _solve(problem: Problem, seed: int, budget_s: float) -> dict[str, Any]:
    budget = CpuBudget(budget_s, time.time() + _PATIENCE * budget_s)
    budget.report = curve = Curve()
    began_s = time.process_time()
    solution = Certified().solve(problem, budget, seed)
    used_s = time.process_time() - began_s
    timeline = replay(problem, solution.plan)
    assert timeline.is_valid, timeline.violations[:3]
    curve.note(timeline.reward, solution.bound, used_s)
    return {
        "reward": timeline.reward,
        "bound": math.inf if solution.bound is None else solution.bound,
        "to_level_s": tuple(curve.to_level_s),
        "used_s": used_s,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
    }
