"""A plan that follows another one, and a bound on what any such plan earns.

The search starts from the previous plan, as far as it still holds, and gets a bonus for each of
its actions that it keeps: a move is made only if it gains more than the changes cost. The bound is
proven afterwards on the problem itself, so it is a bound on the reward alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from planner_core.budget import Budget, ignored
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.lns.search import WindowSearch
from planner_core.certified.proofs.bound import Bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.replanning.days import has_days, with_days_replanned
from planner_core.replanning.known import KnownMultipliers, bound_at
from planner_core.replanning.nearby import nearby
from planner_core.replanning.programs import fewest_changes, mixed
from planner_core.replanning.promises import require_promises, with_promised
from planner_core.replanning.question import Question
from planner_core.replanning.repair import LIMITS, repaired
from planner_core.replanning.undo import parts_of, undone, value, within_share
from planner_core.solvers.base import Solution, Solver

_MOVES_A_TASK: Final = 0.3
_LEAST_MOVES: Final = 600
_SHARE: Final = 0.4  # of the time for the first plan, and of what is left for moves from there
_DAYS: Final = 0.4  # of what is left then, for the search that ignores changes
_REST: Final = 0.8  # of what is left then, for the proof
_EQUAL: Final = 1e-9
_LEAST_FEWER_S: Final = 0.8
_MOST_FEWER_S: Final = 2.0
"""Time for a search for the same worth with fewer changes: after six hours of safe mode on one
satellite, 0.5 CPU seconds found 100 changes while the current plan had 79; 0.8 s with that plan
found 76, and 2 s proved that no plan has fewer."""
_TRIES: Final = 8
"""How often to try moves near the news, each time from the same start: for 16 urgent requests of
reward 10 at 24 x 10,000 the first try gained 8.2 on average, the best of four 8.6, the best of
eight 8.9; 3,500 moves a try instead of 600 gained no more, in eight times the time."""


def solve_replan(
    question: Question,
    solver: Solver,
    budget: Budget,
    seed: int,
    known: KnownMultipliers | None = None,
) -> Solution:
    """Return the plan that follows the base.

    Parameters
    ----------
    known
        The multipliers of the previous plan. They can make the search for a proof unnecessary.

    Raises
    ------
    InvalidScenario
        ``promise_not_kept``: no plan was found that images a promised target.
    """
    problem = question.problem
    start = first_plan(question, budget.part(_SHARE))
    # Moves have their own time: if the first plan took an integer program, only they improve it.
    plan = _followed(question, start, budget.part(_SHARE), seed).with_kept(problem)
    gap, verdict = getattr(solver, "gap", 0.0), question.judged(plan)
    best = Incumbent(problem, budget, gap, plan, verdict=verdict)
    best.lower(_first_bound(problem, known, best.reward))
    best.report("kept")
    is_done = best.is_done or _is_no_more_open(question, known, best)
    if not is_done and has_days(problem):
        touched = _touched(question)
        other = with_days_replanned(best, touched, budget.part(_DAYS, ignored), seed)
        plan = _better_of(question, plan, other, budget, seed)
        best.offer(plan)
        is_done = best.is_done
    if not is_done or not best.is_valid:
        # If plan and bound are apart, another search may earn more, and lowers the bound.
        found = solver.solve(problem, budget.part(_REST, ignored), seed)
        if found.proven is not None:
            best.lower(found.proven)
        plan = _better_of(question, plan, found.plan, budget, seed)
    plan = _with_fewer_changes(question, (start, plan), solver, budget, seed)
    plan = within_share(question, plan, budget)
    require_promises(question, plan)
    return _solution(question, plan, best, budget)


def _is_no_more_open(question: Question, known: KnownMultipliers | None, best: Incumbent) -> bool:
    """Return whether plan and bound are no further apart than for the previous plan.

    If so, the gap is not due to the news, and no reason to replan everything. This is only decided
    if the news is new targets alone: what lost actions would have earned is unknown.
    """
    news, problem = question.news, question.problem
    if news is None or news.lost or known is None or problem.use_resources:
        return False
    before = question.judged(Plan.of(problem, question.base.tolist()).with_kept(problem)).reward
    return best.bound.value - best.reward <= known.bound.value - before + _EQUAL


def _touched(question: Question) -> list[int]:
    """Return satellites with blocked intervals, and those that the base leads beyond a limit."""
    outages = {one.satellite for one in question.problem.pinned.blocked}
    return sorted(_broken(question) | {one for one in outages if one is not None})


def _broken(question: Question) -> set[int]:
    """Return the satellites that the rest of the base leads beyond a limit."""
    base = Plan.of(question.problem, question.base.tolist()).with_kept(question.problem)
    violations = question.judged(base).violations
    return {v.satellite for v in violations if v.code in LIMITS and not v.inherited}


def first_plan(question: Question, budget: Budget) -> Plan:
    """Return the base with the promised targets, changed as little as the limits demand."""
    problem = question.problem
    protected = set(np.flatnonzero(question.is_promised).tolist())
    base = Plan.of(problem, question.base.tolist()).with_kept(problem)
    broken = _broken(question)
    if not question.judged(base).violations:
        return with_promised(question, base)
    if broken:
        fewest = fewest_changes(question, sorted(broken), budget)
        if fewest is not None and question.may_fly(fewest.plan):
            return with_promised(question, fewest.plan)
    return with_promised(question, repaired(problem, question.base.tolist(), protected))


def _followed(question: Question, start: Plan, budget: Budget, seed: int) -> Plan:
    """Return a plan that is worth no less, kept actions counted, changed only near known news."""
    part = nearby(question, start)
    if part is None:
        return improved(question, start, budget, seed)
    own = best = part.of(start)
    for i in range(_TRIES):
        if i > 0 and budget.is_spent():
            break
        best = _best(
            part.question, best, improved(part.question, own, budget, seed + i, part.asked)
        )
    return _best(question, start, part.put_into(start, best))


def improved(
    question: Question, start: Plan, budget: Budget, seed: int, num_tasks: int | None = None
) -> Plan:
    """Return a plan whose worth, kept actions counted, is no less than that of ``start``.

    Parameters
    ----------
    num_tasks
        The number of opportunities that determines how many moves to make; all by default.
    """
    problem, searched = question.problem, question.searched
    num_tasks = len(problem.opportunities) if num_tasks is None else num_tasks
    num_moves = int(max(_LEAST_MOVES, _MOVES_A_TASK * num_tasks))
    windows: ResourceWindows | WindowSearch
    if problem.use_resources or problem.turns_in_motion:
        windows = ResourceWindows(searched, seed)
    else:
        windows = WindowSearch(searched, seed)
    windows.adopt(start)
    windows.make_moves(num_moves, budget)
    found = windows.plan.with_kept(problem)
    return undone(question, _best(question, start, found), budget)


def _better_of(question: Question, plan: Plan, other: Plan, budget: Budget, seed: int) -> Plan:
    """Return the plan or, if another earns more, the best mix of the base and both plans."""
    before, after = question.judged(plan).reward, question.judged(other).reward
    if (question.may_fly(other), after) <= (question.may_fly(plan), before + _EQUAL):
        return plan
    mix = mixed(question, (plan, other), budget, seed) if question.problem.use_resources else None
    start = other if mix is None or not question.may_fly(mix) else mix
    nearer = improved(question, with_promised(question, start), budget, seed)
    return _best(question, plan, nearer)


def _with_fewer_changes(
    question: Question, plans: Sequence[Plan], solver: Solver, budget: Budget, seed: int
) -> Plan:
    """Return the best mix of the plans with one from a search in which kept actions count.

    Moves reach only a few passes, but what keeps a battery above its limit may lie hours before.
    Returns the last of the plans if the rest of the base breaks no limit, or if there is no time.
    """
    problem, own = question.problem, plans[-1]
    left_s = budget.remaining_s()
    if not problem.use_resources or not _broken(question):
        return own
    if left_s is not None and left_s < _LEAST_FEWER_S:
        return own
    share = 1.0 if left_s is None else min(_REST, _MOST_FEWER_S / left_s)
    found = solver.solve(question.searched, budget.part(share, ignored), seed).plan
    mix = mixed(question, (*plans, found), budget, seed)
    return _best(question, own, found, *(() if mix is None else (mix,)))


def _best(question: Question, *plans: Plan) -> Plan:
    """Return the valid plan that misses fewest promises, then is worth most, then comes first."""

    def rank(plan: Plan) -> tuple[bool, int, float]:
        return question.may_fly(plan), -len(question.missing(plan)), value(question, plan)

    best = plans[0]
    for plan in plans[1:]:
        mine, other = rank(best), rank(plan)
        if other[:2] > mine[:2] or (other[:2] == mine[:2] and other[2] > mine[2] + _EQUAL):
            best = plan
    return best


def _first_bound(problem: Problem, known: KnownMultipliers | None, reward: float) -> Bound:
    """Return the bound from the previous plan's multipliers or, without those, a new one."""
    multipliers = None if known is None else known.on(problem)
    if multipliers is not None:
        return bound_at(problem, multipliers, reward)
    if problem.use_resources:
        return quick_bound(problem, reward)
    return lagrangian_bound(problem, reward)


def _solution(question: Question, plan: Plan, best: Incumbent, budget: Budget) -> Solution:
    problem = question.problem
    last = Incumbent(problem, budget, best.gap, plan, best.bound) if plan != best.plan else best
    solution = last.solution()
    kept = question.stable_worth(plan)
    # No plan counts more than the reward bound plus the bonus of keeping everything.
    summed = last.bound.value + float(question.bonus.sum())
    return replace(
        solution,
        statistics={
            **solution.statistics,
            **differences(question, plan),
            "stability_bound": max(summed, last.reward + kept),
            "base": float(question.num_base),
        },
    )


def differences(question: Question, plan: Plan) -> dict[str, float]:
    """Return how a plan differs from the base: bonus kept, actions changed, parts changed."""
    return {
        "stability": question.stable_worth(plan),
        "changed": float(question.changed(plan)),
        "parts": float(len(parts_of(question, plan))),
    }
