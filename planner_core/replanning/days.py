"""Whole days replanned without regard to changes, if moves near the plan find nothing better.

Battery and recorder couple distant hours: if a contact has to move, images far from it move too,
further than any window of the neighbourhood search. The result is merged with the previous plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from planner_core.budget import Budget
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.tuning import TUNING
from planner_core.problem import COLLECT, CONTACT, Ints, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted
from planner_core.solvers.sequential import blocked_rows

_MOST_TASKS: Final = 10_000  # a first day takes 0.2 s for 2,500 opportunities, 2 s for 16,700


def has_days(problem: Problem) -> bool:
    """Return whether resources count and the worth of images does not depend on their age."""
    has_half_life = problem.counts_delivery and problem.objective.half_life_s is not None
    return problem.use_resources and not has_half_life


def with_days_replanned(best: Incumbent, touched: Sequence[int], budget: Budget, seed: int) -> Plan:
    """Return a plan that earns no less than the best so far, from a search that ignores changes.

    In 12 replans of one satellite in operation, moves near the plan reached 96.3 % of the optimum
    on average and 91 % at worst, and no more with a hundred times as many moves. Merged with what
    this finds in 0.1 to 0.5 s they reached 99.4 and 97 %, changing 7 to 16 % of the actions.

    Parameters
    ----------
    touched
        Satellites to replan one after the other while the others stay fixed, if there are too
        many opportunities for all at once. Of four with 2,000 targets, the one in safe mode imaged
        222 after it instead of 215, as many as in a plan of all four from scratch.
    """
    problem, plan = best.problem, best.plan
    if len(problem.opportunities) <= _MOST_TASKS:
        return _searched(Incumbent(problem, budget, best.gap, plan, best.bound), seed)
    for satellite in touched:
        rows = _beside_others(problem, plan, satellite)
        if budget.is_spent() or len(rows) > _MOST_TASKS:
            break
        taken = np.array([action.opportunity for action in plan.actions], dtype=np.int32)
        part = restricted(problem, rows)
        own = Plan.of(part, np.flatnonzero(np.isin(rows, taken)).tolist())
        found = _searched(Incumbent(part, budget, 0.0, own), seed)
        others = taken[~np.isin(taken, rows)].tolist()
        anew = rows[[action.opportunity for action in found.actions]].tolist()
        plan = Plan.of(problem, [*others, *anew])
    return plan


def _searched(best: Incumbent, seed: int) -> Plan:
    search = ResourceSearch(best, seed)
    unit = max(best.unit, best.bound.value / TUNING.max_units)
    search.search(search.alternating(unit), TUNING.rounds)
    return best.plan


def _beside_others(problem: Problem, plan: Plan, satellite: int) -> Ints:
    """Return the rows that a satellite may take while the others' actions stay fixed, ascending."""
    table, own = problem.opportunities, problem.satellites[satellite].rows
    taken = np.array([action.opportunity for action in plan.actions], dtype=np.int32)
    others = taken[table.satellite[taken] != satellite]
    imaged = table.site[others[table.kind[others] == COLLECT]]
    is_shut = blocked_rows(problem, problem.satellites[satellite], others.tolist()) != 0
    is_free = ~is_shut & ((table.kind[own] == CONTACT) | ~np.isin(table.site[own], imaged))
    return np.sort(own[is_free]).astype(np.int32)
