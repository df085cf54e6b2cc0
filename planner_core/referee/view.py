"""A plan together with the referee's verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner_core.problem import CONTACT, Ints, Problem
from planner_core.problem.plan import Action, Plan
from planner_core.referee.replay import replay
from planner_core.referee.timeline import Resourceline, Timeline

Judge = Callable[[Plan], Timeline]
"""A function that judges a plan as the referee does."""


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """A judged plan and the parts of it that count.

    Attributes
    ----------
    judge
        What judges further plans; the referee by default.
    """

    problem: Problem
    plan: Plan
    timeline: Timeline
    judge: Judge | None = None

    @classmethod
    def of(cls, problem: Problem, plan: Plan, judge: Judge | None = None) -> View:
        """Return the plan with its verdict."""
        timeline = judge(plan) if judge else replay(problem, plan, in_detail=False)
        return cls(problem=problem, plan=plan, timeline=timeline, judge=judge)

    def of_another(self, plan: Plan) -> View:
        """Return another plan, judged by the same judge."""
        return View.of(self.problem, plan, self.judge)

    @cached_property
    def curves(self) -> list[Resourceline | None]:
        """Battery and recorder of each satellite."""
        return [own.resources for own in replay(self.problem, self.plan).satellites]

    @cached_property
    def images(self) -> list[Action]:
        """The collects that count, one per target."""
        return [self.plan.actions[image.position] for image in self.timeline.collected.values()]

    @cached_property
    def image_rows(self) -> Ints:
        """The opportunities of ``images``."""
        return np.array([image.opportunity for image in self.images], dtype=np.int32)

    @cached_property
    def contacts(self) -> list[Action]:
        """The contacts of all satellites."""
        kind = self.problem.opportunities.kind
        return [action for action in self.plan.actions if kind[action.opportunity] == CONTACT]

    @cached_property
    def images_by_satellite(self) -> Ints:
        """How many images each satellite takes. Shape ``(num_satellites,)``."""
        own = self.problem.opportunities.satellite[self.image_rows]
        return np.bincount(own, minlength=len(self.problem.satellites)).astype(np.int32)
