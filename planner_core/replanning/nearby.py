"""The part of a replan that the news can touch.

One request among ten thousand targets concerns a few passes. Actions far from them stay as they
are: moves there might gain something, but nobody has asked for such changes. The part near them
is solved as a question of its own, and its answer replaces that part of the plan.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from planner_core.precedence.relation import near_in_time
from planner_core.problem import COLLECT, Bools, Ints, Longs, SatelliteProblem
from planner_core.problem.plan import Plan
from planner_core.problem.restrict import restricted
from planner_core.replanning.question import News, Question

_NEAR_S: Final = 120.0
"""For 16 urgent requests at 24 x 10,000: within 60 s, 8.6 of 10 was gained for at most 3 changes;
within 120 s 8.9 for 3; within 180 s 9.4 for 8 (0.2 % of the plan), in twice the time."""
_MOST: Final = 0.5  # of all rows: a larger part is not worth solving separately


@dataclass(frozen=True, kw_only=True, eq=False)
class Nearby:
    """The question for a part of the problem.

    Attributes
    ----------
    rows
        For each row of the part, its row in the whole problem.
    asked
        How many opportunities new and lost targets have.
    """

    question: Question
    rows: Ints
    asked: int

    def of(self, plan: Plan) -> Plan:
        """Return the actions that a plan of the whole has in the part, in rows of the part."""
        taken = [action.opportunity for action in plan.actions]
        return Plan.of(self.question.problem, np.flatnonzero(np.isin(self.rows, taken)).tolist())

    def put_into(self, plan: Plan, found: Plan) -> Plan:
        """Return a plan of the whole with its actions in the part replaced by ``found``."""
        part = set(self.rows.tolist())
        others = [action for action in plan.actions if action.opportunity not in part]
        own = (
            action._replace(opportunity=int(self.rows[action.opportunity]))
            for action in found.actions
        )
        return Plan(tuple(sorted((*others, *own))))


def nearby(question: Question, plan: Plan) -> Nearby | None:
    """Return the part of a question that its news can touch, given the plan.

    It holds the opportunities near in time to those of new and lost targets and to lost actions,
    all other opportunities of the targets imaged there, and the plan's actions that may conflict
    with any of these; but no others of targets that stay imaged elsewhere. None if news is unknown,
    the part is most of the question, or resources or deadlines couple it to all that follows.
    """
    problem, news = question.problem, question.news
    if news is None or problem.use_resources or question.deadline_s:
        return None
    table = problem.opportunities
    is_taken = np.zeros(len(table), dtype=np.bool_)
    is_taken[[action.opportunity for action in plan.actions]] = True
    targets = [*news.targets, *(lost.target for lost in news.lost if lost.target is not None)]
    is_image = table.kind == COLLECT
    is_asked = is_image & np.isin(table.site, targets)
    is_near = _near(question, news, is_asked)
    is_near[question.base] |= ~is_taken[question.base]
    imaged = np.unique(table.site[is_near & is_taken & is_image])
    is_offered = is_near | (is_image & np.isin(table.site, imaged))
    is_part = is_offered.copy()
    for satellite in problem.satellites:
        own = satellite.rows
        begin, end = near_in_time(satellite, np.flatnonzero(is_offered[own]))
        is_part[own] |= _within(len(own), begin, end) & is_taken[own]
    # A target that stays imaged elsewhere needs no other image.
    outside = np.unique(table.site[is_taken & is_image & ~is_part])
    is_part &= is_taken | ~(is_image & np.isin(table.site, outside))
    if is_part.sum() > _MOST * len(table):
        return None
    rows = np.flatnonzero(is_part).astype(np.int32)
    is_base = np.isin(rows, question.base)
    part = restricted(problem, rows)
    frozen = [part.pinned.is_frozen(start_s) for start_s in part.opportunities.start_s.tolist()]
    return Nearby(
        question=replace(
            question,
            problem=part,
            base=np.flatnonzero(is_base).astype(np.int32),
            num_base=int((is_base & ~np.array(frozen, dtype=np.bool_)).sum()),
            promised=tuple(target for target in question.promised if target not in outside),
            typical_worth=question.typical,
            news=None,
        ),
        rows=rows,
        asked=int(is_asked.sum()),
    )


def _near(question: Question, news: News, is_asked: Bools) -> Bools:
    """Return which opportunities are near in time to requested ones and to lost actions."""
    is_near = np.zeros(len(is_asked), dtype=np.bool_)
    for index, satellite in enumerate(question.problem.satellites):
        own = satellite.rows
        at_s = np.array(
            [
                *satellite.start_s[is_asked[own]].tolist(),
                *(lost.start_s for lost in news.lost if lost.satellite == index),
            ]
        )
        is_near[own] = _near_instants(satellite, at_s)
    return is_near


def _near_instants(satellite: SatelliteProblem, at_s: np.ndarray) -> Bools:
    begin = satellite.start_s.searchsorted(at_s - _NEAR_S)
    end = satellite.start_s.searchsorted(at_s + _NEAR_S, side="right")
    return _within(len(satellite), begin, end)


def _within(number: int, begin: Longs, end: Longs) -> Bools:
    """Return which of ``number`` rows lie in one of these spans."""
    steps = np.zeros(number + 1, dtype=np.int64)
    np.add.at(steps, begin, 1)
    np.add.at(steps, end, -1)
    return np.asarray(np.cumsum(steps[:-1]) > 0)
