"""From a scenario to a judged plan: the table of contents of the core."""

from __future__ import annotations

import itertools
import logging
import time
from dataclasses import dataclass, replace
from typing import Final

from planner_core.access.scenario_opportunities import ScenarioOpportunities, compute_opportunities
from planner_core.budget import Budget, Progress, Termination
from planner_core.build import build_problem
from planner_core.certified.lns.downlinks import brought_down
from planner_core.certified.proofs import continuous
from planner_core.certified.proofs.bound import Bound, is_optimal
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.strategies.continuous import with_own_starts
from planner_core.domain import Scenario
from planner_core.preferences.polish import Effect, polished
from planner_core.problem import Problem
from planner_core.problem.on_board import most_on_board, without_on_board
from planner_core.reasons.explain import explain
from planner_core.reasons.reason import Search, TargetOutcome
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline
from planner_core.replanning.plan_before import PlanBefore
from planner_core.replanning.question import question_of
from planner_core.replanning.relief import flyable, replanned, within_limits
from planner_core.solvers.base import Solution, Solver

log = logging.getLogger(__name__)

_SEARCH: Final = 0.8  # of the time; the rest adds downlinks and follows preferences
_ROUNDING: Final = 1e-6  # relative tolerance for comparing rewards with bounds


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Runtime:
    """Seconds that each phase took."""

    access: float
    compile: float
    solve: float
    verify: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """A solver's solution with the referee's verdict, the bound and the reasons.

    Attributes
    ----------
    bound
        None if this plan has refuted all bounds.
    outcomes
        The outcome of each target, in the scenario's order.
    effects
        The effect on each preference, in their order.
    """

    scenario: Scenario
    opportunities: ScenarioOpportunities
    problem: Problem
    solution: Solution
    timeline: Timeline
    bound: Bound | None
    outcomes: tuple[TargetOutcome, ...]
    runtime_s: Runtime
    effects: tuple[Effect, ...] = ()


def plan_scenario(
    scenario: Scenario,
    solver: Solver,
    seed: int,
    budget: Budget,
    computed: ScenarioOpportunities | None = None,
    known_bound: Bound | None = None,
    before: PlanBefore | None = None,
) -> Judged:
    """Return the judged plan of ``solver``.

    Parameters
    ----------
    computed, known_bound
        Results of earlier plans of the same scenario. The plan itself does not depend on them.
    before
        For a replan, what the search for the previous plan has found out. It saves computing
        access and, if its multipliers still prove enough, the search for a proof.

    Raises
    ------
    PropagationFailed
        SGP4 cannot propagate an orbit through the horizon.
    Cancelled
        Somebody cancels before the problem is built. If only the time ends before that, the
        search returns the first plan that it finds.
    """
    clock = [time.perf_counter()]
    preparation = budget.until_cancelled()
    opportunities = computed or _opportunities(scenario, before, preparation)
    clock.append(time.perf_counter())
    problem = build_problem(scenario, opportunities, preparation)
    clock.append(time.perf_counter())
    budget.report(Progress(phase="solve", fraction=0.0))
    with budget.enforced():
        relieved, solution, effects = _search(scenario, problem, solver, budget, seed, before)
    clock.append(time.perf_counter())
    budget.report(Progress(phase="verify", fraction=0.0))
    timeline = replay(problem, solution.plan)
    # A replan has used the previous plan's multipliers, or has begun with a quick bound.
    has_asked = scenario.replan is not None or solver.bounds or _is_settled(problem, solution)
    bound = _best_bound(
        relieved, solution, timeline, budget, known_bound,
        wants_quick=solution.proven is None or not has_asked,
    )  # fmt: skip
    on_board = most_on_board(problem)
    if on_board > 0.0:
        bound = bound and _of_all(bound.with_on_board(on_board), timeline)
        if not _is_met(bound, timeline) and solution.termination is Termination.OPTIMAL:
            solution = replace(solution, termination=Termination.HORIZON_COMPLETE)
    budget.report(
        Progress(
            phase="verify",
            fraction=0.5,
            reward=timeline.reward,
            bound=bound.value if bound else None,
        )
    )
    searched = Search(
        is_optimal=timeline.is_valid and solution.termination is Termination.OPTIMAL,
        breadth=solver.outlook.breadth,
        contact_above=solver.outlook.contact_above,
    )
    outcomes = explain(problem, solution.plan, timeline, searched)
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
        effects=effects,
    )


def _opportunities(
    scenario: Scenario, before: PlanBefore | None, budget: Budget
) -> ScenarioOpportunities:
    """Return the opportunities, taken from the previous plan as far as they still hold."""
    kept = before.opportunities_of(scenario, budget) if before is not None else None
    return kept or compute_opportunities(scenario, budget)


def _search(
    scenario: Scenario,
    problem: Problem,
    solver: Solver,
    budget: Budget,
    seed: int,
    before: PlanBefore | None,
) -> tuple[Problem, Solution, tuple[Effect, ...]]:
    """Return the problem that was searched, the plan to fly, and the effects of preferences."""
    own = without_on_board(problem)
    relieved = within_limits(own)
    # A replan changes as little as possible, so preferences are not followed.
    aims = scenario.objective.prefer if scenario.replan is None else ()
    if scenario.replan is None:
        # The paper's solvers rely on a later step to downlink images.
        is_followed = bool(aims) or (problem.counts_delivery and not solver.bounds)
        search = budget.part(_SEARCH) if is_followed else budget
        found = solver.solve(relieved, search, seed)
        solution = flyable(own, relieved, found)
    else:
        asked = None if before is None else before.asked_by(scenario)
        question = replace(question_of(scenario, problem, asked), problem=own)
        multipliers = None if before is None else before.multipliers
        solution = replanned(question, relieved, solver, budget, seed, multipliers)
    if problem.continuous_starts:
        solution = with_own_starts(problem, solution, budget)
    is_optimal = solution.termination is Termination.OPTIMAL
    if problem.on_board or (scenario.replan is None and not is_optimal):
        more = brought_down(problem, solution.plan, budget)
        solution = replace(solution, plan=more)
    effects: tuple[Effect, ...] = ()
    if aims:
        polish = polished(problem, solution.plan, aims, budget, seed)
        solution, effects = replace(solution, plan=polish.plan), polish.effects
    return relieved, solution, effects


def _is_settled(problem: Problem, solution: Solution) -> bool:
    """Return whether the search's converged multipliers prove more than a quick bound can."""
    is_lagrangian = solution.proven is not None and solution.proven.proof == "lagrangian"
    return is_lagrangian and not problem.use_resources


def _best_bound(
    problem: Problem,
    solution: Solution,
    timeline: Timeline,
    budget: Budget,
    known: Bound | None,
    *,
    wants_quick: bool,
) -> Bound | None:
    """Return the lowest of the known bound, the solver's and, if wanted, a quick one.

    All of them bound what new images earn. An invalid plan can earn more than any valid one; the
    bound is then raised to its reward. A valid plan that earns more than a bound shows that the
    bound is wrong, and it is dropped.
    """
    reward = timeline.earned_by_new
    known = known and known.without_on_board()
    claimed = (bound for bound in (known, solution.proven) if bound is not None)
    sound = [bound for bound in claimed if not _is_beaten(bound, timeline, reward)]
    is_loose = not any(is_optimal(reward, bound.value, 0.0) for bound in sound)
    if known not in sound and is_loose and (wants_quick or not sound):
        quick = _quick_bound(problem, reward, budget)
        sound = [b for b in (*sound, quick) if not _is_beaten(b, timeline, reward)]
    if not sound:
        return None
    best = min(sound, key=lambda bound: bound.value)
    return replace(best, value=max(best.value, reward))


def _quick_bound(problem: Problem, reward: float, budget: Budget) -> Bound:
    if problem.continuous_starts:
        return continuous.quick_bound(problem)
    # Whoever cancels wants the answer now, so multipliers stay rough.
    return (
        lagrangian_bound(problem, reward, 0)
        if budget.is_cancelled
        else quick_bound(problem, reward)
    )


def _is_met(bound: Bound | None, timeline: Timeline) -> bool:
    """Return whether a plan reaches the bound, up to rounding."""
    return bound is not None and timeline.reward >= bound.value * (1.0 - _ROUNDING)


def _of_all(bound: Bound, timeline: Timeline) -> Bound | None:
    """Return the bound on new images and those on board; None if a valid plan exceeds it."""
    if _is_beaten(bound, timeline, timeline.reward):
        return None
    return replace(bound, value=max(bound.value, timeline.reward))


def _is_beaten(bound: Bound, timeline: Timeline, reward: float) -> bool:
    """Return whether a valid plan earns more than the bound allows; log an error if it does."""
    allowed = bound.value + _ROUNDING * max(1.0, abs(bound.value))
    is_beaten = timeline.is_valid and reward > allowed
    if is_beaten:
        log.error("the %s bound %r is below %r, which a valid plan earns", bound.proof,
                  bound.value, reward)  # fmt: skip
    return is_beaten
