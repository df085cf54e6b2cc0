"""Whole days replanned without a thought for changes, where moves near the plan get no further.

Battery and recorder tie hours together: where a contact has to move, images far apart move with
it. No window sees that far. What this finds is mixed with the plan before afterwards.
"""

from __future__ import annotations

from typing import Final

from planner_core.budget import Budget
from planner_core.certified.drivers.resource_steps import ResourceSearch
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.problem.plan import Plan

_MOST_TASKS: Final = 10_000  # 0.2 s for a first day of 2,500, and 2 s of 16,700


def can_replan_days(problem: Problem) -> bool:
    """Return whether days are short, and images have one worth whenever they come down."""
    has_half_life = problem.counts_delivery and problem.objective.half_life_s is not None
    is_short = len(problem.opportunities) <= _MOST_TASKS
    return problem.use_resources and is_short and not has_half_life


def with_days_replanned(best: Incumbent, budget: Budget, seed: int) -> Plan:
    """Return a plan that earns no less than the best so far, from a search that minds no changes.

    Of 12 replans of one satellite in operation moves near the plan came to 96.3 % of the optimum on
    average and 91 % at worst, and with a hundred times as many moves no further. Mixed with what
    this finds in 0.1 to 0.5 s they came to 99.4 and 97 %, for 7 to 16 % of the actions.
    """
    other = Incumbent(best.problem, budget, best.gap, best.plan, best.bound)
    search = ResourceSearch(other, seed)
    unit = max(other.unit, other.bound.value / TUNING.max_units)
    search.search(search.turns(unit), TUNING.rounds)
    return other.plan
