"""The steps where images are worth less the later they come down.

`half_life.py` makes slices of them for one satellite or few, `days.py` for fleets.
"""

from __future__ import annotations

from dataclasses import replace

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.multipliers.queues import priced_by_queues
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.queues import queue_value
from planner_core.certified.tuning import TUNING
from planner_core.problem import CONTACT, Floats, Problem
from planner_core.problem.plan import Plan


class NamedContacts:
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


def lower(
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


def prove_at_last(best: Incumbent, ascent: LatencyAscent, named: NamedContacts) -> None:
    """Say what the best multipliers prove, with queues too, if there is time left."""
    if not best.is_done:
        lower(best, ascent, 0, is_last=True)
        exact = contacts_of(best.problem, best.plan)
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


def bettered_by_windows(best: Incumbent, part: Problem, plan: Plan, seed: int) -> Plan:
    """Return a plan with windows planned anew where that is better."""
    windows = ResourceWindows(part, seed)
    windows.adopt(plan)
    windows.make_moves_on_each(TUNING.patience * TUNING.moves_in_a_step, best.budget)
    return windows.plan


def contacts_of(problem: Problem, plan: Plan) -> tuple[int, ...]:
    """Return the contacts that a plan takes, ascending."""
    rows = (action.opportunity for action in plan.actions)
    return tuple(sorted(row for row in rows if problem.opportunities.kind[row] == CONTACT))
