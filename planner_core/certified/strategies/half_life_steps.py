"""Steps that the strategies share if images are worth less the later they come down.

`half_life.py` combines them into slices for one satellite or few, `days.py` for fleets.
"""

from __future__ import annotations

from dataclasses import replace

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.lns.resource_search import ResourceWindows
from planner_core.certified.lns.settled_contacts import with_contacts
from planner_core.certified.multipliers.latency import LatencyAscent
from planner_core.certified.multipliers.queues import multipliers_by_queues
from planner_core.certified.proofs.bound import Bound, rounded_bound
from planner_core.certified.proofs.lagrangian import lagrangian_bound
from planner_core.certified.proofs.queues import queue_value
from planner_core.certified.tuning import TUNING
from planner_core.problem import CONTACT, Floats, Problem
from planner_core.problem.plan import Plan


class Contacts:
    """The ascent on multipliers of contacts, and contacts that exact programmes over queues name.

    Attributes
    ----------
    named
        Those of the best paths, latest last; empty if such programmes take too long.
    """

    def __init__(self, best: Incumbent, _seed: int) -> None:
        self._best = best
        known = best.bound.multipliers
        if known is None:
            known = lagrangian_bound(best.problem, best.reward).multipliers
        assert known is not None
        self.ascent = LatencyAscent(best.problem, known)
        self._multipliers: Floats | None = None
        self.named: list[tuple[int, ...]] = []

    @property
    def multipliers(self) -> Floats:
        """The multipliers of targets. Shape ``(num_targets,)``."""
        return self.ascent.multipliers if self._multipliers is None else self._multipliers

    def lower(self, num_rounds: int, *, is_last: bool = False) -> None:
        """Continue the ascent for some rounds, at most for a part of the time that is left."""
        best, ascent = self._best, self.ascent
        part = best.budget.part(TUNING.beginning)
        for _ in range(num_rounds):
            if part.is_spent():
                break
            # Until a good plan is known, a value near the bound stands in for its reward.
            level = max(best.reward, (1.0 - TUNING.little) * ascent.value)
            ascent.improve(1, level, best.budget.stop)
        bound = ascent.bound(is_last=is_last)
        best.lower(replace(bound, value=rounded_bound(best.problem, bound.value, best.reward)))
        best.report("multipliers")

    def name(self) -> None:
        """Name contacts, with few levels of energy, and find multipliers that suit them."""
        hoped = max(self._best.reward, (1.0 - 2.0 * TUNING.little) * self.ascent.value)
        self._find(TUNING.fine, hoped)
        self._ascend()

    def prove(self) -> None:
        """Prove a bound with more levels of energy, which may name other contacts."""
        if self.named and not self._best.is_done:
            known = self.named[-1]
            self._find(TUNING.levels_per_collect, self._best.reward)
            if self.named[-1] != known:
                self._ascend()

    def _ascend(self) -> None:
        if self.named and not self._best.is_done:
            self._multipliers = multipliers_by_queues(
                self._best.problem,
                self.named[-1],
                self.multipliers,
                TUNING.rounds // 2,
                self._best.budget.stop,
            )

    def _find(self, per_collect: int, level: float) -> None:
        """Bound plans by exact programmes over queues, and name the contacts of the best paths."""
        best, contact_multipliers = self._best, self.ascent.contact_multipliers
        exact = self.named[-1] if self.named else ()
        value, rows = queue_value(
            best.problem,
            self.multipliers,
            per_collect,
            best.budget.stop,
            contact_multipliers=contact_multipliers,
            exact_contacts=exact,
            level=level,
        )
        best.lower(
            Bound(
                value=value,
                proof="dp",
                multipliers=self.multipliers,
                contact_multipliers=contact_multipliers,
                queue_levels=per_collect,
                exact_contacts=exact,
            )
        )
        best.report("queues")
        contacts = rows[best.problem.opportunities.kind[rows] == CONTACT]
        if len(contacts) > 0:
            self.named.append(tuple(sorted(contacts.tolist())))


def bettered_by_windows(best: Incumbent, part: Problem, plan: Plan, seed: int) -> Plan:
    """Return a plan improved by replanning windows of it."""
    windows = ResourceWindows(part, seed)
    windows.adopt(plan)
    windows.make_moves_on_each(TUNING.patience * TUNING.moves_in_a_step, best.budget)
    return windows.plan


def bettered_with_its_contacts(best: Incumbent, plan: Plan, seed: int) -> Plan:
    """Return a plan improved by replanning windows of it, its contacts taken."""
    contacts = list(plan.contacts(best.problem))
    part = with_contacts(best.problem, contacts, plan, best.judge(plan))
    return bettered_by_windows(best, part, plan, seed)
