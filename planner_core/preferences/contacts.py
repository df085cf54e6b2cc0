"""Removal of contacts that a plan does not need."""

from __future__ import annotations

from planner_core.budget import Budget
from planner_core.certified.lns.downlinks import Accepts
from planner_core.problem.plan import Plan
from planner_core.referee.view import View


def without_contacts(view: View, accepts: Accepts, budget: Budget) -> View:
    """Return the plan without unnecessary contacts, tried from the last one backward."""
    kept = set(view.problem.kept_rows.tolist())
    for contact in reversed(view.contacts):
        if budget.is_spent():
            break
        if contact.opportunity in kept:
            continue
        fewer = Plan(tuple(action for action in view.plan.actions if action != contact))
        trial = View.of(view.problem, fewer)
        if accepts(trial):
            view = trial
    return view
