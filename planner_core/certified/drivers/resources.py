"""With battery and recorder: plans and bounds by exact programmes that close in on each other.

Where energy is short the programme without prices bounds the best plan within an image or two,
and the same programme over choices of tasks finds one. Where targets are few as well, prices
lower the bound. The relaxations of promising sets of contacts tell prices and, for each set, the
few tasks that make a small mixed-integer program. Where agility alone decides, so does the proof
without resources.
"""

from __future__ import annotations

from dataclasses import replace

from planner_core.budget import Budget, ignored
from planner_core.certified.drivers.latency import close_in_day_by_day, close_in_on_the_ground
from planner_core.certified.drivers.resource_fleet import close_in_fleet
from planner_core.certified.drivers.resource_steps import ResourceSearch
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import TurnSearch
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Solution
from planner_core.solvers.rule import Rule


def solve_with_resources(problem: Problem, budget: Budget, seed: int, gap: float) -> Solution:
    """Return the best plan of a problem with resources, and its proof."""
    best = Incumbent(problem, budget, gap)
    search = ResourceSearch(best, seed)
    search.offer(Rule().solve(problem, Budget(), seed).plan)
    if len(problem.opportunities) == 0:
        return search.best.solution()
    has_half_life = problem.counts_delivery and problem.objective.half_life_s is not None
    first_bound = lagrangian_bound if has_half_life else quick_bound
    search.best.lower(first_bound(problem, search.best.reward))
    unit = search.best.unit
    if unit == 0.0 or search.best.bound.value / unit > TUNING.max_units:
        unit = max(search.best.bound.value / TUNING.max_units, 1e-12)
    if has_half_life:
        if search.is_shared and not search.best.is_done:
            close_in_day_by_day(search, _without_half_life(search))
        if not (search.best.is_done or search.is_fleet):
            close_in_on_the_ground(search, unit)
        if not (search.best.is_done or search.is_large):
            search.exhaust()
        return search.best.solution()
    if search.is_shared and not search.best.is_done:
        close_in_fleet(search, unit)
    if search.is_fleet:
        return search.best.solution()
    search.choose(unit)
    turns = search.turns(unit)
    search.search(turns, TUNING.rounds)
    if not search.best.is_done:
        search.relax_whole()
    _close_in(search, turns)
    if not search.best.is_done:
        search.exhaust()
    return search.best.solution()


def _without_half_life(search: ResourceSearch) -> Plan:
    """Return a good plan of the fleet in which images come down, whenever that is."""
    problem = search.problem
    lasting = replace(problem, objective=replace(problem.objective, half_life_s=None))
    quiet = search.budget.part(TUNING.beginning, ignored)
    return solve_with_resources(lasting, quiet, search.seed, search.best.gap).plan


def _close_in(search: ResourceSearch, turns: TurnSearch) -> None:
    """Search for multipliers and plans in turn, until neither gets anywhere."""
    best = search.best
    if best.is_done:
        return
    prices = search.first_prices()
    idle_rounds = 0
    while idle_rounds < TUNING.several and not best.is_done:
        is_new = search.relax_sets(prices, turns)
        # Where steps take long, a search for the last image is tried before them.
        is_better = search.is_large and not is_new and search.fix_contacts(is_last=True)
        if not is_better:
            search.price(prices, TUNING.tries if is_new else TUNING.patience)
            is_better = search.fix_contacts(is_last=False)
        if not is_new and not is_better:
            is_better = search.fix_contacts(is_last=True)
            is_better |= search.search(turns, TUNING.rounds)
        if is_better and turns.problem is search.problem:
            turns.adopt(best.plan)
        idle_rounds = 0 if is_new or is_better else idle_rounds + 1
