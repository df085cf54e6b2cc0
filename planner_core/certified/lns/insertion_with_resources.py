"""Insertion under battery and recorder: contacts stay, and the referee judges each trial.

Tasks move as early as those before them allow. Images that then fit between two of them by agility
are inserted on trial, those of greatest worth first, and stay if the whole plan is valid and earns
more. To replan a window, a few consecutive images are dropped first.
"""

from __future__ import annotations

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.lns.insertion import fitting
from planner_core.certified.lns.route import (
    Route,
    empty_route,
    update_early,
    update_late,
)
from planner_core.certified.tuning import TUNING
from planner_core.precedence.time_windows import (
    TimeWindows,
    View,
    action_of,
    time_windows_of,
    view_of,
    with_contacts,
)
from planner_core.problem import COLLECT, Problem
from planner_core.problem.plan import Action, Plan
from planner_core.referee.replay import replay


def filled_with_resources(problem: Problem, plan: Plan, budget: Budget) -> Plan:
    """Return a plan that earns no less, with images inserted between tasks that may move."""
    timeline = replay(problem, plan, in_detail=False)
    if not timeline.is_valid:
        return plan
    for index in range(len(problem.satellites)):
        if budget.is_spent():
            break
        plan = _filled(problem, plan, index, budget, TUNING.trials)
    return plan


def replanned_window(
    problem: Problem, plan: Plan, budget: Budget, rng: np.random.Generator
) -> Plan:
    """Return the plan with a few consecutive images of one satellite dropped, others inserted."""
    table = problem.opportunities
    kept = set(problem.kept_rows.tolist())
    index = int(rng.choice(np.unique(table.satellite[[a.opportunity for a in plan.actions]])))
    own = [a for a in plan.actions if table.satellite[a.opportunity] == index]
    least, most = TUNING.window_tasks
    first = int(rng.integers(len(own)))
    dropped = {
        action
        for action in own[first : first + int(rng.integers(least, most + 1))]
        if table.kind[action.opportunity] == COLLECT and action.opportunity not in kept
    }
    left = Plan(tuple(action for action in plan.actions if action not in dropped))
    if not replay(problem, left, in_detail=False).is_valid:
        return plan
    return _filled(problem, left, index, budget, TUNING.patience, rng)


def _filled(
    problem: Problem,
    plan: Plan,
    index: int,
    budget: Budget,
    num_trials: int,
    rng: np.random.Generator | None = None,
) -> Plan:
    """Return the plan with more collects of one satellite.

    Parameters
    ----------
    num_trials
        How many trials in a row may fail.
    rng
        Draws the order of images that are worth the same; by default in order of start.
    """
    table = problem.opportunities
    own = [a for a in plan.actions if table.satellite[a.opportunity] == index]
    others = [a for a in plan.actions if table.satellite[a.opportunity] != index]
    view = view_of(problem, index)
    contacts = [a.opportunity for a in own if table.kind[a.opportunity] != COLLECT]
    spans = with_contacts(
        problem, time_windows_of(problem, index), np.array(contacts, dtype=np.int32)
    )
    if len(spans.row) == 0:
        return plan
    tasks = [_task_of(problem, spans, action) for action in own]
    reward = replay(problem, plan, in_detail=False).reward
    left = num_trials
    while left > 0 and not budget.is_spent():
        route = _route_of(spans, view, tasks)
        if route is None:
            return plan
        is_free = np.ones(len(problem.target_ids) + len(problem.station_ids), dtype=np.bool_)
        for action in (*own, *others):
            if table.kind[action.opportunity] == COLLECT:
                is_free[table.site[action.opportunity]] = False
        is_free[len(problem.target_ids) :] = False
        task, at = fitting(spans, view, route, is_free)
        drawn = np.arange(len(task)) if rng is None else rng.permutation(len(task))
        order = drawn[np.argsort(-problem.worth[spans.row[task[drawn]]], kind="stable")]
        is_better = False
        for pick in order.tolist():
            if left == 0 or budget.is_spent():
                break
            trial = [*tasks[: at[pick]], int(task[pick]), *tasks[at[pick] :]]
            actions = _actions(problem, spans, view, trial)
            if actions is None:
                continue
            tried = Plan(tuple(sorted([*others, *actions])))
            judged = replay(problem, tried, in_detail=False)
            left -= 1
            if judged.is_valid and judged.reward > reward:
                plan, reward, tasks, own = tried, judged.reward, trial, actions
                left, is_better = num_trials, True
                break
        if not is_better:
            break
    return plan


def _task_of(problem: Problem, spans: TimeWindows, action: Action) -> int:
    table = problem.opportunities
    is_its = (table.access[spans.row] == table.access[action.opportunity]) & (
        spans.close_s > action.start_s - 1e-3
    )
    return int(np.flatnonzero(is_its)[0])


def _route_of(spans: TimeWindows, view: View, tasks: list[int]) -> Route | None:
    route = empty_route(len(tasks))
    route.size[0] = len(tasks)
    route.task[:] = tasks
    is_timed = update_early(spans, view, route, 0, len(tasks)) and update_late(
        spans, view, route, len(tasks) - 1, -1
    )
    return route if is_timed else None


def _actions(
    problem: Problem, spans: TimeWindows, view: View, tasks: list[int]
) -> list[Action] | None:
    route = _route_of(spans, view, tasks)
    if route is None:
        return None
    pairs = zip(spans.row[tasks].tolist(), route.early_s.tolist(), strict=True)
    return [action_of(problem, row, start_s) for row, start_s in pairs]
