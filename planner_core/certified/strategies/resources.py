"""With battery and recorder, one satellite or few: plans and bounds by exact programmes.

If energy is short, the programme without multipliers bounds the best plan within an image or two,
and the same programme over choices of tasks finds one. If targets are few as well, multipliers
lower the bound. The relaxations of promising sets of contacts give multipliers and, for each set,
the few tasks of a small mixed-integer program. If only agility limits plans, the proof without
resources suffices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner_core.budget import ignored
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.mip.contact_exchange import ContactExchange
from planner_core.certified.mip.whole_relaxation import relaxation_over_slots
from planner_core.certified.program.slots import has_slot_program
from planner_core.certified.proofs.resource_bound import quick_bound
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.supports import (
    at_rest,
    has_few_deliveries,
    has_half_life,
    is_shared,
)
from planner_core.certified.tuning import TUNING
from planner_core.problem import Bools


def resource_bound(search: Search) -> Iterator[None]:
    """Bound plans quickly, without a search."""
    search.best.lower(quick_bound(search.problem, search.best.reward))
    yield


def choices(search: Search) -> Iterator[None]:
    """Seek first plans among choices of tasks, and near the best plan of agility alone."""
    yield from search.engine(ResourceSearch).choose(lambda: tasks_alone(search))


def tasks_alone(search: Search) -> Bools:
    """Bound plans by agility alone; return the tasks of the best plan found under agility alone."""
    engine, best = search.engine(ResourceSearch), search.best
    # With starts 15 s apart this would use up all the time: 253 of 290 after 20 s with all of it,
    # 280 with a quarter (docs/bounds.md). Its plans are not plans of this problem, so they are not
    # reported.
    quiet = search.budget.part(TUNING.beginning, ignored)
    free = Incumbent(replace(search.problem, use_resources=False), quiet, best.gap)
    # What turns in motion forbid besides is left to the search with limits.
    solution = search.beside(free, search.seed, like=at_rest(free.problem)).solved()
    if solution.proven is not None:
        best.lower(solution.proven)
    best.report("without resources")
    return engine.mask(action.opportunity for action in solution.plan.actions)


def windows_and_choices(search: Search) -> Iterator[None]:
    """Alternate windows and choices of tasks, from the best plan that other strategies found."""
    engine, best = search.engine(ResourceSearch), search.best
    known = best.reward
    while search.is_promising:
        if best.reward > known:
            # Windows improve plans of programs: under clouds 231.9 instead of 231.6, with rewards
            # of 1 to 10 2,505 instead of 2,499 of 2,534 after 20 CPU seconds.
            engine.alternating_search.adopt(best.plan)
        engine.search(engine.alternating_search, TUNING.rounds)
        known = best.reward
        yield


def own_contacts(search: Search) -> Iterator[None]:
    """Seek better plans with the contacts of the best one, by a small program."""
    engine = search.engine(ResourceSearch)
    while search.is_promising:
        engine.fix_own_contacts()
        yield


def exchanged_contacts(search: Search) -> Iterator[None]:
    """Seek better plans with one contact exchanged, by small programs.

    Plans within a thousandth of the bound are left to the whole program, which may prove them.
    """
    engine = search.engine(ResourceSearch)
    while (offered := engine.whole.worth_offering()) is None:
        if not search.is_promising:
            return
        yield
    exchange = ContactExchange(search.best, search.seed, offered)
    while search.is_promising and not search.best.is_within(TUNING.trifle):
        plan = exchange.step()
        if plan is not None:
            engine.offer(plan)
        search.best.report("contacts exchanged")
        yield


def choices_from_the_best(search: Search) -> Iterator[None]:
    """Replan the whole day by choices of tasks from the best plan, until it is no longer improved.

    Alternating with windows leaves such plans too soon: with 1,000 targets and `paper`, four of six
    draws are within half a percent after 1 to 2.3 CPU seconds this way, instead of one; three of
    four with 500 are within two percent after 2 s instead of 6. Returning to this after each better
    plan gains nothing more, and with rewards of 1 to 10 costs a tenth of the time to 1 %.
    """
    engine, best = search.engine(ResourceSearch), search.best
    choices = ChoiceSearch(search.problem, engine.unit, search.seed, search.budget.stop)
    is_better = True
    while is_better and search.is_promising:
        choices.adopt(best.plan)
        known, num_idle = best.reward, 0
        while num_idle < TUNING.rounds and not best.is_done:
            choices.move()
            is_found = choices.reward > best.reward and engine.offer(choices.plan)
            num_idle = 0 if is_found else num_idle + 1
        best.report("plans")
        is_better = best.reward > known
        yield


def slot_relaxation(search: Search) -> Iterator[None]:
    """Bound plans by the linear relaxation over slots of time, if its limits hold for all plans.

    It takes less than a third of a second up to 2,000 accesses, and two up to 12,000. If images age
    it may take some seconds, and comes after a turn of the others.
    """
    problem = search.problem
    most = TUNING.most_columns if has_half_life(problem) else TUNING.most_relaxed
    num_accesses = len(np.unique(problem.opportunities.access))
    if num_accesses > most or not has_slot_program(problem):
        return
    if has_half_life(problem) and not has_few_deliveries(problem):
        yield
    search.best.lower(relaxation_over_slots(problem, search.budget, search.seed))
    search.best.report("relaxation")
    yield


def whole_relaxation(search: Search) -> Iterator[None]:
    """Bound plans by the relaxation of the whole program."""
    search.engine(ResourceSearch).whole.solve()
    yield


def multipliers(search: Search) -> Iterator[None]:
    """Lower the bound by multipliers of targets."""
    engine = search.engine(ResourceSearch)
    multipliers = engine.resource_ascent
    yield
    while search.is_promising:
        engine.ascend(multipliers, TUNING.tries)
        yield


def programs(search: Search) -> Iterator[None]:
    """Relax sets of contacts, and seek better plans by small programs with one of them.

    If the whole relaxation proves more, a fleet only exchanges contacts.
    """
    engine = search.engine(ResourceSearch)
    if is_shared(search.problem) and engine.relaxation_suffices:
        return
    while search.is_promising:
        is_new = engine.relax_sets(engine.resource_ascent, engine.alternating_search)
        if is_new:
            # How far they lower the bound decides which sets are worth a program.
            engine.ascend(engine.resource_ascent, TUNING.tries)
        if not engine.fix_contacts(is_last=False) and not is_new:
            engine.fix_contacts(is_last=True)
        yield
