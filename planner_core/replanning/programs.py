"""Small integer programs for HiGHS over the tasks of a few plans: exact over the whole horizon.

The recorder fills after a lost contact, and a limit breaks hours later: what one window of the
neighbourhood search drops, another one would have to add. The tasks of one or two plans leave so
few choices that the best mix is found at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from planner_core.budget import Budget, Termination, ignored
from planner_core.certified.mip.contact_sets import FixedContacts
from planner_core.domain import Objective
from planner_core.precedence.relation import is_transitive, num_near_pairs
from planner_core.problem import CONTACT, Bools, Problem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted
from planner_core.replanning.question import Question
from planner_core.solvers.milp import Milp
from planner_core.solvers.sequential import blocked_rows

_MOST_PAIRS: Final = 200_000  # of tasks near each other; with more, programs take seconds
_WORTH_BESIDE: Final = 1e-3  # of a kept image: worth only breaks ties between equally many kept


@dataclass(frozen=True, kw_only=True)
class Fewest:
    """The plan that changes least, and whether that is proven.

    Attributes
    ----------
    num_kept
        How many images of the base it keeps. If ``is_proven``, no valid plan keeps more.
    """

    plan: Plan
    num_kept: int
    is_proven: bool


def fewest_changes(
    question: Question,
    satellites: Sequence[int],
    budget: Budget,
    most_pairs: float = _MOST_PAIRS,
) -> Fewest | None:
    """Return the plan that keeps most images of the base, with a free choice of contacts.

    Only the base and contacts can help to keep the base; other searches fill the gaps with other
    images. It is no proof if turns by way of another task can be quicker than direct ones.

    Parameters
    ----------
    satellites
        Those whose part of the base may change; the actions of the others stay fixed.
    most_pairs
        The most pairs of tasks near each other; with more, the function returns None.
    """
    problem = question.problem
    table = problem.opportunities
    is_base = np.zeros(len(table), dtype=np.bool_)
    is_base[question.base] = True
    others = is_base & ~np.isin(table.satellite, satellites)
    is_offered = (is_base | (table.kind == CONTACT) | question.is_promised) & ~others
    is_offered[problem.kept_rows] = True
    for index in satellites:
        own = problem.satellites[index].rows
        is_shut = blocked_rows(problem, problem.satellites[index], np.flatnonzero(others).tolist())
        is_offered[own[(is_shut != 0) & ~is_base[own]]] = False
    is_offered &= np.isin(table.satellite, satellites)
    rows = np.flatnonzero(is_offered).astype(np.int32)
    part = restricted(_counting(question, is_base), rows)
    if num_near_pairs(part) > most_pairs:
        return None
    found = Milp().solve(part, budget.part(report=ignored), 0)
    found_rows = {int(rows[action.opportunity]) for action in found.plan.actions}
    taken = sorted(found_rows.union(np.flatnonzero(others).tolist()))
    is_whole = len(satellites) == len(problem.satellites) and is_transitive(problem)
    return Fewest(
        plan=Plan.of(problem, taken),
        num_kept=int((is_base[taken] & (table.kind[taken] != CONTACT)).sum()),
        is_proven=is_whole and found.termination is Termination.OPTIMAL,
    )


def _counting(question: Question, is_base: Bools) -> Problem:
    """Return the problem in which images of the base count one each, and promised ones far more."""
    problem = question.problem
    is_image = problem.opportunities.kind != CONTACT
    worth = np.where(is_base & is_image, 1.0, 0.0)
    least = _WORTH_BESIDE / max(1.0, float(problem.best_worth.sum()))
    worth += least * np.where(is_base & is_image, problem.worth, 0.0)
    worth += (1.0 + len(question.base)) * question.is_promised
    return replace(problem, worth=worth, full_worth=None, objective=Objective.collected())


def mixed(question: Question, plans: Sequence[Plan], budget: Budget, seed: int) -> Plan | None:
    """Return the best mix of the base and some plans, kept actions counted; None if none is found.

    Its contacts are those of the last plan: with these fixed the relaxation is nearly tight.
    """
    problem = question.searched
    table = problem.opportunities
    offered = np.zeros(len(table), dtype=np.bool_)
    offered[question.base] = True
    for plan in plans:
        offered[[action.opportunity for action in plan.actions]] = True
    last = [action.opportunity for action in plans[-1].actions]
    contacts = tuple(row for row in last if table.kind[row] == CONTACT)
    program = FixedContacts(problem, offered, contacts, budget, seed)
    if not np.isfinite(program.relaxed()) or budget.is_spent():
        return None
    return program.plan(0.0)
