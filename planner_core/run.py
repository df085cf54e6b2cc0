"""From a scenario to a judged plan: the table of contents of the core."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, replace

from planner_core.bounds.bound import Bound
from planner_core.bounds.lagrangian import lagrangian_bound
from planner_core.bounds.resource_bound import quick_bound
from planner_core.build import ScenarioOpportunities, build_problem, compute_opportunities
from planner_core.domain import Scenario
from planner_core.problem import Problem
from planner_core.reasons import TargetOutcome, explain
from planner_core.solvers.base import Budget, Progress, Solution, Solver
from planner_core.timeline import Timeline, replay


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Runtime:
    """Seconds that each phase took."""

    access: float
    compile: float
    solve: float
    verify: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """A solver's answer with everything that the referee has to say of it.

    Attributes
    ----------
    bound
        None where no bound covers the freedom that the plan had (continuous starts).
    outcomes
        Every target once, in the scenario's order.
    """

    scenario: Scenario
    opportunities: ScenarioOpportunities
    problem: Problem
    solution: Solution
    timeline: Timeline
    bound: Bound | None
    outcomes: tuple[TargetOutcome, ...]
    runtime_s: Runtime


def plan_scenario(
    scenario: Scenario,
    solver: Solver,
    seed: int,
    budget: Budget,
    computed: ScenarioOpportunities | None = None,
    known_bound: Bound | None = None,
) -> Judged:
    """Return the judged plan of ``solver``.

    Parameters
    ----------
    computed, known_bound
        What earlier plans of the same scenario have found out already. The plan itself does
        not depend on it.

    Raises
    ------
    PropagationFailed
        Where SGP4 cannot carry an orbit through the horizon.
    Cancelled
        Where the budget ended before there was a problem to plan.
    """
    clock = [time.perf_counter()]
    opportunities = computed or compute_opportunities(scenario, budget)
    clock.append(time.perf_counter())
    problem = build_problem(scenario, opportunities, budget)
    clock.append(time.perf_counter())
    budget.report(Progress(phase="solve", fraction=0.0))
    solution = solver.solve(problem, budget, seed)
    clock.append(time.perf_counter())
    budget.report(Progress(phase="verify", fraction=0.0))
    timeline = replay(problem, solution.plan)
    bound = None
    if not problem.continuous_starts:
        bound = _best_bound(problem, solution, timeline.reward, budget, known_bound)
    budget.report(
        Progress(
            phase="verify",
            fraction=0.5,
            reward=timeline.reward,
            bound=bound.value if bound else None,
        )
    )
    outcomes = explain(problem, solution.plan, timeline)
    clock.append(time.perf_counter())
    access, compile_, solve, verify = (b - a for a, b in itertools.pairwise(clock))
    return Judged(
        scenario=scenario,
        opportunities=opportunities,
        problem=problem,
        solution=solution,
        timeline=timeline,
        bound=bound,
        outcomes=outcomes,
        runtime_s=Runtime(access=access, compile=compile_, solve=solve, verify=verify),
    )


def _best_bound(
    problem: Problem, solution: Solution, reward: float, budget: Budget, known: Bound | None
) -> Bound:
    """Return the lowest of what is known, what the solver has proven and a quick bound."""
    proven = None if known is None else replace(known, value=max(known.value, reward))
    if solution.proven is not None:
        own = replace(solution.proven, value=max(solution.proven.value, reward))
        proven = own if proven is None or own.value < proven.value else proven
    if proven is not None and (known is not None or proven.value <= reward):
        return proven
    if budget.is_cancelled:
        # Someone who cancels wants the answer now: prices stay rough.
        quick = lagrangian_bound(problem, reward, 0)
    else:
        quick = quick_bound(problem, reward)
    return proven if proven is not None and proven.value < quick.value else quick
