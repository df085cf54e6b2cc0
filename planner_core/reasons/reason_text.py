"""Reasons for targets left out, from trials on one satellite."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from planner_core.mdp.model import Guidance, Model, State
from planner_core.mdp.track import NO_TASK
from planner_core.problem import Problem
from planner_core.reasons.displacing import AT_END, Displaced
from planner_core.reasons.forcing import (
    BATTERY,
    RECORDER,
    Forced,
    PlannedSatellite,
)
from planner_core.reasons.reason import (
    Certainty,
    Change,
    Reason,
    ReasonCode,
    Search,
)

_LIMITS: Final[dict[int, Literal["battery", "recorder"]]] = {
    BATTERY: "battery", RECORDER: "recorder",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=False, eq=False)
class ReasonRenderer:
    """States as reasons what trials on one satellite have shown."""

    problem: Problem
    planned: PlannedSatellite
    forced: Forced
    displaced: Displaced
    search: Search

    def reason(self, c: int, target: int, opportunity: int, change: Change | None) -> Reason:
        """Return the reason for the target whose opportunity is candidate ``c``."""
        sequence = self.planned.sequence
        dropped = np.flatnonzero(self.displaced.dropped[c])
        blocking = tuple(sorted(self.planned.positions[dropped].tolist()))
        limit = _LIMITS.get(int(self.displaced.broken[c]))
        if limit is None and not blocking:
            return self._fitting(c, opportunity)
        is_settled = bool(self.displaced.is_settled[c])
        delta = None
        if is_settled:
            delta = float(self.problem.worth[opportunity] - sequence.earned[dropped].sum())
            change = change or Change(opportunity=opportunity, drop=blocking)
        return Reason(
            code=self._code(c, limit, delta),
            certainty=self._certainty(delta),
            detail=self._detail(c, limit, delta, len(blocking)),
            blocking=blocking,
            opportunity=opportunity,
            at_s=None if limit is None else self._break_s(c),
            reward_delta=delta,
            change=change,
        )

    def _fitting(self, c: int, opportunity: int) -> Reason:
        breadth = self.search.breadth
        if self.problem.worth[opportunity] == 0.0:
            detail = "The plan has room for it, but it earns nothing."
        elif breadth is not None and not self._is_looked_at(c, opportunity, breadth):
            return Reason(
                code="not_considered",
                certainty="heuristic",
                detail="The plan has room for it, but the search looked only at the first "
                f"{breadth} tasks (breadth), and it was not one of those.",
                opportunity=opportunity,
            )
        else:
            detail = "The plan has room for it; the solver did not find this."
        return Reason(
            code="solver_limit", certainty="verified", detail=detail, opportunity=opportunity
        )

    def _is_looked_at(self, c: int, opportunity: int, breadth: int) -> bool:
        """Return whether the search considered it, in A(s) after the action it would follow."""
        plan, k = self.planned.sequence, int(self.forced.first[c])
        model = Model(
            track=self.planned.track,
            worth=self.problem.worth[self.problem.satellites[self.planned.index].rows],
            guidance=Guidance(1.0, 0.0, 0.0, 0.0),
            contact_above=self.search.contact_above,
        )
        last = int(plan.rows[k - 1]) if k else NO_TASK
        images = plan.rows[:k][self.planned.track.is_contact[plan.rows[:k]] == 0]
        state = State(
            cursor=last,
            last=last,
            battery=float(plan.battery[k]),
            recorder=float(plan.recorder[k]),
            collected=frozenset(self.planned.track.site[images].tolist()),
        )
        return int(self.problem.local_row[opportunity]) in model.actions(state, breadth)

    def _code(
        self, c: int, limit: Literal["battery", "recorder"] | None, delta: float | None
    ) -> ReasonCode:
        if delta is not None and delta > 0.0:
            return "solver_limit"
        is_alone = self.forced.first[c] == self.forced.last[c]
        if limit is not None and (is_alone or delta is None):
            return limit
        return "slew_conflict" if delta is None else "displaced_by"

    def _certainty(self, delta: float | None) -> Certainty:
        if not self.planned.is_sound:
            return "heuristic"
        is_weighed = delta is not None and delta <= 0.0
        return "proven" if self.search.is_optimal and is_weighed else "verified"

    def _break_s(self, c: int) -> float:
        row = int(self.displaced.break_row[c])
        track = self.planned.track
        return float(track.resources.data_end_s if row == AT_END else track.start_s[row])

    def _detail(self, c: int, limit: str | None, delta: float | None, num_blocking: int) -> str:
        said = []
        if not self.planned.is_sound:
            said.append("The plan already breaks limits of this satellite.")
        if self.forced.first[c] < self.forced.last[c]:
            said.append("The satellite cannot turn in time between it and planned actions.")
        if np.isinf(self.forced.loss[c]):
            said.append("One of those is pinned.")
        if limit is not None:
            said.append(f"With it, the {limit} would reach its limit.")
        if delta is not None:
            actions = "1 action" if num_blocking == 1 else f"{num_blocking} actions"
            change = f"changes by {delta:+g}" if delta else "stays the same"
            said.append(f"It fits in place of {actions}; the reward {change}.")
            if self.search.is_optimal and delta <= 0.0:
                said.append("The plan is proven optimal: no plan with it earns more.")
        return " ".join(said)
