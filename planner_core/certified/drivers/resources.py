"""With battery and recorder: plans and bounds by exact programmes that close in on each other.

Where energy is short the programme without prices bounds the best plan within an image or two,
and the same programme over choices of tasks finds one. Where targets are few as well, prices
lower the bound. The relaxations of promising sets of contacts tell prices and, for each set, the
few tasks that make a small mixed-integer program. Where agility alone decides, so does the proof
without resources.
"""

from __future__ import annotations

from dataclasses import replace

from planner_core.budget import Budget, Progress
from planner_core.certified.drivers.latency import DayByDay, close_in_on_the_ground
from planner_core.certified.drivers.resource_fleet import close_in_fleet
from planner_core.certified.drivers.resource_steps import ResourceSearch
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import TurnSearch
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.solvers.base import Solution
from planner_core.solvers.rule import Rule


def solve_with_resources(problem: Problem, budget: Budget, seed: int, gap: float) -> Solution:
    """Return the best plan of a problem with resources, and its proof."""
    search = ResourceSearch(Incumbent(problem, budget, gap), seed)
    unit = _begin(search)
    if len(problem.opportunities) == 0:
        return search.best.solution()
    if _has_half_life(problem):
        if search.is_shared and not search.best.is_done:
            _close_in_day_by_day(search)
        if not (search.best.is_done or search.is_fleet):
            close_in_on_the_ground(search, unit)
        can_exhaust = not search.is_large
    else:
        _close_in_on_worth(search, unit)
        can_exhaust = not search.is_fleet
    if can_exhaust and not search.best.is_done:
        search.exhaust()
    return search.best.solution()


def _has_half_life(problem: Problem) -> bool:
    return problem.counts_delivery and problem.objective.half_life_s is not None


def _begin(search: ResourceSearch) -> float:
    """Find a first plan and a first bound; return the unit of worth for exact programmes."""
    problem, best = search.problem, search.best
    search.offer(Rule().solve(problem, Budget(), search.seed).plan)
    if len(problem.opportunities) == 0:
        return best.unit
    first_bound = lagrangian_bound if _has_half_life(problem) else quick_bound
    best.lower(first_bound(problem, best.reward))
    if best.unit == 0.0 or best.bound.value / best.unit > TUNING.max_units:
        return max(best.bound.value / TUNING.max_units, 1e-12)
    return best.unit


def _close_in_on_worth(search: ResourceSearch, unit: float) -> None:
    """Search for plans and bounds where no image is worth less for coming down late."""
    if search.is_shared and not search.best.is_done:
        close_in_fleet(search, unit)
    if search.is_fleet:
        return
    search.choose(unit)
    turns = search.turns(unit)
    search.search(turns, TUNING.rounds)
    if not search.best.is_done:
        search.relax_whole()
    _close_in(search, turns)


def _close_in_day_by_day(search: ResourceSearch) -> None:
    """Plan a fleet without its half-life, and let its satellites plan their days anew from that.

    The first search is interrupted for the second. Once it has ended it begins afresh. Two fleets
    drawn at random earn 277.0 and 204.0 after 40 CPU seconds; with a quarter of the time for the
    first, once, 267.3 and 197.9.
    """
    problem, best = search.problem, search.best
    plain = replace(problem, worth=problem.worth_on_ground, full_worth=None)
    undecayed = with_objective(plain, replace(problem.objective, half_life_s=None))
    days, breaks = DayByDay(search), _Breaks(search.budget)
    num_idle, ended = 0, list[Plan]()
    while num_idle < TUNING.patience and not best.is_done:
        before = best.reward
        plan = _without_half_life(search, undecayed, search.seed + len(ended), days, breaks)
        days.better(plan)
        num_idle = 0 if best.reward > before else num_idle + 1
        if plan in ended:
            break  # so few tasks that every search ends with the same
        ended.append(plan)
    days.prove()


def _without_half_life(
    search: ResourceSearch, undecayed: Problem, seed: int, days: DayByDay, breaks: _Breaks
) -> Plan:
    """Return the best plan of the problem whose images keep their worth.

    All plans on the way to it are offered to the search that counts the half-life.
    """

    def look(_: Progress) -> None:
        search.offer(inner.best.plan)
        search.best.report("plans")
        if breaks.is_due():
            days.better(inner.best.plan)
            breaks.end()

    # A small fleet goes on with sets of contacts.
    share = 1.0 if search.is_fleet else TUNING.first_share
    best = Incumbent(undecayed, search.budget.part(share, look), search.best.gap)
    inner = ResourceSearch(best, seed)
    _close_in_on_worth(inner, _begin(inner))
    return inner.best.plan


class _Breaks:
    """When a search is interrupted: after a share of the time, then after half of what is left."""

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._next_s = (1.0 - TUNING.beginning) * self._left_s

    @property
    def _left_s(self) -> float:
        return self._budget.remaining_s() or 0.0

    def is_due(self) -> bool:
        """Whether it is time; never where time has no end."""
        return self._left_s < self._next_s

    def end(self) -> None:
        """Let the search go on."""
        self._next_s = 0.5 * self._left_s


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
            # Programs leave room for windows: under clouds 231.9 for 231.6, with rewards of 1 to 10
            # 2,505 for 2,499 of 2,534 after 20 CPU seconds.
            search.search(turns, TUNING.several)
        idle_rounds = 0 if is_new or is_better else idle_rounds + 1
