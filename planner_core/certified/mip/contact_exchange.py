"""Other contacts than a known plan's, one exchanged at a time.

Satellites that fly behind each other want the same antennas. To give a pass to another satellite
takes a whole new plan of both, which no search from plan to plan finds. With contacts fixed the
relaxation over all images shows in tenths of a second what such an exchange is worth, and the
reduced costs of contacts show beforehand which ones are not worth trying.
"""

from __future__ import annotations

import numpy as np

from planner_core.certified.incumbent import Incumbent
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.certified.tuning import TUNING
from planner_core.precedence.antennas import antenna_groups
from planner_core.problem import CONTACT, Bools, Floats
from planner_core.problem.plan import Plan

Contacts = tuple[int, ...]


class ContactExchange:
    """A local search over sets of contacts, from the best plan's.

    Parameters
    ----------
    offered
        Collects that may be taken. Shape ``(n,)``.
    """

    def __init__(self, best: Incumbent, seed: int, offered: Bools) -> None:
        self._best, self._seed = best, seed
        table = best.problem.opportunities
        self._every: Contacts = tuple(np.flatnonzero(table.kind == CONTACT).tolist())
        self._program = FixedContacts(best.problem, offered, (), best.budget, seed, self._every)
        self._tried: set[Contacts] = set()
        # The sets to try next, and what at most each is worth; the most promising last.
        self._neighbours: list[tuple[float, Contacts]] = []
        self._from: Contacts | None = None

    def step(self) -> Plan | None:
        """Try a few exchanges; return a better plan if one leads there."""
        best = self._best
        contacts = best.plan.contacts(best.problem)
        if contacts != self._from:
            self._from, self._neighbours = contacts, self._around(contacts)
        for _ in range(TUNING.several):
            if not self._neighbours or best.is_done:
                return None
            most, named = self._neighbours.pop()
            if most < best.better:
                self._neighbours.clear()
                return None
            self._tried.add(named)
            self._program.fix(named)
            if self._program.relaxed() >= best.better:
                plan = self._plan_with(named)
                if plan is not None:
                    return plan
        return None

    def _around(self, contacts: Contacts) -> list[tuple[float, Contacts]]:
        """Return these contacts, and with one more, less those that exclude it, or with one less.

        The value of a linear program is concave in the bounds of its columns: an exchange gains no
        more than the reduced costs of its contacts together.
        """
        self._program.fix(contacts)
        value, gains = self._program.relaxed(), self._program.gains
        sets = [
            self._with(contacts, row, gains) if row not in contacts else _without(contacts, row)
            for row in self._every
        ]
        found = []
        for named in dict.fromkeys([contacts, *sets]):
            more, less = set(named).difference(contacts), set(contacts).difference(named)
            gain = float(gains[list(more)].sum() - gains[list(less)].sum())
            if named not in self._tried:
                found.append((value + gain, named))
        return sorted(found)

    def _with(self, contacts: Contacts, added: int, gains: Floats) -> Contacts:
        """Return the set with another contact, without the least valuable ones in its way."""
        table = self._best.problem.opportunities
        rows = np.array(contacts, dtype=np.int64)
        is_own = table.satellite[rows] == table.satellite[added]
        is_apart = (table.end_s[rows] <= table.start_s[added]) | (
            table.start_s[rows] >= table.end_s[added]
        )
        kept = set(rows[~is_own | is_apart].tolist())
        for group in antenna_groups(self._best.problem):
            if added in group.rows:
                beside = sorted(kept.intersection(group.rows.tolist()), key=lambda row: gains[row])
                kept.difference_update(beside[: max(0, len(beside) + 1 - group.limit)])
        return tuple(sorted({added, *kept}))

    def _plan_with(self, contacts: Contacts) -> Plan | None:
        """Return a better plan among the tasks that cost the last relaxation least, if any."""
        best = self._best
        offered = self._program.promising(TUNING.open_tasks)
        offered[[action.opportunity for action in best.plan.actions]] = True
        program = FixedContacts(best.problem, offered, contacts, best.budget, self._seed)
        if program.relaxed() < best.better:
            return None
        plan = program.plan(best.better, is_rounded=True)
        return plan if plan is not None and best.judge(plan).reward > best.reward else None


def _without(contacts: Contacts, row: int) -> Contacts:
    return tuple(each for each in contacts if each != row)
