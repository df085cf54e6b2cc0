"""One run of one solver on one problem: the referee's result, and the time it took."""

from __future__ import annotations

import functools
import json
import math
import statistics
import time
from dataclasses import dataclass

from benchmarks.cpu_budget import CpuBudget
from benchmarks.missions import problem_of
from benchmarks.paper.readings import Reading
from benchmarks.paper.settings import make_solver
from planner_core.budget import Budget, Termination
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.problem import COLLECT, Problem
from planner_core.referee.replay import replay
from planner_core.solvers.base import Solution, Solver

_TIMED_RUNS = 3
_REPEAT_WITHIN_S = 0.1  # quicker runs are repeated, and the median time is kept


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A run to make; equal tasks are run once.

    Attributes
    ----------
    params
        The solver's parameters as ``settings.as_text`` writes them.
    limit_s
        CPU seconds that an exact solver may take, 0 for no limit.
    """

    reading: Reading
    use_resources: bool
    num_targets: int
    draw: int
    solver: str
    params: str
    seed: int = 0
    limit_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """The result of a task.

    Attributes
    ----------
    reward
        The referee's: an image by an action that breaks a rule earns nothing.
    images
        Distinct targets imaged, regardless of violations: what the paper seems to count.
    violations, repeats
        Rules broken; images of targets that already had one.
    bound
        The best bound on any plan of this problem, proven by this run or by the quick bound.
    seconds
        CPU time of the solving process in the solver alone: other load hardly matters.
    cost_s
        CPU time of the whole run, including compilation, building the problem, repeats and judging.
    """

    reward: float
    images: int
    violations: int
    repeats: int
    bound: float
    seconds: float
    cost_s: float
    termination: str


def run_task(task: Task, deadline: float) -> Outcome | None:
    """Return the outcome, or None if the study's time (``time.time``) ended first."""
    if time.time() >= deadline:
        return None
    began_s = time.process_time()
    problem = _problem(task.reading, task.use_resources, task.num_targets, task.draw)
    solver = make_solver(task.solver, json.loads(task.params))
    _warm(task.solver, task.params, task.use_resources)
    solution, seconds = _timed(solver, problem, task, deadline)
    if solution.termination is Termination.TIME_LIMIT and time.time() >= deadline:
        return None
    return _judged(task, problem, solution, seconds, began_s)


def _timed(solver: Solver, problem: Problem, task: Task, deadline: float) -> tuple[Solution, float]:
    limit_s = task.limit_s or math.inf
    taken: list[float] = []
    while True:
        began_s = time.process_time()
        solution = solver.solve(problem, CpuBudget(limit_s, deadline), task.seed)
        taken.append(time.process_time() - began_s)
        if len(taken) == _TIMED_RUNS or sum(taken) > _REPEAT_WITHIN_S:
            return solution, statistics.median(taken)


def _judged(
    task: Task, problem: Problem, solution: Solution, seconds: float, began_s: float
) -> Outcome:
    timeline = replay(problem, solution.plan)
    table = problem.opportunities
    rows = [action.opportunity for action in solution.plan.actions]
    images = {int(table.site[row]) for row in rows if table.kind[row] == COLLECT}
    repeats = sum(violation.code == "duplicate" for violation in timeline.violations)
    proven = _quick_bound(task.reading, task.use_resources, task.num_targets, task.draw)
    return Outcome(
        reward=timeline.reward,
        images=len(images),
        violations=len(timeline.violations) - repeats,
        repeats=repeats,
        bound=proven if solution.bound is None else min(proven, solution.bound),
        seconds=seconds,
        cost_s=time.process_time() - began_s,
        termination=str(solution.termination),
    )


@functools.lru_cache(maxsize=6)
def _problem(reading: Reading, use_resources: bool, num_targets: int, draw: int) -> Problem:
    return problem_of(reading.scenario(num_targets, draw, use_resources=use_resources))


@functools.lru_cache(maxsize=256)
def _quick_bound(reading: Reading, use_resources: bool, num_targets: int, draw: int) -> float:
    problem = _problem(reading, use_resources, num_targets, draw)
    return quick_bound(problem, 0.0).value


@functools.lru_cache(maxsize=4096)
def _warm(solver: str, params: str, use_resources: bool) -> None:
    """Run once on a few targets, so that no timing contains compilation."""
    chosen = json.loads(params)
    if "num_simulations" in chosen:
        chosen["num_simulations"] = 1
    few = _problem(Reading(), use_resources, 20, 0)
    make_solver(solver, chosen).solve(few, Budget(1.0), 0)
