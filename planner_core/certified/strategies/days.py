"""A fleet whose images lose worth as they age: one satellite's day after another, planned anew.

Each is planned beside the others', from a plan that has all images brought down.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner_core.budget import Budget, Progress
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.queue_plans import replanned_day
from planner_core.certified.lns.settled_contacts import with_contacts
from planner_core.certified.strategies.half_life_steps import (
    Contacts,
    bettered_by_windows,
    contacts_of,
)
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import is_fleet
from planner_core.certified.strategies.whole_program import exhaust
from planner_core.certified.tuning import TUNING
from planner_core.problem import Problem
from planner_core.problem.delivery import without_half_life
from planner_core.problem.plan import Plan


def days(search: Search) -> Iterator[None]:
    """Plan a fleet without its half-life, and let its satellites plan their days anew from that.

    The first search is interrupted for the second. Once it has ended it begins afresh. Two fleets
    drawn at random earn 277.0 and 204.0 after 40 CPU seconds; with a quarter of the time for the
    first, once, 267.3 and 197.9.
    """
    best, engine = search.best, search.engine(ResourceSearch)
    undecayed = without_half_life(search.problem)
    days, breaks = DayByDay(engine, search.engine(Contacts)), _Breaks(search.budget)
    num_idle, ended = 0, list[Plan]()
    while num_idle < TUNING.patience and not best.is_done:
        before = best.reward
        plan = _without_half_life(search, undecayed, search.seed + len(ended), days, breaks)
        days.better(plan)
        num_idle = 0 if best.reward > before else num_idle + 1
        yield
        if plan in ended:
            break  # so few tasks that every search ends with the same
        ended.append(plan)
    if not best.is_done:
        search.engine(Contacts).lower(0, is_last=True)


def _without_half_life(
    search: Search, undecayed: Problem, seed: int, days: DayByDay, breaks: _Breaks
) -> Plan:
    """Return the best plan of the problem whose images keep their worth.

    All plans on the way to it are offered to the search that counts the half-life.
    """
    engine = search.engine(ResourceSearch)

    def look(_: Progress) -> None:
        engine.offer(inner.plan)
        engine.best.report("plans")
        if breaks.is_due():
            days.better(inner.plan)
            breaks.end()

    # A small fleet goes on with sets of contacts, and does not wait for the whole program here.
    share = 1.0 if is_fleet(engine.problem) else TUNING.first_share
    inner = Incumbent(undecayed, search.budget.part(share, look), search.best.gap)
    search.beside(inner, seed, without=exhaust).solved()
    return inner.plan


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


class DayByDay:
    """A fleet's satellites plan their days in turn, beside the ascent on multipliers.

    After 20 CPU seconds four satellites that turn to the sun earn 459.9 and 332.8 at half-lives of
    12 and 3 h, and 413.6 and 304.3 by contacts that the ascent names.
    """

    def __init__(self, search: ResourceSearch, contacts: Contacts) -> None:
        self._search, self._contacts, self._number = search, contacts, 0

    def better(self, plan: Plan) -> None:
        """Plan days anew from a plan, as long as a round of them gains anything.

        Parameters
        ----------
        plan
            One in which images come down, as it is without a half-life.
        """
        plan = _offered(self._search, plan)
        if self._number == 0:
            self._contacts.lower(TUNING.rounds)
        reached = -np.inf
        while (earned := _earned(self._search.best, plan)) > reached:
            reached = earned
            plan = _replanned(self._search, plan, self._search.seed + self._number)
            self._number += 1
            self._contacts.lower(TUNING.rounds)


def _earned(best: Incumbent, plan: Plan) -> float:
    """Return what a plan earns; nothing where time is over or it is not valid."""
    timeline = best.judge(plan)
    return timeline.reward if timeline.is_valid and not best.is_done else -np.inf


def _replanned(search: ResourceSearch, plan: Plan, seed: int) -> Plan:
    """Return a plan with each satellite's day planned anew where that is better, then windows."""
    best, problem = search.best, search.problem
    rng = np.random.default_rng(seed)
    for index in rng.permutation(len(problem.satellites)).tolist():
        satellite = problem.satellites[index]
        if best.is_done:
            break
        if len(satellite) == 0:
            continue
        new = replanned_day(
            problem, plan, satellite, rng, search.budget.stop, TUNING.levels_per_collect
        )
        if new is not None and _earned(best, new) > _earned(best, plan):
            plan = new
    contacts = list(contacts_of(problem, plan))
    part = with_contacts(problem, contacts, plan, best.judge(plan))
    bettered = bettered_by_windows(best, part, plan, seed)
    if _earned(best, bettered) > _earned(best, plan):
        plan = bettered
    plan = _offered(search, plan)
    best.report("plans")
    return plan


def _offered(search: ResourceSearch, plan: Plan) -> Plan:
    """Return a plan that was offered, or the best one, which may be that with more contacts.

    Of two that earn about the same the former, in which more images come down. Two fleets over 30
    stations come within 1.4 and 1.7 % after 20 CPU seconds, and within 2.0 and 1.9 from that alone.
    """
    search.offer(plan)
    enough = (1.0 - TUNING.little) * search.best.reward
    return plan if _earned(search.best, plan) >= enough else search.best.plan
