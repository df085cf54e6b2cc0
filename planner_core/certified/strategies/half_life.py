"""Plans by the contacts that they take, if images are worth less the later they come down.

The bound's ascent shows which contacts are worth their energy. With these taken, each image has a
single worth, that of the time when it comes down: at first by the contact after it, then, once a
plan fills the recorder's queue, after the data queued before it. The searches for plans go by these
worths; the referee decides what their plans earn.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from planner_core.budget import Progress, ignored
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import AlternatingSearch
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.lns.queue_plans import plan_with_queues
from planner_core.certified.lns.settled_contacts import served, with_contacts
from planner_core.certified.mip.program_windows import ProgramWindows
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.strategies.first_plan import rule
from planner_core.certified.strategies.half_life_steps import (
    Contacts,
    bettered_by_windows,
    bettered_with_its_contacts,
)
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.resources import (
    choices,
    choices_from_the_best,
    windows_and_choices,
)
from planner_core.certified.strategies.supports import has_few_deliveries, is_shared
from planner_core.certified.tuning import TUNING
from planner_core.problem import CONTACT, Floats, Problem
from planner_core.problem.delivery import without_half_life
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import taking
from planner_core.solvers.forward_search import ForwardSearch

_FOR_PLANS: Final = (rule, windows_and_choices, choices_from_the_best)
"""Searches that find a good plan quickly, and lower no bound."""


def agility_bound(search: Search) -> Iterator[None]:
    """Bound plans by agility alone."""
    search.best.lower(lagrangian_bound(search.problem, search.best.reward))
    yield


def plans_without_half_life(search: Search) -> Iterator[None]:
    """Plan one satellite as if its images kept their worth, for a part of the time.

    Plans by their contacts bring all images down. If images earn a large share when taken, leaving
    some on board is better: 1,000 targets, `paper`, a share of 0.9 and half-lives of 24 and 6 h
    earn 302.8 and 296.2 of 308.6 and 304.1 after 10 CPU seconds instead of 284.5 and 262.7; 300
    targets with 3 h earn 238.8 and 239.9 of 253.0 and 256.8 after 8 s instead of 230.1 and 232.1.
    """
    engine = search.engine(ResourceSearch)

    def look(_: Progress) -> None:
        engine.offer(inner.plan)
        engine.best.report("plans")

    part = search.budget.part(TUNING.beginning, look)
    inner = Incumbent(without_half_life(search.problem), part, search.best.gap)
    search.beside(inner, search.seed, only=_FOR_PLANS).solved()
    engine.offer(inner.plan)
    yield


def program_windows(search: Search) -> Iterator[None]:
    """Replan windows of the day by small programs, and longer windows if none gains anything.

    Without these, one satellite over 60 to 120 targets ends within five CPU seconds up to 3.5 %
    below its bound. At a half-life of 12 h it earns 55.84, 91.44 and 108.82 after eight with them,
    and 53.97, 90.21 and 105.87 without, of at most 55.89, 92.26 and 109.32.
    """
    best, engine = search.best, search.engine(ResourceSearch)
    windows = ProgramWindows(best.problem, best.budget, search.seed)
    num_tasks, num_idle = TUNING.open_tasks // TUNING.patience, 0
    while num_tasks <= TUNING.open_tasks and not best.is_done:
        is_better = engine.offer(windows.move(best.plan, num_tasks))
        best.report("plans")
        yield
        num_idle = 0 if is_better else num_idle + 1
        if num_idle == TUNING.several:
            if num_tasks >= len(best.problem.opportunities):
                return
            num_tasks, num_idle = 2 * num_tasks, 0


def multipliers(search: Search) -> Iterator[None]:
    """Lower the bound by multipliers of targets and contacts.

    The first slice is half as long if queues come next, which continue this ascent.
    """
    shared = search.engine(Contacts)
    shared.lower(TUNING.rounds if is_shared(search.problem) else TUNING.rounds // 2)
    yield
    while search.is_promising and not shared.ascent.is_settled:
        shared.lower(TUNING.rounds)
        yield
    shared.lower(0, is_last=True)
    yield


def queues(search: Search) -> Iterator[None]:
    """Name contacts by exact programmes over queues, and bound plans by them."""
    shared = search.engine(Contacts)
    shared.lower(3 * TUNING.rounds // 2)
    shared.name()
    yield
    shared.prove()
    yield


def whole_relaxation(search: Search) -> Iterator[None]:
    """Bound plans by the relaxation of the whole program, with ages.

    If images earn a share on board, exact programmes of queues round the energy and data of many
    more images than come down. One satellite over 1,000 targets (a share of 0.5, half-life of 3 h)
    has a bound of 128.6 by the relaxation after two seconds, and of 134.4 by queues after ten; its
    plan earns 126.3. A relaxation that takes longer comes after other strategies, if these leave
    plan and bound far apart: with 4,095 opportunities it proves 130.5 instead of 169.2 after 24 s.
    """
    if not has_few_deliveries(search.problem):
        yield
        if search.best.is_within(TUNING.tight):
            return
    search.engine(ResourceSearch).whole.solve()
    yield


def forward_search(search: Search) -> Iterator[None]:
    """Plan by forward search, and replan windows with its contacts, before bounds take long.

    Forward search takes every contact that it can, so images come down early; the rule waits until
    the recorder is nearly full. Four satellites over 1,000 targets, images 30 s apart, with a
    half-life of 1 h, earn 494 after 5 s this way, and without it the rule's 218 for 15 s, until
    there is a plan in which images keep their worth.
    """
    best, engine = search.best, search.engine(ResourceSearch)
    # What it reports on the way are not yet plans that the referee has judged.
    quiet = search.budget.part(1.0, ignored)
    engine.offer(ForwardSearch().solve(search.problem, quiet, search.seed).plan)
    engine.offer(bettered_with_its_contacts(best, best.plan, search.seed))
    best.report("plans")
    yield


def plans_by_contacts(search: Search) -> Iterator[None]:
    """Search for plans that take contacts named by the bounds, or some near the best plan's."""
    best, engine, shared = search.best, search.engine(ResourceSearch), search.engine(Contacts)
    tried: set[tuple[int, ...]] = set()
    rng = np.random.default_rng(search.seed)
    number = 0
    if not shared.named:
        yield from choices(search)
    while search.is_promising:
        own = best.plan.contacts(best.problem)
        offered = (
            *reversed(shared.named),
            *reversed(shared.ascent.contact_sets),
            own,
            *_near(best.problem, own, rng),
        )
        contacts = next((one for one in offered if one not in tried), own)
        tried.add(contacts)
        levels = TUNING.levels_per_collect // (1 if number else 2)
        _plan_with(best, contacts, shared.multipliers, engine.unit, search.seed + number, levels)
        number += 1
        yield


def _near(
    problem: Problem, contacts: tuple[int, ...], rng: np.random.Generator
) -> Iterator[tuple[int, ...]]:
    """Yield these contacts with one added or removed, in random order."""
    every = np.flatnonzero(problem.opportunities.kind == CONTACT)
    for row in rng.permutation(every).tolist():
        yield tuple(sorted({row}.symmetric_difference(contacts)))


def _plan_with(
    best: Incumbent,
    contacts: tuple[int, ...],
    multipliers: Floats,
    unit: float,
    seed: int,
    per_collect: int,
) -> None:
    """Seek plans that take these contacts, as far as stations can serve them."""
    problem, stop = best.problem, best.budget.stop
    taken = served(problem, contacts)
    rng = np.random.default_rng(seed)
    plan = plan_with_queues(taking(problem, taken), multipliers, rng, stop, per_collect)
    is_known = plan is not None
    part = with_contacts(problem, taken, plan, best.judge(plan) if plan else None)
    if plan is None:
        choices = ChoiceSearch(part, unit, seed, stop)
        choices.start(np.zeros(len(problem.opportunities), dtype=np.bool_), TUNING.first_goal)
        plan = choices.plan
    reached = 0.0
    best.offer(plan)
    for _ in range(TUNING.tries):
        if best.is_done:
            return
        plan = _bettered(best, part, plan, unit, seed, is_known=is_known)
        best.offer(plan)
        best.report("plans")
        timeline = best.judge(plan)
        if timeline.reward <= reached:
            return
        reached = timeline.reward
        part = with_contacts(problem, taken, plan, timeline)


def _bettered(
    best: Incumbent, part: Problem, plan: Plan, unit: float, seed: int, *, is_known: bool
) -> Plan:
    """Return a plan improved by windows, and by choices of tasks unless it is from queues."""
    if is_known:
        return bettered_by_windows(best, part, plan, seed)
    alternating = AlternatingSearch(part, plan, unit, best.budget, seed)
    alternating.step(TUNING.tries)
    return alternating.plan
