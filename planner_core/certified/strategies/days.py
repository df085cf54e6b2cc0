"""A fleet whose images lose worth as they age: one satellite's day after another is replanned.

The others keep theirs meanwhile. The first plan is that of a search in which images keep their
worth, which brings them down.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner_core.budget import Progress
from planner_core.certified.driver import Search, slices_beyond_the_first_plan
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.queue_plans import replanned_day
from planner_core.certified.strategies.half_life_steps import bettered_with_its_contacts
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.whole_program import exhaust
from planner_core.certified.tuning import TUNING
from planner_core.problem.delivery import without_half_life
from planner_core.problem.plan import Plan


class FullWorth:
    """State of the search in which images keep their worth.

    Attributes
    ----------
    plan
        The latest plan; None before there is one.
    is_going
        Whether another may follow.
    """

    def __init__(self, _best: Incumbent, _seed: int) -> None:
        self.plan: Plan | None = None
        self.is_going = False


def plans_without_half_life(search: Search) -> Iterator[None]:
    """Plan a fleet as if its images kept their worth, and restart whenever that search ends."""
    best, engine, full = search.best, search.engine(ResourceSearch), search.engine(FullWorth)

    def look(_: Progress) -> None:
        engine.offer(inner.plan)
        best.report("plans")

    undecayed, ended, num_idle = without_half_life(search.problem), list[Plan](), 0
    full.is_going = True
    while num_idle < TUNING.patience and not best.is_done:
        before = best.reward
        inner = Incumbent(undecayed, search.budget.part(1.0, look), best.gap)
        beside = search.beside(inner, search.seed + len(ended), without=exhaust)
        # With days from the rule's plan two large fleets end 1.4 % lower.
        for _ in slices_beyond_the_first_plan(beside):
            full.plan = inner.plan
            engine.offer(inner.plan)
            yield
        full.plan = inner.plan
        if inner.plan in ended:
            break  # so few tasks that every search ends with the same plan
        ended.append(inner.plan)
        num_idle = 0 if best.reward > before else num_idle + 1
    full.is_going = False


def days(search: Search) -> Iterator[None]:
    """Replan days from the latest plan without a half-life, as long as a round gains anything.

    Four satellites that turn to the sun earn 459.9 and 332.8 at half-lives of 12 and 3 h after 20
    CPU seconds, and 413.6 and 304.3 by contacts that the ascent names.
    """
    best, engine, full = search.best, search.engine(ResourceSearch), search.engine(FullWorth)
    known: Plan | None = None
    number = 0
    while not best.is_done and (full.is_going or full.plan != known):
        if full.plan is None or full.plan == known:
            yield
            continue
        known = full.plan
        plan, reached = _offered(engine, known), -np.inf
        while (earned := _earned(best, plan)) > reached:
            reached = earned
            plan = _replanned(engine, plan, search.seed + number)
            number += 1
            yield


def _earned(best: Incumbent, plan: Plan) -> float:
    """Return what a plan earns; minus infinity if it is not valid or the search is done."""
    timeline = best.judge(plan)
    return timeline.reward if timeline.is_valid and not best.is_done else -np.inf


def _replanned(search: ResourceSearch, plan: Plan, seed: int) -> Plan:
    """Return a plan with each satellite's day, then windows, replanned if that is better.

    A day that is worse has its windows replanned before it is given up: the programme rounds, so
    that it hardly improves a plan that windows have been through.

    All in one slice: with a slice for each satellite multipliers take half of the time, and large
    fleets earn 1 % less after 20 CPU seconds.
    """
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
        if new is None:
            continue
        if _earned(best, new) <= _earned(best, plan):
            new = bettered_with_its_contacts(best, new, seed)
        if _earned(best, new) > _earned(best, plan):
            plan = new
    bettered = bettered_with_its_contacts(best, plan, seed)
    if _earned(best, bettered) > _earned(best, plan):
        plan = bettered
    plan = _offered(search, plan)
    best.report("plans")
    return plan


def _offered(search: ResourceSearch, plan: Plan) -> Plan:
    """Offer a plan; return it, or the best one (perhaps this one with more contacts) if better.

    If both earn about the same, the offered one: more of its images come down. Two fleets over 30
    stations are within 1.4 and 1.7 % after 20 CPU seconds, and within 2.0 and 1.9 from it alone.
    """
    search.offer(plan)
    enough = (1.0 - TUNING.little) * search.best.reward
    return plan if _earned(search.best, plan) >= enough else search.best.plan
