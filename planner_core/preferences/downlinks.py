"""Contacts that a search has left aside, though images would earn more with them."""

from __future__ import annotations

from planner_core.budget import Budget
from planner_core.preferences.aims import View
from planner_core.preferences.contacts import with_contacts
from planner_core.problem import Problem
from planner_core.problem.plan import Plan


def with_more_downlinks(problem: Problem, plan: Plan, budget: Budget) -> Plan:
    """Return the plan with contacts that fit beside its images and let them earn more."""
    view = View.of(problem, plan)
    images = view.timeline.collected.values()
    old = [one for one in view.timeline.brought_down if problem.on_board[one.image].is_waiting]
    are_down = all(i.is_downlinked for i in images) and all(i.delivered_s is not None for i in old)
    is_settled = problem.objective.half_life_s is None and are_down
    if not problem.counts_delivery or not view.timeline.is_valid or is_settled:
        return plan
    best = view.timeline.reward

    def accepts(trial: View) -> bool:
        nonlocal best
        if not trial.timeline.is_valid or trial.timeline.reward <= best:
            return False
        best = trial.timeline.reward
        return True

    return with_contacts(view, accepts, budget).plan
