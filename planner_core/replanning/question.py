"""A replan in terms of its problem: the rows of the base, and how they count in the search."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np

from planner_core.domain import Replan, Scenario, Stability
from planner_core.pinning.rows_meant import rows_of_base
from planner_core.problem import (
    COLLECT,
    CONTACT,
    Bools,
    Floats,
    ImageOnBoard,
    Ints,
    Problem,
)
from planner_core.problem.on_board import without_on_board
from planner_core.problem.plan import Plan
from planner_core.problem.slew import TIME_TOLERANCE_S
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Timeline

_KEPT_VERDICTS: Final = 16  # plans of a fleet take megabytes each


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost:
    """An action of the base that is no longer offered: a collect of a target, or a contact."""

    satellite: int
    start_s: float
    target: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class News:
    """How a replan's problem differs from that of the previous plan.

    Attributes
    ----------
    targets
        Targets that are new, have changed or have lost their image.
    """

    targets: frozenset[int]
    lost: tuple[Lost, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Question:
    """The input of a search for a replan.

    Attributes
    ----------
    base
        Rows of the previous plan that are still offered, ascending. Shape ``(k,)``.
    num_base
        How many actions that plan had after the freeze, including lost ones.
    promised
        Targets that must be imaged, in the order of the promises.
    deadline_s
        By target, when an image of it must be on the ground.
    on_board
        Images from before the horizon, which the problem itself leaves out.
    news
        What has happened, if the problem differs from the previous one in nothing else; None if
        unknown.
    typical_worth
        Worth of an image in which kept actions are counted; None for the problem's own.
    """

    problem: Problem
    base: Ints
    num_base: int
    promised: tuple[int, ...]
    stability: Stability
    deadline_s: Mapping[int, float] = field(default_factory=dict)
    on_board: tuple[ImageOnBoard, ...] = ()
    news: News | None = None
    typical_worth: float | None = None

    @property
    def typical(self) -> float:
        """What a typical image earns."""
        return self.problem.typical_worth if self.typical_worth is None else self.typical_worth

    @cached_property
    def bonus(self) -> Floats:
        """What keeping each row adds to its worth in the search. Shape ``(n,)``."""
        kind = self.problem.opportunities.kind[self.base]
        shares = np.where(kind == COLLECT, self.stability.weight, self.stability.contact_weight)
        bonus = np.zeros(len(self.problem.opportunities))
        bonus[self.base] = shares * self.typical
        return bonus

    @cached_property
    def is_promised(self) -> Bools:
        """Whether each row is an image of a promised target. Shape ``(n,)``."""
        table = self.problem.opportunities
        is_promised: Bools = np.isin(table.site, self.promised) & (table.kind == COLLECT)
        return is_promised

    @cached_property
    def searched(self) -> Problem:
        """The problem with worths as the search counts them, with kept actions and promises.

        A promised target is worth more than all others together.
        """
        dear = 1.0 + float(self.problem.best_worth.sum()) + float(self.bonus.sum())
        table = self.problem.opportunities
        more = np.where(table.kind == CONTACT, 0.0, self.bonus + dear * self.is_promised)
        full = self.problem.full_worth
        return replace(
            self.problem,
            worth=self.problem.worth + more,
            full_worth=None if full is None else full + more,
        )

    @cached_property
    def _verdicts(self) -> dict[Plan, Timeline]:
        return {}

    def judged(self, plan: Plan) -> Timeline:
        """Return the referee's verdict; those on the most recent plans are remembered."""
        verdicts = self._verdicts
        found = verdicts.pop(plan, None) or replay(self.problem, plan, in_detail=False)
        verdicts[plan] = found
        if len(verdicts) > _KEPT_VERDICTS:
            del verdicts[next(iter(verdicts))]
        return found

    def may_fly(self, plan: Plan) -> bool:
        """Return whether a plan breaks nothing that another plan could avoid."""
        return self.judged(plan).validity != "violations"

    def stable_worth(self, plan: Plan) -> float:
        """Return the total bonus of the kept actions of a plan."""
        return float(self.bonus[[action.opportunity for action in plan.actions]].sum())

    def changed(self, plan: Plan) -> int:
        """Return how many actions of the base after the freeze a plan has moved or removed."""
        taken = {action.opportunity for action in plan.actions}
        start_s = self.problem.opportunities.start_s
        kept = sum(
            1
            for row in self.base.tolist()
            if row in taken and not self.problem.pinned.is_frozen(start_s[row])
        )
        return self.num_base - kept

    def missing(self, plan: Plan) -> frozenset[int]:
        """Return the promised targets that a plan does not image, or downlinks too late."""
        table = self.problem.opportunities
        imaged = {
            int(table.site[action.opportunity])
            for action in plan.actions
            if table.kind[action.opportunity] == COLLECT
        }
        imaged |= {image.target for image in self.on_board}
        missing = frozenset(self.promised) - imaged
        if not self.deadline_s:
            return missing
        down_s = self.down_s(plan)
        late = {
            target
            for target, deadline_s in self.deadline_s.items()
            if down_s.get(target, math.inf) > deadline_s + TIME_TOLERANCE_S
        }
        return missing | late

    def down_s(self, plan: Plan) -> dict[int, float]:
        """Return when the first image of each target is on the ground, for targets with one."""
        timeline = replay(replace(self.problem, on_board=self.on_board), plan, in_detail=False)
        found = {
            target: image.delivered_s
            for target, image in timeline.collected.items()
            if image.delivered_s is not None
        }
        for one in timeline.brought_down:
            if self.on_board[one.image].amount == 0.0:
                found[one.target] = 0.0
            elif one.delivered_s is not None:
                found[one.target] = min(one.delivered_s, found.get(one.target, math.inf))
        return found


def question_of(
    scenario: Scenario, problem: Problem, asked: Collection[str] | None = None
) -> Question:
    """Return the replan of a scenario in terms of its problem.

    Parameters
    ----------
    asked
        Targets that are new, have changed or have lost their image, if the scenario differs from
        the previous plan's only in these, outages and pins; otherwise None.
    """
    replan = scenario.replan
    assert replan is not None
    freeze_s = scenario.horizon.offset_s(replan.freeze_until)
    rows = rows_of_base(scenario, problem.opportunities, replan)
    later = [
        action
        for action in replan.base
        if action.start is not None and scenario.horizon.offset_s(action.start) >= freeze_s
    ]
    targets = {target.id: i for i, target in enumerate(scenario.targets)}
    news = None
    if asked is not None:
        news = News(
            targets=frozenset(targets[name] for name in asked),
            lost=tuple(_lost_of(scenario, replan, targets, rows)),
        )
    return Question(
        problem=without_on_board(problem),
        deadline_s={
            targets[promise.target_id]: scenario.horizon.offset_s(promise.deliver_by)
            for promise in replan.promises
            if promise.deliver_by is not None
        },
        on_board=problem.on_board,
        base=np.array(sorted(set(rows.values())), dtype=np.int32),
        num_base=len(later),
        promised=tuple(targets[promise.target_id] for promise in replan.promises),
        stability=replan.stability,
        news=news,
    )


def _lost_of(
    scenario: Scenario, replan: Replan, targets: Mapping[str, int], rows: Mapping[int, int]
) -> Iterator[Lost]:
    """Yield the actions of the base after the freeze that are no longer offered."""
    satellites = {satellite.id: i for i, satellite in enumerate(scenario.satellites)}
    for i, action in enumerate(replan.base):
        if i in rows or action.start is None or action.start < replan.freeze_until:
            continue
        yield Lost(
            satellite=satellites[action.satellite_id or ""],
            start_s=scenario.horizon.offset_s(action.start),
            target=None if action.target_id is None else targets[action.target_id],
        )
