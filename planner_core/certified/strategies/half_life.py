"""Where images are worth less the later they come down: plans by the contacts that they take.

The bound's ascent tells which contacts are worth their energy. Where those must be taken an image
has one worth, that of the time at which it comes down: at first with the contact after it, then, as
a plan fills the queue of the recorder, with what that plan leaves to be taken down before. The
searches for plans go by that, the referee says what it has come to. Of a fleet one satellite's day
after another is planned anew beside the others', from a plan that has all images brought down.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner_core.budget import Budget, Progress
from planner_core.certified.driver import Search
from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.alternating import TurnSearch
from planner_core.certified.lns.choices import ChoiceSearch
from planner_core.certified.lns.queue_plans import plan_with_queues, replanned_day
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.lns.settled_contacts import served, with_contacts
from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.multipliers.queues import priced_by_queues
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.queues import queue_value
from planner_core.certified.strategies.resource_steps import ResourceSearch
from planner_core.certified.strategies.resources import choices
from planner_core.certified.strategies.whole_program import exhaust
from planner_core.certified.tuning import TUNING
from planner_core.problem import CONTACT, Floats, Problem
from planner_core.problem.delivery import with_objective
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import taking


def agility_bound(search: Search) -> Iterator[None]:
    """Bound plans by agility alone."""
    search.best.lower(lagrangian_bound(search.problem, search.best.reward))
    yield


def on_the_ground(search: Search) -> Iterator[None]:
    """Search for contacts, bounds and plans in turn, until none gets anywhere."""
    best, engine = search.best, search.engine(ResourceSearch)
    ascent = LatencyAscent(best.problem, engine.prices())
    tried: set[tuple[int, ...]] = set()
    rng = np.random.default_rng(search.seed)
    num_idle = number = 0
    if engine.is_large:
        _better_with_its_contacts(engine)
        yield
    _lower(best, ascent, TUNING.rounds // 2)
    yield
    named = _Named(best, ascent)
    if len(best.problem.satellites) == 1:
        # A fleet's programmes take too long.
        _lower(best, ascent, 3 * TUNING.rounds // 2)
        named.begin()
        yield
    if not named.contacts:
        yield from choices(search)
    while num_idle < TUNING.patience and not best.is_done:
        before = best.reward
        own = _contacts_of(best.problem, best.plan)
        offered = (
            *reversed(named.contacts),
            *reversed(ascent.contact_sets),
            own,
            *_near(best.problem, own, rng),
        )
        contacts = next((one for one in offered if one not in tried), own)
        tried.add(contacts)
        levels = TUNING.levels_per_collect // (1 if number else 2)
        _plan_with(best, contacts, named.prices, engine.unit, search.seed + number, levels)
        yield
        number += 1
        num_idle = 0 if best.reward > before else num_idle + 1
        if number == 1:
            named.prove()
        elif num_idle == TUNING.tries:
            named.prove_again()
            tried.difference_update(named.contacts[-1:])
        _lower(best, ascent, TUNING.several)
        yield
    _prove_at_last(best, ascent, named)


def days(search: Search) -> Iterator[None]:
    """Plan a fleet without its half-life, and let its satellites plan their days anew from that.

    The first search is interrupted for the second. Once it has ended it begins afresh. Two fleets
    drawn at random earn 277.0 and 204.0 after 40 CPU seconds; with a quarter of the time for the
    first, once, 267.3 and 197.9.
    """
    problem, best, engine = search.problem, search.best, search.engine(ResourceSearch)
    plain = replace(problem, worth=problem.worth_on_ground, full_worth=None)
    undecayed = with_objective(plain, replace(problem.objective, half_life_s=None))
    days, breaks = DayByDay(engine), _Breaks(search.budget)
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
    days.prove()


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
    share = 1.0 if engine.is_fleet else TUNING.first_share
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


def _better_with_its_contacts(search: ResourceSearch) -> None:
    """Plan windows of the first plan anew, its contacts as they are."""
    best = search.best
    contacts = list(_contacts_of(best.problem, best.plan))
    part = with_contacts(best.problem, contacts, best.plan, best.judge(best.plan))
    search.offer(_bettered_by_windows(best, part, best.plan, search.seed))
    best.report("plans")


class _Named:
    """Contacts that exact programmes over queues name, and multipliers that suit them.

    Attributes
    ----------
    contacts
        Those of the best paths, the latest last; none where such programmes take too long.
    """

    def __init__(self, best: Incumbent, ascent: LatencyAscent) -> None:
        self._best, self._ascent = best, ascent
        self._prices: Floats | None = None
        self.contacts: list[tuple[int, ...]] = []

    @property
    def prices(self) -> Floats:
        """The multipliers of targets. Shape ``(num_targets,)``."""
        return self._ascent.prices if self._prices is None else self._prices

    def begin(self) -> None:
        """Find contacts, with few levels of energy at first, and multipliers."""
        best, ascent = self._best, self._ascent
        hoped = max(best.reward, (1.0 - 2.0 * TUNING.little) * ascent.value)
        self._find(TUNING.fine, hoped)
        self._price()

    def prove(self) -> None:
        """Prove a bound, which may name other contacts."""
        if self.contacts and not self._best.is_done:
            known = self.contacts[-1]
            self._find(TUNING.levels_per_collect, self._best.reward)
            if self.contacts[-1] != known:
                self._price()

    def prove_again(self) -> None:
        """Prove a bound by better multipliers."""
        if self.contacts and not self._best.is_done:
            self._price()
            self._find(TUNING.levels_per_collect, self._best.reward)

    def _find(self, per_collect: int, level: float) -> None:
        exact = self.contacts[-1] if self.contacts else ()
        contacts = _lower_by_queues(
            self._best, self._ascent, self.prices, per_collect, level, exact
        )
        if contacts:
            self.contacts.append(contacts)

    def _price(self) -> None:
        if self.contacts and not self._best.is_done:
            self._prices = priced_by_queues(
                self._best.problem,
                self.contacts[-1],
                self.prices,
                TUNING.rounds // 2,
                self._best.budget.stop,
            )


class DayByDay:
    """A fleet's satellites plan their days in turn, beside the ascent on multipliers.

    After 20 CPU seconds four satellites that turn to the sun earn 459.9 and 332.8 at half-lives of
    12 and 3 h, and 413.6 and 304.3 by contacts that the ascent names.
    """

    def __init__(self, search: ResourceSearch) -> None:
        self._search, self._best = search, search.best
        self._ascent = LatencyAscent(search.problem, search.prices())
        self._number = 0

    def better(self, plan: Plan) -> None:
        """Plan days anew from a plan, as long as a round of them gains anything.

        Parameters
        ----------
        plan
            One in which images come down, as it is without a half-life.
        """
        best = self._best
        self._search.offer(plan)
        if not best.judge(plan).is_valid:
            plan = best.plan
        if self._number == 0:
            _lower(best, self._ascent, TUNING.rounds)
        reached = -np.inf
        while (earned := _earned(best, plan)) > reached:
            reached = earned
            plan = _replanned(self._search, plan, self._search.seed + self._number)
            self._number += 1
            _lower(best, self._ascent, TUNING.rounds)

    def prove(self) -> None:
        """Say what the best multipliers prove, if there is time left."""
        _prove_at_last(self._best, self._ascent, _Named(self._best, self._ascent))


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
    contacts = list(_contacts_of(problem, plan))
    part = with_contacts(problem, contacts, plan, best.judge(plan))
    bettered = _bettered_by_windows(best, part, plan, seed)
    if _earned(best, bettered) > _earned(best, plan):
        plan = bettered
    search.offer(plan)
    best.report("plans")
    return plan


def _lower(
    best: Incumbent, ascent: LatencyAscent, num_rounds: int, *, is_last: bool = False
) -> None:
    """Go on with the ascent for a while, at most for a part of the time that is left."""
    part = best.budget.part(TUNING.beginning)
    for _ in range(num_rounds):
        if part.is_spent():
            break
        ascent.improve(1, _level(best, ascent), best.budget.stop)
    bound = ascent.bound(is_last=is_last)
    best.lower(replace(bound, value=rounded_bound(best.problem, bound.value, best.reward)))
    best.report("prices")


def _prove_at_last(best: Incumbent, ascent: LatencyAscent, named: _Named) -> None:
    """Say what the best multipliers prove, with queues too, if there is time left."""
    if not best.is_done:
        _lower(best, ascent, 0, is_last=True)
        exact = _contacts_of(best.problem, best.plan)
        _lower_by_queues(best, ascent, named.prices, TUNING.levels_per_collect, best.reward, exact)


def _level(best: Incumbent, ascent: LatencyAscent) -> float:
    """Return what the best plan earns, or a value near the bound until a good one is known."""
    return max(best.reward, (1.0 - TUNING.little) * ascent.value)


def _lower_by_queues(
    best: Incumbent,
    ascent: LatencyAscent,
    prices: Floats,
    per_collect: int,
    level: float,
    exact: tuple[int, ...],
) -> tuple[int, ...]:
    """Let exact programmes of queues bound the plans; return the contacts of the best paths."""
    value, rows = queue_value(
        best.problem,
        prices,
        per_collect,
        best.budget.stop,
        contact_prices=ascent.contact_prices,
        exact_contacts=exact,
        level=level,
    )
    best.lower(
        Bound(
            value=value,
            proof="dp",
            prices=prices,
            contact_prices=ascent.contact_prices,
            queue_levels=per_collect,
            exact_contacts=exact,
        )
    )
    best.report("queues")
    return tuple(sorted(rows[best.problem.opportunities.kind[rows] == CONTACT].tolist()))


def _near(
    problem: Problem, contacts: tuple[int, ...], rng: np.random.Generator
) -> Iterator[tuple[int, ...]]:
    """Yield these contacts with one more or less, in random order."""
    every = np.flatnonzero(problem.opportunities.kind == CONTACT)
    for row in rng.permutation(every).tolist():
        yield tuple(sorted({row}.symmetric_difference(contacts)))


def _bettered_by_windows(best: Incumbent, part: Problem, plan: Plan, seed: int) -> Plan:
    windows = ResourceWindows(part, seed)
    windows.adopt(plan)
    windows.make_moves_on_each(TUNING.patience * TUNING.moves_in_a_step, best.budget)
    return windows.plan


def _contacts_of(problem: Problem, plan: Plan) -> tuple[int, ...]:
    rows = (action.opportunity for action in plan.actions)
    return tuple(sorted(row for row in rows if problem.opportunities.kind[row] == CONTACT))


def _plan_with(
    best: Incumbent,
    contacts: tuple[int, ...],
    prices: Floats,
    unit: float,
    seed: int,
    per_collect: int,
) -> None:
    """Look for plans that take these contacts, as far as stations can serve them."""
    problem, stop = best.problem, best.budget.stop
    taken = served(problem, contacts)
    rng = np.random.default_rng(seed)
    plan = plan_with_queues(taking(problem, taken), prices, rng, stop, per_collect)
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
    """Return a plan that is better by windows, and by choices of tasks unless it is from queues."""
    if is_known:
        return _bettered_by_windows(best, part, plan, seed)
    turns = TurnSearch(part, plan, unit, best.budget, seed)
    turns.turn(TUNING.tries)
    return turns.plan
